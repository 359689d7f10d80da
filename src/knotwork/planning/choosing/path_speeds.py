"""Maximum constant speeds along one tool path, from q(s) and its derivatives.

Where the speed is constant, it follows from the limits in closed form. The speeds are then lowered
until changes of speed keep the limits as well. A planned motion corrects the expected shares of the
limits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum

import numpy as np

from knotwork.errors import PathError
from knotwork.planning.choosing.free_task import FreeTask
from knotwork.planning.choosing.limit_shares import (
    Limit,
    LimitShares,
    SharesAlongPath,
    of_stretches,
)
from knotwork.scenario import ScenarioPath
from knotwork.waypoints import FloatArray

Speeds = dict[int, float]
"""Speeds [m/s] by index of the stretch."""

SPEED_DIGITS = 4
"""Number of digits to which speeds are rounded down."""

MIN_SPEED = 1e-3
"""Speed below which no speed is lowered to keep a limit [m/s]."""

FIT_ROUNDS = 100
"""Largest number of rounds until rounded speeds have room for changes of speed."""

EXPECTED_SHARE, PLANNED_SHARE = 0.998, 0.9995
"""Largest used share of each limit, as expected and as planned."""

EXCESS_CORRECTION = 1.001
"""Factor on the expectation where a limit is exceeded."""

RAMP_RATIO = 0.85
"""Fraction of the expected share that planned changes of speed use, for each order of a limit."""

MIN_SLOWDOWN, MAX_SLOWDOWN = 0.995, 0.8
"""Factors on a speed that is lowered in one step."""

BINDING_FACTOR = 1.02
"""Factor on a bound. A bound limits a speed that would otherwise exceed it by this factor."""


class SpeedBound(StrEnum):
    """A bound of a speed along a path other than a limit."""

    RAMPS = "room for changes of speed"
    NEIGHBOURS = "the motion before or after"
    AT_MOST = "at_most"
    TOLERANCES = "the tolerance of the path"
    NOTHING = "no limit"


class NoSpeedsError(Exception):
    """No speeds along a path keep the limits.

    Attributes:
        path: The path.
        stretch: A stretch without feasible speeds.
        limit: The exceeded limit.
    """

    def __init__(self, path: ScenarioPath, stretch: int, limit: Limit | SpeedBound) -> None:
        super().__init__()
        self.path, self.stretch, self.limit = path, stretch, limit


class PathSpeeds:
    """The problem of the maximum speeds along one path.

    Args:
        task: The task.
        path: One of its paths.
        caps: Upper bounds of the free speeds [m/s] and their origins, by index of the stretch.
    """

    def __init__(
        self, task: FreeTask, path: ScenarioPath, caps: Mapping[int, tuple[float, SpeedBound]]
    ) -> None:
        self.path, self.asked, self.caps = path, path.asked, dict(caps)
        self.unit = task.scenario.shown_length[0]
        self.shares = LimitShares(task, path)
        speeds = (*path.asked.speeds, *(cap for cap, _ in caps.values()))
        fastest = max((speed for speed in speeds if speed and math.isfinite(speed)), default=1.0)
        self.along = SharesAlongPath(task, path, self.shares, fastest)
        self._ratio = np.ones((3 * len(path.stretches), len(self.shares.limits)))
        self._ratio[0::3] = self._ratio[2::3] = RAMP_RATIO ** (self.shares.orders - 1.0)
        self.used = np.zeros_like(self._ratio)

    def choose(self) -> Speeds:
        """Maximum speeds that are expected to keep the limits.

        Raises:
            NoSpeedsError: No speeds are feasible.
        """
        bounds = self.along.greatest_speeds(EXPECTED_SHARE / self._ratio[1::3])
        speeds = self._fit(
            {k: min(max(float(bounds[k]), MIN_SPEED), cap) for k, (cap, _) in self.caps.items()}
        )
        while (used := self._expected_shares(speeds)).max() > 1.0:
            speeds = self._fit(self._slow_down(speeds, of_stretches(used)))
        self.speeds = speeds
        return speeds

    def _expected_shares(self, speeds: Speeds) -> FloatArray:
        """Expected shares of the parts of stretches, relative to the permitted ones."""
        used = self.along.used_shares(self.asked.timed(speeds)[0])
        return np.asarray(used * self._ratio / EXPECTED_SHARE)

    def _factors(self, used: FloatArray) -> FloatArray:
        """Factors on the speeds at which shares are fully used, shape (n, m)."""
        return np.asarray(np.maximum(used, 1e-9) ** (-1.0 / self.shares.orders))

    def _slow_down(self, speeds: Speeds, used: FloatArray) -> Speeds:
        """Lower the speed where the excess over a limit is largest, by one step.

        A step lowers a speed at most to that of a neighbour, because there is no ramp between equal
        speeds.
        """
        k = int(used.max(axis=1).argmax())
        factors = self._factors(used[k])
        limit = self.shares.limits[int(factors.argmin())]
        factor = float(np.clip(factors.min(), MAX_SLOWDOWN, MIN_SLOWDOWN))
        # next to a stretch with a given speed, the nearest ones with a chosen speed
        before, after = [j for j in speeds if j < k][-1:], [j for j in speeds if j > k][:1]
        stretches = [k] if k in speeds else before + after
        if not stretches:
            raise NoSpeedsError(self.path, k, limit)
        all_speeds, slower = self.asked.timed(speeds)[1], dict(speeds)
        for j in stretches:
            lower = factor * speeds[j]
            if lower < MIN_SPEED:
                raise NoSpeedsError(self.path, k, limit)
            neighbours = (*all_speeds[max(j - 1, 0) : j], *all_speeds[j + 1 : j + 2])
            slower[j] = max((v for v in neighbours if lower <= v < speeds[j]), default=lower)
        return slower

    def _fit(self, speeds: Speeds) -> Speeds:
        """Rounded speeds with room for changes of speed, none above the given ones.

        Raises:
            NoSpeedsError: The given ones leave no room.
        """
        for k, speed in speeds.items():
            if math.isinf(speed):
                raise NoSpeedsError(self.path, k, SpeedBound.NOTHING)
        stretch, cause = 0, None
        for _ in range(FIT_ROUNDS):
            bounded = {k: round_speed(self.unit * v) / self.unit for k, v in speeds.items()}
            try:
                speeds = self.asked.fitted(bounded)
            except PathError as error:
                stretch, cause = getattr(error, "stretch", None) or 0, error
                break
            if speeds == bounded:
                return speeds
        raise NoSpeedsError(self.path, stretch, SpeedBound.RAMPS) from cause

    def lower_caps(self) -> None:
        """Lower all speeds because the arm can't follow the path at the chosen ones."""
        for k, speed in self.speeds.items():
            if speed <= MIN_SPEED:
                raise NoSpeedsError(self.path, k, SpeedBound.TOLERANCES)
            self.caps[k] = MAX_SLOWDOWN * speed, SpeedBound.TOLERANCES

    def verify(self, task: FreeTask, path: ScenarioPath) -> NoSpeedsError | None:
        """The limit that a planned motion exceeds, or `None`; its shares correct the expected ones.

        Args:
            task: The task with the chosen speeds.
            path: The path in this task.
        """
        timing = path.motion.timing
        if task.scenario.task.pull_to_middle:
            self.along = SharesAlongPath(task, path, self.shares, float(timing.speeds.max()))
        used, expected = self.shares.of_motion(task, path), self.along.used_shares(timing)
        ratio = np.clip(used / np.maximum(expected, 1e-9), 0.1, 1e3)
        ratio[used > PLANNED_SHARE] *= EXCESS_CORRECTION
        compared = np.maximum(used, self._ratio * expected) > 0.3
        self._ratio = np.where(compared, ratio, self._ratio)
        self.used = used
        row, column = divmod(int(used.argmax()), used.shape[1])
        within = used[row, column] <= PLANNED_SHARE
        return None if within else NoSpeedsError(self.path, row // 3, self.shares.limits[column])

    def limiting_constraint(self, k: int) -> Limit | SpeedBound | None:
        """Limiting constraint of the chosen speed of a stretch after `verify`, or `None`."""
        cap, bound = self.caps[k]
        if BINDING_FACTOR * self.speeds[k] > cap:
            return bound
        if self._fit({**self.speeds, k: BINDING_FACTOR * self.speeds[k]})[k] <= self.speeds[k]:
            return SpeedBound.RAMPS
        speeds = self.asked.timed(self.speeds)[1]
        neighbours = range(max(k - 1, 0), min(k + 2, len(speeds)))
        alike = [j for j in neighbours if speeds[j] == speeds[k]]
        factors = self._factors(of_stretches(self.used)[alike].max(axis=0))
        return self.shares.limits[int(factors.argmin())] if factors.min() < BINDING_FACTOR else None


def round_speed(speed: float) -> float:
    """A speed rounded down to a few digits."""
    if math.isinf(speed):
        return speed
    digit = 10.0 ** (math.floor(math.log10(speed)) - SPEED_DIGITS + 1)
    return float(f"{math.floor(speed / digit * (1.0 + 1e-12)) * digit:.{SPEED_DIGITS}g}")
