"""Maximum constant speeds along one tool path, from q(s) and its derivatives.

Where the speed is constant, it follows from the limits in closed form. The speeds are then lowered
until changes of speed keep the limits as well. A planned motion corrects the expected utilisation,
and caps the speeds with which it exceeds a limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths import Timing
from knotwork.errors import PathError
from knotwork.planning.choosing.free_sections import FreeTask
from knotwork.planning.choosing.path_limit_utilisation import (
    CONSTANT_SPEED_PART,
    PathUtilisation,
    planned_utilisation,
    state_limits,
)
from knotwork.planning.timing.state_limits import LimitedQuantity
from knotwork.task.scenario import ScenarioPath

SPEED_DIGITS = 4
"""Number of digits to which speeds are rounded down."""

MIN_SPEED = 1e-3
"""Speed that no speed is lowered below to keep a limit [m/s]."""

EXPECTED_UTILISATION, PLANNED_UTILISATION = 0.998, 0.9995
"""Largest utilisation of each limit, as expected and as planned; between samples it may be more."""

SIGNIFICANT_UTILISATION = 0.3
"""Utilisation below which a limit is too far away to be corrected."""

MIN_SLOWDOWN, MAX_SLOWDOWN = 0.995, 0.8
"""Factors on a speed that is lowered in one step."""

RAMPS = LimitedQuantity("", "path acceleration")
"""The acceleration along the path, with which speeds change."""

ADJACENT_MOTION = LimitedQuantity("", "adjacent motion")
"""The motion before or after the path."""

AT_MOST = LimitedQuantity("", "at_most")
"""The upper bound of a speed in the task."""

TOLERANCES = LimitedQuantity("", "path tolerance")
"""The tolerances of the path."""

NOTHING = LimitedQuantity("", "nothing")
"""Nothing bounds a speed."""


class NoSpeedsError(Exception):
    """No speeds along a path keep the limits.

    Attributes:
        path: The path.
        stretch: A stretch without feasible speeds.
        bound: The exceeded limit, or another bound of the speed.
    """

    def __init__(self, path: ScenarioPath, stretch: int, bound: LimitedQuantity) -> None:
        super().__init__()
        self.path, self.stretch, self.bound = path, stretch, bound


class PathSpeedProblem:
    """The maximum speeds along one path under caps and limits.

    Planned motions correct the expected utilisation of the limits, and lower the caps.

    Args:
        free_task: The scenario and its IK solutions.
        number: Index of the path among those of the task.

    Attributes:
        number: Its index.
        path: The path at its nominal speed.
        requested: Requirements on its speeds.
        unit: Number of the file's units of length per metre; speeds are round numbers of them.
        limits: The limits of joint states on it.
        along_path: Utilisation of the limits along it, at any speeds.
        caps: Upper bounds of the free speeds [m/s] and their origins, by index of the stretch.
        speeds: The chosen speeds [m/s], by index of the stretch.
        limiting: The limit or other bound of each of them.
    """

    def __init__(self, free_task: FreeTask, number: int) -> None:
        self.number, self.path = number, free_task.scenario.paths[number]
        self.requested = self.path.requested
        self.caps = {k: (bound, AT_MOST) for k, bound in self.requested.at_most.items()}
        self.unit = free_task.scenario.units.per_metre
        self.limits = state_limits(free_task, self.path)
        self.along_path = PathUtilisation(free_task, self.path, self.limits)
        self._ratio = np.ones((len(self.path.stretches), 3, len(self.limits.quantities)))
        self.speeds: dict[int, float] = {}
        self.limiting: dict[int, LimitedQuantity] = {}

    def choose(self) -> float:
        """Set `speeds` and `limiting`: maximum speeds that are expected to keep the limits.

        Returns:
            The duration of the path [s].

        Raises:
            NoSpeedsError: No speeds are feasible.
        """
        allowed = EXPECTED_UTILISATION / self._ratio[:, CONSTANT_SPEED_PART]
        bounds = self.along_path.max_speeds(allowed)
        self.speeds = {}
        for k, (cap, bound) in self.caps.items():
            column = int(bounds[k].argmin())
            speed = max(float(bounds[k, column]), MIN_SPEED)
            self.speeds[k] = min(speed, cap)
            self.limiting[k] = bound if cap <= speed else self.limits.quantities[column]
            if math.isinf(self.speeds[k]):
                raise NoSpeedsError(self.path, k, NOTHING)
        while True:
            timing, speeds = self._fit()
            expected = self.along_path.with_timing(timing) * self._ratio
            utilisation = (expected / EXPECTED_UTILISATION).max(axis=1)
            if utilisation.max() <= 1.0:
                return timing.duration
            self._slow_down(utilisation, speeds)

    def _fit(self) -> tuple[Timing, tuple[float, ...]]:
        """Round the speeds, and lower them until the stretches are long enough for their changes.

        Lowering one stretch never lets a neighbour go faster, so lowering them one by one gives
        the largest feasible speeds.

        Returns:
            The timing of the path, and the speed of each stretch [m/s].

        Raises:
            NoSpeedsError: The given speeds do not allow the changes of speed.
        """
        while True:
            self.speeds = {
                k: round_speed(self.unit * v) / self.unit for k, v in self.speeds.items()
            }
            try:
                return self.requested.timed(self.speeds)
            except PathError as error:
                k, highest = getattr(error, "stretch", 0), getattr(error, "highest_speed", None)
                if k not in self.speeds or highest is None:
                    raise NoSpeedsError(self.path, k, RAMPS) from error
                lower = (1.0 - 10.0**-SPEED_DIGITS) * self.speeds[k]  # by rounding or more
                self.speeds[k], self.limiting[k] = min(highest, lower), RAMPS

    def _slow_down(self, utilisation: FloatArray, speeds: Sequence[float]) -> None:
        """Lower the speed where the excess over a limit is largest.

        A step lowers a speed at most to that of a neighbour, because there is no ramp between equal
        speeds.

        Args:
            utilisation: Expected utilisation of the limits on each stretch, shape (n, m).
            speeds: Speeds of the stretches [m/s], length n.
        """
        k = int(utilisation.max(axis=1).argmax())
        factor, limit = self._required_slowdown(utilisation[k])
        factor, stretches = min(factor, MIN_SLOWDOWN), [k]
        if k not in self.speeds:  # the next stretches with a chosen speed
            before, after = [j for j in self.speeds if j < k], [j for j in self.speeds if j > k]
            stretches = before[-1:] + after[:1]
        if not stretches:
            raise NoSpeedsError(self.path, k, limit)
        for j in stretches:
            lower = factor * speeds[j]
            if lower < MIN_SPEED:
                raise NoSpeedsError(self.path, k, limit)
            neighbours = (*speeds[max(j - 1, 0) : j], *speeds[j + 1 : j + 2])
            self.speeds[j] = max((v for v in neighbours if lower <= v < speeds[j]), default=lower)
            self.limiting[j] = limit

    def _required_slowdown(self, utilisation: FloatArray) -> tuple[float, LimitedQuantity]:
        """Factor on a speed that brings limits from their utilisation, shape (m,), to 1.

        A step lowers a speed at most by `MAX_SLOWDOWN`. The limit is the one with that factor.
        """
        factors = np.maximum(utilisation, 1e-9) ** (-1.0 / self.along_path.orders)
        column = int(factors.argmin())
        return max(float(factors[column]), MAX_SLOWDOWN), self.limits.quantities[column]

    def lower_caps(self, factor: float, reason: LimitedQuantity) -> None:
        """Cap each speed at a fraction of its present value."""
        self.caps = {k: (factor * speed, reason) for k, speed in self.speeds.items()}

    def correct_from_plan(self, free_task: FreeTask) -> NoSpeedsError | None:
        """Correct the expected utilisation by that of a planned motion.

        Speeds with which this motion exceeds a limit are capped.

        Args:
            free_task: The scenario with the chosen speeds.

        Returns:
            The error for the limit that the motion exceeds, or `None`.
        """
        path = free_task.scenario.paths[self.number]
        planned = planned_utilisation(free_task, path, self.limits)
        expected = self.along_path.with_timing(path.motion.timing)
        ratio = np.clip(planned / np.maximum(expected, 1e-9), 0.1, 1e3)
        compared = np.maximum(planned, self._ratio * expected) > SIGNIFICANT_UTILISATION
        self._ratio = np.where(compared, ratio, self._ratio)
        largest = planned.max(axis=1)
        for k in np.flatnonzero(largest.max(axis=1) > PLANNED_UTILISATION).tolist():
            if k in self.speeds:
                factor, limit = self._required_slowdown(largest[k] / EXPECTED_UTILISATION)
                self.caps[k] = factor * self.speeds[k], limit
        k, column = divmod(int(largest.argmax()), largest.shape[1])
        if largest[k, column] <= PLANNED_UTILISATION:
            return None
        return NoSpeedsError(self.path, k, self.limits.quantities[column])


def round_speed(speed: float) -> float:
    """A speed rounded down to a few digits."""
    digit = 10.0 ** (math.floor(math.log10(speed)) - SPEED_DIGITS + 1)
    return float(f"{math.floor(speed / digit * (1.0 + 1e-12)) * digit:.{SPEED_DIGITS}g}")
