"""Given positions, velocities and accelerations that violate limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from knotwork.errors import TimingError
from knotwork.errors.plain_text import waypoint_text
from knotwork.joint_quantities import rate_unit
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.units import rounded_down

GIVEN_ROUNDING = 1e-12
"""Relative rounding tolerance of given values."""


TOOL_SPEED_MARGIN = 5e-4
"""Fraction of the limit of tool speed that a given velocity must leave to the solver."""


def value_errors(problem: TimingProblem) -> list[TimingError]:
    """Errors of given values, in the order of waypoints.

    Each waypoint has the worst error of each kind.
    """
    worst: dict[tuple[str, int], TimingError] = {}
    for kind, error in (*_beyond(problem), *_beyond_tool_speed(problem), *_unstoppable(problem)):
        key = kind, error.waypoint or 0
        if key not in worst or _feasible_part(error) < _feasible_part(worst[key]):
            worst[key] = error
    errors = [*_outside_limits(problem), *worst.values()]
    return sorted(errors, key=lambda error: error.waypoint or 0)


def _feasible_part(error: TimingError) -> float:
    """Maximum feasible fraction of the given value."""
    return (error.bound or 0.0) / (error.value or 1.0)


def _fault(
    problem: TimingProblem, i: int, k: int, limit: str, value: float, bound: float, text: str
) -> TimingError:
    """Make the error for a value of joint k at waypoint i; the text follows the joint's name."""
    return TimingError(
        f"{waypoint_text(problem.names[i])}: joint {problem.joint_names[k]!r} {text}",
        waypoint=int(i),
        joint=problem.joint_names[k],
        limit=limit,
        value=value,
        bound=bound,
    )


def _advice(kind: str, part: float) -> str:
    if not part:
        return (
            f". No part of the {kind} given here is possible: stop here, or move the waypoint or "
            "the limit"
        )
    return f". At most {rounded_down(part, 4):g} times the {kind} given here is possible"


def _beyond(problem: TimingProblem) -> Iterator[tuple[str, TimingError]]:
    """Velocities and accelerations above their limits."""
    limits, text = problem.limits, problem.units.text
    for name, order, article, known in (
        ("velocity", 1, "a", problem.velocity_known),
        ("acceleration", 2, "an", problem.acceleration_known),
    ):
        limit, values = getattr(limits, name), getattr(problem, name)
        for i, k in np.argwhere(known[:, None] & (np.abs(values) > limit * (1.0 + GIVEN_ROUNDING))):
            value, unit = float(values[i, k]), rate_unit(problem.joint_units[k], order)
            bound = math.copysign(float(limit[k]), value)
            message = (
                f"is given {article} {name} of {text(value, unit)}; its limit is "
                f"{limits.text(float(limit[k]), unit, problem.units)}{_advice(name, bound / value)}"
            )
            yield name, _fault(problem, i, k, name, value, bound, message)


def _beyond_tool_speed(problem: TimingProblem) -> Iterator[tuple[str, TimingError]]:
    """Velocities at which the tool is near its speed limit or above it."""
    limit = problem.limits.tool_speed
    if np.isinf(limit):
        return
    rows = np.flatnonzero(problem.velocity_known)
    speeds = problem.required_dynamics.tool_speed(problem.position[rows], problem.velocity[rows])
    bound = (1.0 - TOOL_SPEED_MARGIN) * limit
    for i, speed in zip(rows.tolist(), speeds.tolist(), strict=True):
        if speed > bound:
            yield (
                "tool speed",
                TimingError(
                    f"{waypoint_text(problem.names[i])}: the given speed of the tool is "
                    f"{problem.units.text(speed, 'm/s')}, and tool_speed is "
                    f"{problem.limits.text(limit, 'm/s', problem.units)}"
                    f"{_advice('velocity', bound / speed)}",
                    waypoint=i,
                    limit="tool speed",
                    value=speed,
                    bound=bound,
                ),
            )


def _outside_limits(problem: TimingProblem) -> Iterator[TimingError]:
    """Positions outside their limits."""
    limits, text, q = problem.limits, problem.units.text, problem.position
    slack = GIVEN_ROUNDING * np.maximum(1.0, np.abs(q))
    for i, k in np.argwhere((q < limits.lower - slack) | (q > limits.upper + slack)):
        unit, value = problem.joint_units[k], float(q[i, k])
        lower, upper = float(limits.lower[k]), float(limits.upper[k])
        message = (
            f"is at {text(value, unit)}, outside its limits "
            f"{text(lower, unit)} to {text(upper, unit)}"
        )
        bound = min(max(value, lower), upper)
        yield _fault(problem, i, k, "position", value, bound, message)


def _unstoppable(problem: TimingProblem) -> Iterator[tuple[str, TimingError]]:
    """Joints that can't stop before a position limit."""
    limits, q, text = problem.limits, problem.position, problem.units.text
    for sign, verb in ((1.0, "stop before"), (-1.0, "have come from inside")):
        v = sign * np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
        v[-1 if sign > 0.0 else 0] = 0.0  # no motion after the last or before the first
        distance = np.maximum(np.where(v > 0.0, limits.upper - q, q - limits.lower), 0.0)
        with np.errstate(invalid="ignore"):
            max_velocity = np.sqrt(2.0 * limits.acceleration * distance)
        for i, k in np.argwhere(np.abs(v) > max_velocity * (1.0 + 1e-9) + GIVEN_ROUNDING):
            unit, value = problem.joint_units[k], float(problem.velocity[i, k])
            needed = 0.5 * value**2 / float(limits.acceleration[k])
            bound = math.copysign(float(max_velocity[i, k]), value)
            message = (
                f"moves at {text(value, rate_unit(unit, 1))} and can't {verb} its position limit, "
                f"{text(float(distance[i, k]), unit, '.4g')} away; it needs at least "
                f"{text(needed, unit, '.4g')}{_advice('velocity', bound / value)}"
            )
            yield "velocity", _fault(problem, i, k, "position", value, bound, message)
