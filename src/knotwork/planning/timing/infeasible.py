"""Reasons why a timing problem has no motion, and values that are sufficient, in closed form.

They need no search. They follow from given values beyond their limits, from lower bounds on the
duration of each interval under limits of velocity, acceleration and tool speed, and from the motion
that rests in each interval.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import TimingError
from knotwork.errors.plain_text import quoted_waypoint, waypoint_text
from knotwork.joint_quantities import JOINT_QUANTITIES, limit_text, rate_unit
from knotwork.planning.timing.minimum_durations import (
    interval_bounds,
    min_durations,
    slowest_text,
    sufficient_duration,
)
from knotwork.planning.timing.stop_to_stop import resting_motion, with_longer
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.units import rounded_down, rounded_up

NO_MOTION = "no motion was found that keeps all limits"

DERIVED_ROUNDING = 1e-9
"""Relative rounding tolerance of durations and velocities, sums and roots of given values."""

GIVEN_ROUNDING = 1e-12
"""Relative rounding tolerance of given values, which are only converted to SI."""

TOOL_SPEED_MARGIN = 5e-4
"""Fraction of the limit of tool speed that a given velocity must leave, because the solver reserves
a margin for values between samples.
"""


def infeasible_values(problem: TimingProblem, *, direct: bool = True) -> list[TimingError]:
    """Errors for given values that no motion within the limits can have, durations last.

    Args:
        problem: The timing problem.
        direct: Whether the motion may be straight between its waypoints. Otherwise errors for
            durations that are too short name no sufficient one.
    """
    return (
        [*_overloads(problem, certain=True), *value_errors(problem)]
        or list(_unlimited_errors(problem))
        or list(_infeasible_durations(problem, direct))
    )


def unsolved_errors(problem: TimingProblem) -> list[TimingError]:
    """Likely causes with sufficient values, where `infeasible_values` finds none."""
    return (
        list(_overloads(problem, certain=False))
        or _too_short(problem)
        or [
            TimingError(
                f"between {quoted_waypoint(problem.names[0])} and "
                f"{quoted_waypoint(problem.names[-1])} {NO_MOTION}: allow longer "
                "durations, lower speeds or higher limits",
                waypoint_index=0,
                in_interval=len(problem.position) == 2,
            )
        ]
    )


def _overloads(problem: TimingProblem, *, certain: bool) -> Iterator[TimingError]:
    """Joints that can't hold the arm at rest, each at the waypoint with its largest effort.

    Args:
        problem: The timing problem.
        certain: Whether to report proofs of infeasibility only. An arm with an unknown
            acceleration may fall through a waypoint, and one with an unknown velocity may not stop
            there.
    """
    limits = problem.limits
    at_rest = (problem.velocity == 0.0).all(axis=1)
    held_still = at_rest & (problem.acceleration == 0.0).all(axis=1)
    rows = np.flatnonzero(held_still if certain else at_rest | ~problem.velocity_known)
    if not np.isfinite(limits.effort).any() or not rows.size:
        return
    q = problem.position[rows]
    efforts = np.abs(problem.required_dynamics.effort(q, np.zeros_like(q), np.zeros_like(q)))
    beyond = efforts > limits.effort * (1.0 + GIVEN_ROUNDING)
    for k in np.flatnonzero(beyond.any(axis=0)).tolist():
        i, effort, limit = int(rows[efforts[:, k].argmax()]), efforts[:, k].max(), limits.effort[k]
        unit, name = JOINT_QUANTITIES["effort"].units[problem.joint_units[k]], problem.names[i]
        needed, full_limit = (
            problem.units.text(value / limits.used_fraction, unit)
            for value in (rounded_up(effort), limit)
        )
        yield TimingError(
            f"{'no motion keeps all limits' if certain else NO_MOTION}: "
            f"to hold the arm still at {name!r}, joint {problem.joint_names[k]!r} needs an effort "
            f"limit above {needed}; it is {full_limit}{limits.full_limits_note}",
            waypoint_index=i,
            joint=problem.joint_names[k],
            cause="effort",
            value=float(limit),
            feasible_value=float(effort),
        )


def _unlimited_errors(problem: TimingProblem) -> Iterator[TimingError]:
    """Refuse joints without limits, for which the minimum duration would be zero."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isinf(limits.effort)
    if problem.objective.time and problem.duration_is_unknown.any() and unlimited.any():
        names = [problem.joint_names[k] for k in np.flatnonzero(unlimited)]
        yield TimingError(
            f"joint {', '.join(map(repr, names))}: no limit of acceleration, jerk or effort, so "
            "there is no minimum time; give one",
            joint=names[0],
            cause="acceleration",
        )


