"""Maximum constant speeds along one tool path, from q(s) and its derivatives.

Where the speed is constant, it follows from the limits in closed form. The speeds are then lowered
until changes of speed keep the limits as well. A planned motion corrects the expected utilisation,
and lowers the upper bounds, here called caps, of speeds with which it exceeds a limit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths import Timing
from knotwork.errors import InputError, PathError, RampError, StretchTimeError
from knotwork.planning.choosing.path_limit_utilisation import (
    CONSTANT_SPEED_PART,
    PathUtilisation,
    planned_utilisation,
)
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.timing.state_limits import LimitedQuantity
from knotwork.task.scenario import ScenarioPath
from knotwork.units import rounded_up

SPEED_DIGITS = 4
"""Number of digits to which speeds are rounded down."""

MIN_SPEED = 1e-3
"""Lowest speed that a limit may require [m/s]."""

MAX_EXPECTED_UTILISATION = 0.998
"""Maximum expected utilisation of each limit."""

MAX_PLANNED_UTILISATION = 0.9995
"""Maximum utilisation by a planned motion; between samples it may be more."""

SIGNIFICANT_UTILISATION = 0.3
"""Utilisation below which a limit is too far away to be corrected."""

MIN_SPEED_FACTOR = 0.8
"""Minimum factor on a speed that is lowered in one step."""

MAX_SPEED_FACTOR = 0.995
"""Maximum factor on a speed that is lowered in one step."""


class SpeedBound(str, Enum):
    """A bound of a speed along a path other than the limits of joints, tool and links.

    Attributes:
        AT_MOST: The upper bound of the speed in the task.
        PATH_ACCELERATION: The acceleration along the path, with which speeds change.
        TOLERANCES: The tolerances of the path.
        ADJACENT_MOTION: The motion before or after the path.
    """

    AT_MOST = "at_most"
    PATH_ACCELERATION = "path acceleration"
    TOLERANCES = "path tolerance"
    ADJACENT_MOTION = "adjacent motion"


class BoundedSpeed(NamedTuple):
    """A speed along a path [m/s], and the limit or other bound for which it is not higher."""

    speed: float
    bound: LimitedQuantity | SpeedBound


@dataclass(frozen=True, eq=False)
class PathSpeedProblem:
    """The maximum speeds along one path under caps and limits.

    Attributes:
        solved: The scenario in which these speeds are unknown.
        number: Index of the path among its paths.
        utilisation: Utilisation of the limits along the path, at any speeds.
        caps: Upper bounds of the unknown speeds, by index of the stretch.
        correction: Ratio of the planned to the expected utilisation, shape (n, 3, m).
    """

    solved: SolvedScenario
    number: int
    utilisation: PathUtilisation
    caps: Mapping[int, BoundedSpeed]
    correction: FloatArray

    @property
    def path(self) -> ScenarioPath:
        """The path at its nominal speed."""
        return self.solved.scenario.paths[self.number]

    @property
    def speeds(self) -> Mapping[int, BoundedSpeed]:
        """The maximum speeds that are expected to keep the limits, by index of the stretch.

        Raises:
            InputError: No speeds are feasible.
        """
        return self._solution[0]

    @property
    def timing(self) -> Timing:
        """Timing of the path with the maximum speeds."""
        return self._solution[1]

    @cached_property
    def _solution(self) -> tuple[dict[int, BoundedSpeed], Timing]:
        """Maximum constant speeds, lowered until changes of speed keep the limits; the timing."""
        speeds = self._constant_speeds()
        while True:
            speeds, timing, all_speeds = self._with_ramps(speeds)
            expected = self.utilisation.with_timing(timing) * self.correction
            largest = (expected / MAX_EXPECTED_UTILISATION).max(axis=1)
            if largest.max() <= 1.0:
                return speeds, timing
            speeds = speeds | self._lowered(largest, all_speeds)

    def _constant_speeds(self) -> dict[int, BoundedSpeed]:
        """The chosen speeds, from the limits where the speed is constant."""
        allowed = MAX_EXPECTED_UTILISATION / self.correction[:, CONSTANT_SPEED_PART]
        by_limit = self.utilisation.max_speeds(allowed)
        speeds = {}
        for k, cap in self.caps.items():
            column = int(by_limit[k].argmin())
            speed = max(float(by_limit[k, column]), MIN_SPEED)
            limited = BoundedSpeed(speed, self.utilisation.limits.quantities[column])
            speeds[k] = cap if cap.speed <= speed else limited
            if math.isinf(speeds[k].speed):
                raise InputError(
                    "nothing bounds the speed of the path; accepted: speed: {at_most: a speed}, "
                    "or limits",
                    where=self.solved.where(self.path.first + 1 + k, "speed"),
                )
        return speeds

    def _with_ramps(
        self, speeds: Mapping[int, BoundedSpeed]
    ) -> tuple[dict[int, BoundedSpeed], Timing, tuple[float, ...]]:
        """Round the speeds, and lower them until the stretches are long enough for their changes.

        Lowering one stretch never lets a neighbour go faster, so lowering them one by one gives
        the largest feasible speeds.

        Returns:
            The speeds, the timing of the path, and the speed of each stretch [m/s].

        Raises:
            InputError: The given speeds do not allow the changes of speed.
        """
        per_metre = self.solved.scenario.units.per_metre
        while True:
            speeds = {
                k: BoundedSpeed(round_speed(per_metre * speed) / per_metre, bound)
                for k, (speed, bound) in speeds.items()
            }
            try:
                timing, all_speeds = self.path.requested.timed(
                    {k: speed for k, (speed, _) in speeds.items()}
                )
            except PathError as error:
                # any other error concerns the whole path
                k = error.stretch if isinstance(error, RampError | StretchTimeError) else 0
                highest = error.highest_speed if isinstance(error, RampError) else None
                bound = SpeedBound.PATH_ACCELERATION
                if k not in speeds or highest is None:
                    raise path_speed_error(self.solved, self.path, k, bound) from error
                lower = (1.0 - 10.0**-SPEED_DIGITS) * speeds[k].speed  # by rounding or more
                speeds[k] = BoundedSpeed(min(highest, lower), bound)
            else:
                return speeds, timing, all_speeds

    def _lowered(self, utilisation: FloatArray, speeds: Sequence[float]) -> dict[int, BoundedSpeed]:
        """Lower speeds where the excess over a limit is largest.

        A step lowers a speed at most to that of a neighbour, because there is no ramp between equal
        speeds.

        Args:
            utilisation: Expected utilisation of the limits on each stretch, shape (n, m).
            speeds: Speeds of the stretches [m/s], length n.

        Raises:
            InputError: No lower speed may be chosen there.
        """
        k = int(utilisation.max(axis=1).argmax())
        factor, limit = self._required_slowdown(utilisation[k])
        factor = min(factor, MAX_SPEED_FACTOR)
        stretches = [k]
        if k not in self.caps:  # the next stretches with a chosen speed
            before = [j for j in self.caps if j < k]
            after = [j for j in self.caps if j > k]
            stretches = before[-1:] + after[:1]
        if not stretches or factor * min(speeds[j] for j in stretches) < MIN_SPEED:
            raise path_speed_error(self.solved, self.path, k, limit)
        lowered = {}
        for j in stretches:
            lower = factor * speeds[j]
            neighbours = (*speeds[max(j - 1, 0) : j], *speeds[j + 1 : j + 2])
            slower = max((v for v in neighbours if lower <= v < speeds[j]), default=lower)
            lowered[j] = BoundedSpeed(slower, limit)
        return lowered

    def _required_slowdown(self, utilisation: FloatArray) -> tuple[float, LimitedQuantity]:
        """Factor on a speed that brings limits from their utilisation, shape (m,), to 1.

        A step lowers a speed at most by `MIN_SPEED_FACTOR`. The limit is the one with that factor.
        """
        factors = np.maximum(utilisation, 1e-9) ** (-1.0 / self.utilisation.orders)
        column = int(factors.argmin())
        limit = self.utilisation.limits.quantities[column]
        return max(float(factors[column]), MIN_SPEED_FACTOR), limit

    def slower_caps(self, factor: float, bound: SpeedBound) -> dict[int, BoundedSpeed]:
        """Caps at a fraction of the maximum speeds, because of another bound."""
        return {k: BoundedSpeed(factor * speed, bound) for k, (speed, _) in self.speeds.items()}

    def corrected(self, timed: SolvedScenario) -> tuple[PathSpeedProblem, InputError | None]:
        """The problem corrected by the motion planned with its speeds, and the error of the motion.

        Args:
            timed: The task with these speeds, solved.

        Returns:
            The problem, with lower caps where the motion exceeds a limit; and the error for the
            limit that it exceeds most, or `None`.
        """
        limits = self.utilisation.limits
        planned = planned_utilisation(timed, timed.scenario.paths[self.number], limits)
        expected = self.utilisation.with_timing(self.timing)
        ratio = np.clip(planned / np.maximum(expected, 1e-9), 0.1, 1e3)
        compared = np.maximum(planned, self.correction * expected) > SIGNIFICANT_UTILISATION
        correction = np.where(compared, ratio, self.correction)
        caps = dict(self.caps)
        largest = planned.max(axis=1)
        for k, of_stretch in enumerate(largest):
            if k in caps and of_stretch.max() > MAX_PLANNED_UTILISATION:
                factor, limit = self._required_slowdown(of_stretch / MAX_EXPECTED_UTILISATION)
                caps[k] = BoundedSpeed(factor * self.speeds[k].speed, limit)
        error = None
        if largest.max() > MAX_PLANNED_UTILISATION:
            k, column = divmod(int(largest.argmax()), largest.shape[1])
            error = path_speed_error(self.solved, self.path, k, limits.quantities[column])
        return replace(self, caps=caps, correction=correction), error


def path_speed_problems(solved: SolvedScenario) -> list[PathSpeedProblem]:
    """The problems of all paths with chosen speeds, before anything is planned."""
    problems = []
    for number, path in enumerate(solved.scenario.paths):
        if bounds := path.requested.max_speeds:
            utilisation = PathUtilisation(solved, path)
            caps = {k: BoundedSpeed(speed, SpeedBound.AT_MOST) for k, speed in bounds.items()}
            correction = np.ones((len(path.stretches), 3, len(utilisation.limits.quantities)))
            problems.append(PathSpeedProblem(solved, number, utilisation, caps, correction))
    return problems


def round_speed(speed: float) -> float:
    """A speed rounded down to a few digits."""
    digit = 10.0 ** (math.floor(math.log10(speed)) - SPEED_DIGITS + 1)
    return float(f"{math.floor(speed / digit * (1.0 + 1e-12)) * digit:.{SPEED_DIGITS}g}")


def path_speed_error(
    solved: SolvedScenario,
    path: ScenarioPath,
    stretch: int,
    bound: LimitedQuantity | SpeedBound,
    *,
    utilisation: float | None = None,
    cause: InputError | None = None,
) -> InputError:
    """The error for a stretch of a path without feasible speeds, with accepted changes.

    Args:
        solved: The scenario and its IK solutions.
        path: The path in it.
        stretch: Index of the stretch.
        bound: The exceeded limit, or another bound of the speed.
        utilisation: Utilisation of the limit, if known.
        cause: The reason why the tolerances of the path are not kept, if known.
    """
    i = path.first + 1 + stretch
    text = solved.scenario.units.text
    start, end = (waypoint.name for waypoint in solved.scenario.waypoints[i - 1 : i + 1])
    requested = path.requested
    is_chosen = stretch in requested.max_speeds
    duration = requested.durations[stretch]
    given = requested.speeds[stretch] or path.stretches[stretch].speed
    if requested.max_speeds and duration:  # the stretches still have the nominal speed
        given = requested.lengths[stretch] / duration
    speed = "no speed keeps the limits" if is_chosen else f"at {text(given, 'm/s')}"
    if path.timed_path.has_own_clock:
        weave = path.stretches[stretch].weave
        accepted = "a slower frame" if weave is None else "a narrower weave, a lower frequency"
    elif is_chosen:
        accepted = "another path or path.acceleration"
    else:
        accepted = "speed: fastest"
    last = "a higher limit"
    if isinstance(bound, LimitedQuantity):
        excess = f"reaches {rounded_up(utilisation, 4):.4g} times" if utilisation else "exceeds"
        subject = repr(bound.subject) if bound.subject else "the tool"
        reason = f"{subject} {excess} its limit of {bound.quantity.replace('_', ' ')}"
    elif bound is SpeedBound.PATH_ACCELERATION:
        shown = text(requested.acceleration, "m/s²")
        reason = f"the stretch is too short to change speed at path.acceleration, {shown}"
        accepted += ", a higher path.acceleration"
    else:
        reason = f"the tolerances are not kept{f' ({cause})' if cause else ''}"
        accepted, last = "larger tolerances of the path", "another path"
    return InputError(
        f"{speed} along the path from {start!r} to {end!r}: {reason}; accepted: {accepted}, or "
        f"{last}",
        where=solved.where(i, _key(solved, i)),
    )


def _key(solved: SolvedScenario, i: int) -> str:
    """The key that gives the speed to waypoint i, on a path."""
    given = solved.scenario.task.waypoints[solved.scenario.task_index[i]]
    return next(key for key in ("speed", "after", "time") if getattr(given, key) is not None)
