"""Maximum constant speeds along a tool path, from q(s) and its derivatives.

The speeds follow from the limits in closed form where the speed is constant, and are lowered until
changes of speed keep the limits, too. The motion at these speeds is planned once. If it uses
other shares of the limits than expected, the ratio corrects the expectation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from knotwork.choosing.limit_shares import (
    Limit,
    LimitShares,
    SharesAlongPath,
    greatest_of_each,
    of_stretches,
    parts,
)
from knotwork.choosing.task import FreeTask, knots_of
from knotwork.errors import FollowingError, PathError
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.kinematics.following.continuation import continue_along
from knotwork.kinematics.following.limiting_constraint import fastest
from knotwork.scenario import ScenarioPath
from knotwork.task_to_joint import followed_path
from knotwork.tool_paths import TimedPath, Timing
from knotwork.waypoints import FloatArray

Speeds = dict[int, float]
"""Speeds [m/s] by index of the stretch."""

DIGITS = 4
"""Number of digits that speeds are rounded down to."""

SLOWEST = 1e-3
"""Lower bound of chosen speeds [m/s]."""

EXPECTED, PLANNED = 0.998, 0.9995
"""Largest used share of each limit, as expected and as planned."""

NEAR = 1.02
"""Factor on the speed that must exceed a limit for the limit to be the binding one."""

NOTEWORTHY = 0.3
"""Shares below this are not compared with the planned ones."""

CAREFUL = 1.001
"""Factor on the expectation where a limit is exceeded."""

ROUNDED = 0.85
"""Fraction of the expected share that planned changes of speed use, per order of a limit."""

PLANS = 8
"""Largest number of planned motions for one path."""

MOST_SLOWER, LEAST_SLOWER = 0.8, 0.995
"""Factors on a speed that is lowered in one step."""

FINER = 0.98
"""Ratio of the speeds tried for a stretch that was slowed down together with others."""

RAMPS = Limit("", "room for changes of speed", 1)

NEXT = Limit("", "the motion before or after", 1)

AT_MOST = Limit("", "at_most", 1)

UNBOUNDED = Limit("", "no limit", 1)

TOLERANCES = Limit("", "the tolerance of the path", 1)


class NoSpeedsError(Exception):
    """No speeds along a path keep the limits.

    Attributes:
        stretch: A stretch without feasible speeds.
        limit: The exceeded limit.
    """

    def __init__(self, stretch: int, limit: Limit) -> None:
        super().__init__()
        self.stretch, self.limit = stretch, limit


@dataclass(frozen=True, eq=False)
class ChosenSpeeds:
    """Chosen speeds along a path.

    Attributes:
        speeds: Speeds [m/s], by index of the stretch.
        limits: Limiting constraint of each.
        timing: Timing of the path at these speeds.
    """

    speeds: Speeds
    limits: dict[int, Limit]
    timing: Timing


class PathSpeeds:
    """The problem of the maximum speeds along one path.

    Args:
        task: The task.
        path: One of its paths.
        most: Upper bounds of the free speeds [m/s], by index of the stretch.
    """

    def __init__(self, task: FreeTask, path: ScenarioPath, most: Mapping[int, float]) -> None:
        self.task, self.path, self.unit = task, path, task.scenario.shown_length[0]
        self.asked = path.asked.choosing(most)
        self.at_most = dict(sorted(most.items()))
        self.caps = dict(self.at_most)
        self.shares = LimitShares(task, path)
        given = (*path.asked.speeds, *most.values())
        fastest = max((one for one in given if one and math.isfinite(one)), default=1.0)
        self.along = SharesAlongPath(task, path, self.shares, fastest)
        self._corrections = np.ones((3 * len(self.asked.lengths), len(self.shares.limits)))
        self._corrections[0::3] = self._corrections[2::3] = ROUNDED ** (self.shares.orders - 1.0)

    def greatest(self) -> ChosenSpeeds:
        """Maximum speeds among some planned motions that keep all limits.

        The expectation is corrected by each planned motion, until each speed has a
        binding limit.

        Raises:
            NoSpeedsError: No speeds are feasible.
        """
        best: ChosenSpeeds | None = None
        failed: NoSpeedsError | None = None
        for _ in range(PLANS):
            try:
                speeds = self.expected()
            except NoSpeedsError as error:
                if best or failed:
                    failed = error
                    break
                speeds = self._fitted(self.bounds)  # the expectation may be too high
            if best and speeds == best.speeds:
                break
            timing, used = self.asked.timed(speeds)[0], self._planned(speeds)
            if used is None:
                failed = NoSpeedsError(min(speeds, default=0), TOLERANCES)
                self.caps = {k: MOST_SLOWER * speed for k, speed in speeds.items()}
            elif (used <= PLANNED).all():
                if best is None or timing.duration < best.timing.duration:
                    found = {k: self._limiting(k, speeds, used) for k in speeds}
                    limits = {k: one or RAMPS for k, one in found.items()}
                    best = ChosenSpeeds(speeds, limits, timing)
                    if None not in found.values():
                        break
                self._correct(timing, used)
            else:
                row, column = np.unravel_index(int(used.argmax()), used.shape)
                failed = NoSpeedsError(int(row) // 3, self.shares.limits[column])
                self._correct(timing, used)
            if failed and not speeds:
                break
        if best is None:
            raise failed or NoSpeedsError(0, RAMPS)
        return best

    def expected(self) -> Speeds:
        """Maximum speeds that are expected to keep the limits.

        Raises:
            NoSpeedsError: No speeds are feasible.
        """
        bounds = self.along.greatest_speeds(EXPECTED / self._corrections[1::3])
        self.bounds = {k: min(float(bounds[k]), cap) for k, cap in self.caps.items()}
        speeds = self._fitted(self.bounds)
        while (used := self._used(speeds)).max() > 1.0:
            speeds = self._fitted(self._slower(speeds, used))
        for k, bound in self.bounds.items():
            speeds = self._raised(speeds, k, bound)
        return speeds

    def _raised(self, speeds: Speeds, k: int, speed: float) -> Speeds:
        """Speeds with a higher one of one stretch, if feasible, and the others unchanged.

        Args:
            speeds: Feasible speeds.
            k: Index of the stretch.
            speed: Largest speed to try [m/s].
        """
        while speed > speeds[k]:
            try:
                trial = self._fitted({**speeds, k: speed})
            except NoSpeedsError:
                speed *= FINER
                continue
            used = self._used(trial)
            if trial[k] > speeds[k] and used.max() <= 1.0:
                return trial
            factor = float(self._factors(used).min(initial=FINER))
            speed = trial[k] * max(factor, MOST_SLOWER)
        return speeds

    def _used(self, speeds: Speeds) -> FloatArray:
        """Largest corrected shares on each stretch, relative to the permitted ones."""
        used = self.along.at(self.asked.timed(speeds)[0])
        return np.asarray(used * self._corrections / EXPECTED)

    def _factors(self, used: FloatArray) -> FloatArray:
        """Factors on the speeds at which shares are fully used, shape (n, m)."""
        return np.asarray(np.maximum(used, 1e-9) ** (-1.0 / self.shares.orders))

    def _slower(self, speeds: Speeds, used: FloatArray) -> Speeds:
        """Lower speeds where a limit is exceeded, in one step at most to that of a neighbour.

        Between equal speeds no ramp is needed.
        """
        used = of_stretches(used)
        factors = self._factors(used)
        worst = factors.argmin(axis=1)
        all_of = self.asked.timed(speeds)[1]
        slower = dict(speeds)
        for k in np.flatnonzero((used > 1.0).any(axis=1)).tolist():
            own = [k] if k in speeds else [*[j for j in speeds if j < k][-1:]]
            own += [] if k in speeds else [*[j for j in speeds if j > k][:1]]
            limit = self.shares.limits[worst[k]]
            if not own:
                raise NoSpeedsError(k, limit)
            factor = float(np.clip(factors[k, worst[k]], MOST_SLOWER, LEAST_SLOWER))
            for j in own:
                lower = factor * speeds[j]
                if lower < SLOWEST:
                    raise NoSpeedsError(j, limit)
                beside = (all_of[i] for i in (j - 1, j + 1) if 0 <= i < len(all_of))
                lower = max((one for one in beside if lower <= one < speeds[j]), default=lower)
                slower[j] = min(slower[j], lower)
        return slower

    def _fitted(self, speeds: Speeds) -> Speeds:
        """Rounded speeds with room for changes of speed, none above the given ones.

        Raises:
            NoSpeedsError: The given ones leave no room.
        """
        for k, speed in speeds.items():
            if math.isinf(speed):
                raise NoSpeedsError(k, UNBOUNDED)
        while True:
            bounded = {k: self._rounded(max(speed, SLOWEST)) for k, speed in speeds.items()}
            try:
                speeds = self.asked.fitted(bounded)
            except PathError as error:
                raise NoSpeedsError(getattr(error, "stretch", 0), RAMPS) from error
            if speeds == bounded:
                return speeds

    def _rounded(self, speed: float) -> float:
        """A speed as written to the file."""
        return rounded(self.unit * speed) / self.unit

    def _planned(self, speeds: Speeds) -> FloatArray | None:
        """Shares that the planned motion uses on each stretch; `None` if it is infeasible."""
        scenario, path, own = self.task.scenario, self._timed(speeds), self.shares.robot
        robot, start, pull = self.task.start(path)
        knots, times = knots_of(scenario), path.motion.start_time + parts(path.motion.timing)
        ends = times[[0, *range(3, len(times), 3)]]
        try:
            way = continue_along(robot, path.motion, start[None], ends, pull=pull)
            time, _, *states, _ = followed_path(scenario, robot, path, start, knots, way, pull)
        except (PathError, FollowingError):
            return None
        q, v, a = (one[:, : own.dof] for one in states)
        curve = ModifiedHermiteSpline(time, q, v, knots=knots, acceleration=a)
        used = self.shares.of_curve(curve, times)
        # a chosen start depends on velocities along the path, too
        fast = fastest(way.time, way.position[:, 0], way.velocity[:, 0]) / robot.velocity_limit
        steps = greatest_of_each(fast, 0.5 * (way.time[1:] + way.time[:-1]), times)
        np.maximum(used[:, : own.dof], steps[:, : own.dof], out=used[:, : own.dof])
        return used

    def _timed(self, speeds: Speeds) -> ScenarioPath:
        """The path with these speeds."""
        timing, found = self.asked.timed(speeds)
        start = self.path.motion.start_time
        times, full = (start + timing.times).tolist(), (start + timing.full_speed).tolist()
        stretches = tuple(
            replace(one, start=times[k], end=times[k + 1], speed=found[k], full_speed=(*full[k],))
            for k, one in enumerate(self.path.stretches)
        )
        motion = TimedPath(self.path.motion.path, timing, start)
        return replace(self.path, motion=motion, stretches=stretches, asked=self.asked)

    def _correct(self, timing: Timing, used: FloatArray) -> None:
        """Correct the expectation by the planned shares."""
        if self.task.scenario.task.pull_to_middle:
            full_speed = float(timing.speeds.max())
            self.along = SharesAlongPath(self.task, self.path, self.shares, full_speed)
        expected = self.along.at(timing)
        compared = np.maximum(used, self._corrections * expected) > NOTEWORTHY
        ratio = np.clip(used / np.maximum(expected, 1e-9), 0.1, 1e3)
        ratio[used > PLANNED] *= CAREFUL
        self._corrections = np.where(compared, ratio, self._corrections)

    def _limiting(self, k: int, speeds: Speeds, used: FloatArray) -> Limit | None:
        """Limiting constraint of a stretch's speed, or `None`."""
        if speeds[k] >= self._rounded(self.caps[k]):
            return AT_MOST if self.caps[k] == self.at_most[k] else TOLERANCES
        faster = self._fitted({**speeds, k: speeds[k] / FINER})
        if faster[k] <= speeds[k]:
            return RAMPS
        all_of = self.asked.timed(speeds)[1]
        beside = (j for j in (k - 1, k, k + 1) if 0 <= j < len(all_of))
        alike = [j for j in beside if all_of[j] == all_of[k]]
        factors = self._factors(of_stretches(used)[alike].max(axis=0))
        return self.shares.limits[int(factors.argmin())] if factors.min() < NEAR else None


def rounded(speed: float) -> float:
    """A speed rounded down to a few digits."""
    if math.isinf(speed):
        return speed
    digit = 10.0 ** (math.floor(math.log10(speed)) - DIGITS + 1)
    return float(f"{math.floor(speed / digit * (1.0 + 1e-12)) * digit:.{DIGITS}g}")