def _infeasible_durations(problem: TimingProblem, direct: bool) -> Iterator[TimingError]:
    """Infeasible durations: too short, excluded since a joint can't stop, or without a minimum."""
    speeds = np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
    moves = np.abs(np.diff(problem.position, axis=0)) + np.abs(speeds[:-1]) + np.abs(speeds[1:])
    still = problem.duration_is_unknown & (moves.max(axis=1) == 0.0) & (problem.min_duration == 0.0)
    for i in np.flatnonzero(still).tolist():
        yield TimingError(
            f"from {quoted_waypoint(problem.names[i])} to {quoted_waypoint(problem.names[i + 1])} "
            "no joint moves, so there is no minimum duration; give one, or a lower bound",
            waypoint_index=i,
            in_interval=True,
            cause="duration",
        )
    if problem.total is not None:
        shortest = float(interval_bounds(problem).sum())
        if problem.total < shortest * (1.0 - DERIVED_ROUNDING):
            reason = f"under the limits it takes more than {rounded_up(shortest):.6g} s"
            yield _short_total(problem.total, reason, shortest)
        if len(problem.position) == 2:
            problem = replace(problem, duration=np.array([problem.total]), total=None)
    yield from _short_duration_errors(problem, min_durations(problem), direct=direct)


def _short_total(total: float, reason: str, bound: float) -> TimingError:
    message = f"the motion must last {total:.6g} s; {reason}"
    return TimingError(message, cause="duration", value=total, feasible_value=bound)


def _short_duration_errors(
    problem: TimingProblem, required: FloatArray, prefix: str = "", *, direct: bool = True
) -> Iterator[TimingError]:
    """Errors for too short given durations, with durations in which the arm can come to rest.

    Args:
        problem: The timing problem.
        required: Minimum duration of each interval [s], shape (n-1,).
        prefix: Beginning of the reason.
        direct: See `infeasible_values`.
    """
    short = np.flatnonzero(problem.duration < required * (1.0 - DERIVED_ROUNDING)).tolist()
    shortest = min_durations(problem)
    resting = _resting_durations(problem) if short and direct else None
    together = ", with those named for the other intervals," if len(short) > 1 else ""
    for i in short:
        bound = float(shortest[i])
        reason = (
            f"under the limits of velocity and acceleration {slowest_text(problem, i)} takes more "
            f"than {rounded_up(bound):.6g} s"
        )
        if not direct:
            reason += "; without a time, the motion takes its minimum time"
        elif resting is not None:
            bound = sufficient_duration(float(resting[i]))
            reason += f"; {bound:.6g} s{together} is enough for a motion that stops at both ends"
        yield TimingError(
            f"from {quoted_waypoint(problem.names[i])} to {quoted_waypoint(problem.names[i + 1])} "
            f"{problem.duration[i]:.6g} s are given; {prefix}{reason}",
            waypoint_index=i,
            in_interval=True,
            cause="duration",
            value=float(problem.duration[i]),
            feasible_value=bound,
        )


def _resting_durations(problem: TimingProblem) -> FloatArray | None:
    """Durations of a motion that rests in each interval, none below a given one [s], (n-1,)."""
    resting = resting_motion(with_longer(problem), "resting")
    return None if resting is None else np.diff(resting.time)


def _too_short(problem: TimingProblem) -> list[TimingError]:
    """Given durations in which the arm can't come to rest, with durations in which it can."""
    takes = _resting_durations(problem)
    if takes is None:
        return []
    if problem.total is None:
        return list(_short_duration_errors(problem, takes, f"{NO_MOTION}; "))
    sufficient = sufficient_duration(
        float(np.where(problem.duration_is_unknown, takes, problem.duration).sum())
    )
    if problem.total >= sufficient:
        return []
    reason = f"{NO_MOTION}; {sufficient:.6g} s is enough for a motion that stops at each waypoint"
    return [_short_total(problem.total, reason, sufficient)]


def value_errors(problem: TimingProblem) -> list[TimingError]:
    """Errors of given values, in the order of waypoints.

    Each waypoint has the worst error of each kind.
    """
    worst: dict[tuple[str, int], TimingError] = {}
    of_kinds = _rates_above_limits, _tool_speeds_above_limit, _unstoppable
    for kind, error in chain.from_iterable(errors_of(problem) for errors_of in of_kinds):
        key = kind, error.waypoint_index or 0
        if key not in worst or _feasible_fraction(error) < _feasible_fraction(worst[key]):
            worst[key] = error
    errors = [*_outside_limits(problem), *worst.values()]
    return sorted(errors, key=lambda error: error.waypoint_index or 0)


