"""Maximum constant speeds along one tool path, from q(s) and its derivatives.

Where the speed is constant, it follows from the limits in closed form. The speeds are then lowered
until changes of speed keep the limits as well. A planned motion corrects the expected utilisation,
and caps the speeds with which it exceeds a limit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple, TypeAlias

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


class Reason(str, Enum):
    """A bound of a speed along a path other than the limits of joints and of the tool.

    Attributes:
        AT_MOST: The upper bound of the speed in the task.
        PATH_ACCELERATION: The acceleration along the path, with which speeds change.
        TOLERANCES: The tolerances of the path.
        ADJACENT_MOTION: The motion before or after the path.
        NOTHING: Nothing bounds the speed.
    """

    AT_MOST = "at_most"
    PATH_ACCELERATION = "path acceleration"
    TOLERANCES = "path tolerance"
    ADJACENT_MOTION = "adjacent motion"
    NOTHING = "nothing"

    __str__ = str.__str__


SpeedBound: TypeAlias = LimitedQuantity | Reason


class BoundedSpeed(NamedTuple):
    """A speed [m/s], and the bound for which it is not higher."""

    speed: float
    bound: SpeedBound


@dataclass(eq=False)
class SpeedError(Exception):
    """A stretch of a path on which no speed is feasible, or a given or chosen one is not.

    Attributes:
        path: The path.
        stretch: Index of the stretch.
        bound: The exceeded limit, or another bound of the speed.
    """

    path: ScenarioPath
    stretch: int
    bound: SpeedBound


@dataclass(frozen=True, eq=False)
class PathSpeedProblem:
    """The maximum speeds along one path under caps and limits.

    Attributes:
        number: Index of the path among those of the task.
        path: The path at its nominal speed.
        per_metre: Number of the file's units of length per metre; speeds are round numbers of them.
        utilisation: Utilisation of the limits along it, at any speeds.
        caps: Upper bounds of the unknown speeds, by index of the stretch.
        correction: Ratio of the planned to the expected utilisation, shape (n, 3, m).
    """

    number: int
    path: ScenarioPath
    per_metre: float
    utilisation: PathUtilisation
    caps: Mapping[int, BoundedSpeed]
    correction: FloatArray

    def choose(self) -> PathSpeeds:
        """Choose the maximum speeds that are expected to keep the limits.

        Raises:
            SpeedError: No speeds are feasible.
        """
        speeds = self._constant_speeds()
        while True:
            speeds, timing, all_speeds = self._with_ramps(speeds)
            expected = self.utilisation.with_timing(timing) * self.correction
            largest = (expected / MAX_EXPECTED_UTILISATION).max(axis=1)
            if largest.max() <= 1.0:
                return PathSpeeds(self, speeds, timing)
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
                raise SpeedError(self.path, k, Reason.NOTHING)
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
            SpeedError: The given speeds do not allow the changes of speed.
        """
        while True:
            speeds = {
                k: BoundedSpeed(round_speed(self.per_metre * speed) / self.per_metre, bound)
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
                if k not in speeds or highest is None:
                    raise SpeedError(self.path, k, Reason.PATH_ACCELERATION) from error
                lower = (1.0 - 10.0**-SPEED_DIGITS) * speeds[k].speed  # by rounding or more
                speeds[k] = BoundedSpeed(min(highest, lower), Reason.PATH_ACCELERATION)
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
            SpeedError: No lower speed may be chosen there.
        """
        k = int(utilisation.max(axis=1).argmax())
        factor, limit = self.required_slowdown(utilisation[k])
        factor = min(factor, MAX_SPEED_FACTOR)
        stretches = [k]
        if k not in self.caps:  # the next stretches with a chosen speed
            before = [j for j in self.caps if j < k]
            after = [j for j in self.caps if j > k]
            stretches = before[-1:] + after[:1]
        if not stretches or factor * min(speeds[j] for j in stretches) < MIN_SPEED:
            raise SpeedError(self.path, k, limit)
        lowered = {}
        for j in stretches:
            lower = factor * speeds[j]
            neighbours = (*speeds[max(j - 1, 0) : j], *speeds[j + 1 : j + 2])
            slower = max((v for v in neighbours if lower <= v < speeds[j]), default=lower)
            lowered[j] = BoundedSpeed(slower, limit)
        return lowered

    def required_slowdown(self, utilisation: FloatArray) -> tuple[float, LimitedQuantity]:
        """Factor on a speed that brings limits from their utilisation, shape (m,), to 1.

        A step lowers a speed at most by `MIN_SPEED_FACTOR`. The limit is the one with that factor.
        """
        factors = np.maximum(utilisation, 1e-9) ** (-1.0 / self.utilisation.orders)
        column = int(factors.argmin())
        limit = self.utilisation.limits.quantities[column]
        return max(float(factors[column]), MIN_SPEED_FACTOR), limit


@dataclass(frozen=True, eq=False)
class PathSpeeds:
    """Chosen speeds along one path.

    Attributes:
        problem: The problem that they solve; once the motion with them is planned, corrected by it.
        by_stretch: Each speed and its bound, by index of the stretch.
        timing: Timing of the whole path with them.
        error: A limit that the motion with these speeds exceeds, or `None`.
    """

    problem: PathSpeedProblem
    by_stretch: Mapping[int, BoundedSpeed]
    timing: Timing
    error: SpeedError | None = None

    def slower_problem(self, factor: float, reason: Reason) -> PathSpeedProblem:
        """The problem with caps at a fraction of these speeds."""
        caps = {k: BoundedSpeed(factor * v, reason) for k, (v, _) in self.by_stretch.items()}
        return replace(self.problem, caps=caps)

    def without_motion(self, cause: InputError) -> PathSpeeds:
        """These speeds with the error that they have no motion; their problem has lower caps."""
        error = SpeedError(self.problem.path, 0, Reason.TOLERANCES)
        error.__cause__ = cause
        slower = self.slower_problem(MIN_SPEED_FACTOR, Reason.TOLERANCES)
        return replace(self, problem=slower, error=error)

    def corrected(self, timed: SolvedScenario) -> PathSpeeds:
        """The speeds, with their error and a problem corrected by the planned motion.

        The problem caps the speeds with which this motion exceeds a limit.

        Args:
            timed: The task with these speeds.
        """
        problem = self.problem
        limits = problem.utilisation.limits
        planned = planned_utilisation(timed, timed.scenario.paths[problem.number], limits)
        expected = problem.utilisation.with_timing(self.timing)
        ratio = np.clip(planned / np.maximum(expected, 1e-9), 0.1, 1e3)
        compared = np.maximum(planned, problem.correction * expected) > SIGNIFICANT_UTILISATION
        correction = np.where(compared, ratio, problem.correction)
        caps = dict(problem.caps)
        largest = planned.max(axis=1)
        for k, of_stretch in enumerate(largest):
            if k in caps and of_stretch.max() > MAX_PLANNED_UTILISATION:
                factor, limit = problem.required_slowdown(of_stretch / MAX_EXPECTED_UTILISATION)
                caps[k] = BoundedSpeed(factor * self.by_stretch[k].speed, limit)
        error = None
        if largest.max() > MAX_PLANNED_UTILISATION:
            k, column = divmod(int(largest.argmax()), largest.shape[1])
            error = SpeedError(problem.path, k, limits.quantities[column])
        problem = replace(problem, caps=caps, correction=correction)
        return replace(self, problem=problem, error=error)


def path_speed_problems(solved: SolvedScenario) -> list[PathSpeedProblem]:
    """The problems of all paths with chosen speeds, before anything is planned."""
    per_metre = solved.scenario.units.per_metre
    problems = []
    for number, path in enumerate(solved.scenario.paths):
        if bounds := path.requested.max_speeds:
            utilisation = PathUtilisation(solved, path)
            caps = {k: BoundedSpeed(speed, Reason.AT_MOST) for k, speed in bounds.items()}
            correction = np.ones((len(path.stretches), 3, len(utilisation.limits.quantities)))
            problems.append(
                PathSpeedProblem(number, path, per_metre, utilisation, caps, correction)
            )
    return problems


def round_speed(speed: float) -> float:
    """A speed rounded down to a few digits."""
    digit = 10.0 ** (math.floor(math.log10(speed)) - SPEED_DIGITS + 1)
    return float(f"{math.floor(speed / digit * (1.0 + 1e-12)) * digit:.{SPEED_DIGITS}g}")