def _feasible_fraction(error: TimingError) -> float:
    """The feasible fraction of the given value."""
    return (error.feasible_value or 0.0) / (error.value or 1.0)


def _joint_error(
    problem: TimingProblem, i: int, k: int, cause: str, value: float, bound: float, text: str
) -> TimingError:
    """Make the error for a value of joint k at waypoint i; the text follows the joint's name."""
    return TimingError(
        f"{waypoint_text(problem.names[i])}: joint {problem.joint_names[k]!r} {text}",
        waypoint_index=int(i),
        joint=problem.joint_names[k],
        cause=cause,
        value=value,
        feasible_value=bound,
    )


def _feasible_part_text(kind: str, fraction: float) -> str:
    if not fraction:
        return (
            f". No part of the {kind} given here is possible: stop here, or move the waypoint or "
            "the limit"
        )
    return f". At most {rounded_down(fraction, 4):g} times the {kind} given here is possible"


def _rates_above_limits(problem: TimingProblem) -> Iterator[tuple[str, TimingError]]:
    """Velocities and accelerations above their limits."""
    limits, text = problem.limits, problem.units.text
    for name, order, article, known in (
        ("velocity", 1, "a", problem.velocity_known),
        ("acceleration", 2, "an", problem.acceleration_known),
    ):
        limit, values = limits[name], getattr(problem, name)
        for i, k in np.argwhere(known[:, None] & (np.abs(values) > limit * (1.0 + GIVEN_ROUNDING))):
            value, unit = float(values[i, k]), rate_unit(problem.joint_units[k], order)
            bound = math.copysign(float(limit[k]), value)
            message = (
                f"is given {article} {name} of {text(value, unit)}; its limit is "
                f"{limit_text(float(limit[k]), unit, problem.units, limits.used_fraction)}"
                f"{_feasible_part_text(name, bound / value)}"
            )
            yield name, _joint_error(problem, i, k, name, value, bound, message)


def _tool_speeds_above_limit(problem: TimingProblem) -> Iterator[tuple[str, TimingError]]:
    """Velocities at which the tool is near its speed limit or above it."""
    limit = problem.tool_speed
    if np.isinf(limit):
        return
    robot = problem.required_dynamics.robot
    bound = (1.0 - TOOL_SPEED_MARGIN) * limit
    for i in np.flatnonzero(problem.velocity_known).tolist():
        twist = robot.twist(problem.position[i], problem.velocity[i])
        if (speed := float(np.linalg.norm(twist.linear))) > bound:
            message = (
                f"{waypoint_text(problem.names[i])}: the given speed of the tool is "
                f"{problem.units.text(speed, 'm/s')}, and tool_speed is "
                f"{limit_text(limit, 'm/s', problem.units, problem.limits.used_fraction)}"
                f"{_feasible_part_text('velocity', bound / speed)}"
            )
            data = {"cause": "tool_speed", "value": speed, "feasible_value": bound}
            yield "tool_speed", TimingError(message, waypoint_index=i, **data)


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
        yield _joint_error(problem, i, k, "position", value, bound, message)


def _unstoppable(problem: TimingProblem) -> Iterator[tuple[str, TimingError]]:
    """Joints that can't stop before a position limit."""
    limits, q, text = problem.limits, problem.position, problem.units.text
    for sign, verb in ((1.0, "stop before"), (-1.0, "have come from inside")):
        v = sign * np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
        v[-1 if sign > 0.0 else 0] = 0.0  # no motion after the last or before the first
        distance = np.maximum(np.where(v > 0.0, limits.upper - q, q - limits.lower), 0.0)
        with np.errstate(invalid="ignore"):
            max_velocity = np.sqrt(2.0 * limits.acceleration * distance)
        for i, k in np.argwhere(
            np.abs(v) > max_velocity * (1.0 + DERIVED_ROUNDING) + GIVEN_ROUNDING
        ):
            unit, value = problem.joint_units[k], float(problem.velocity[i, k])
            needed = 0.5 * value**2 / float(limits.acceleration[k])
            bound = math.copysign(float(max_velocity[i, k]), value)
            message = (
                f"moves at {text(value, rate_unit(unit, 1))} and can't {verb} its position limit, "
                f"{text(float(distance[i, k]), unit, '.4g')} away; it needs at least "
                f"{text(needed, unit, '.4g')}{_feasible_part_text('velocity', bound / value)}"
            )
            yield "velocity", _joint_error(problem, i, k, "position", value, bound, message)
