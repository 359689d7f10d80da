"""Infeasible tasks in closed form: infeasible values, short durations, and sufficient ones.

No search is needed: values beyond limits, lower bounds on the duration of each interval under
limits of velocity, acceleration and tool speed, and the motion that rests in each interval.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.planning.timing.attempts import resting_motion
from knotwork.planning.timing.bounds import (
    interval_bounds,
    min_durations,
    slowest,
    sufficient_duration,
)
from knotwork.planning.timing.given_values import GIVEN_ROUNDING, value_errors
from knotwork.planning.timing.stop_to_stop import with_longer
from knotwork.planning.timing.timing_problem import BoolArray, TimingProblem
from knotwork.units import rounded_up

NO_MOTION = "no motion was found that keeps all limits"

EQUAL_DURATION = 1e-9
"""Relative rounding tolerance of durations."""


def infeasible_values(problem: TimingProblem, *, direct: bool = True) -> list[TimingError]:
    """Errors of given values that no motion within the limits has; of durations last.

    Args:
        problem: The task.
        direct: Whether the motion may be straight between its waypoints. Otherwise no sufficient
            duration is known for one that is too short.
    """
    return (
        [*_overloads(problem, certain=True), *value_errors(problem)]
        or list(_unlimited_errors(problem))
        or list(_impossible_durations(problem, direct))
    )


def unsolved_errors(problem: TimingProblem) -> list[TimingError]:
    """Causes and sufficient values for a problem without a motion, after `infeasible_values`."""
    return (
        list(_overloads(problem, certain=False))
        or _too_short(problem)
        or [
            TimingError(
                f"between {problem.names[0]!r} and {problem.names[-1]!r} {NO_MOTION}: allow longer "
                "durations, lower speeds or higher limits",
                waypoint=0,
                interval=len(problem.position) == 2,
            )
        ]
    )


def _overloads(problem: TimingProblem, *, certain: bool) -> Iterator[TimingError]:
    """Joints that can't hold the arm at rest, each at the waypoint with its largest effort.

    Args:
        problem: The task.
        certain: Whether only proofs of infeasibility are errors. With an unknown acceleration the
            arm may fall through a waypoint, and elsewhere it may not stop.
    """
    limits = problem.limits
    rests = (problem.velocity == 0.0).all(axis=1)
    known = rests & (problem.acceleration == 0.0).all(axis=1)
    rows = np.flatnonzero(known if certain else rests | ~problem.velocity_known)
    if not np.isfinite(limits.effort).any() or not rows.size:
        return
    q = problem.position[rows]
    efforts = np.abs(problem.required_dynamics.effort(q, np.zeros_like(q), np.zeros_like(q)))
    for k in np.flatnonzero(
        (efforts > limits.effort * (1.0 + GIVEN_ROUNDING)).any(axis=0)
    ).tolist():
        i, effort, limit = int(rows[efforts[:, k].argmax()]), efforts[:, k].max(), limits.effort[k]
        unit, name = JOINT_QUANTITIES["effort"].units[problem.joint_units[k]], problem.names[i]
        needed_text, limit_text = (
            problem.units.text(value / limits.margin, unit) for value in (rounded_up(effort), limit)
        )
        yield TimingError(
            f"{'no motion keeps all limits' if certain else NO_MOTION}: "
            f"to hold the arm still at {name!r}, joint {problem.joint_names[k]!r} needs an effort "
            f"limit above {needed_text}; it is {limit_text}{limits.margin_note}",
            waypoint=i,
            joint=problem.joint_names[k],
            limit="effort",
            value=float(limit),
            bound=float(effort),
        )


def _unlimited_errors(problem: TimingProblem) -> Iterator[TimingError]:
    """Refuse joints without limits, for which the minimum duration would be zero."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isinf(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        joints = [problem.joint_names[k] for k in np.flatnonzero(unlimited)]
        yield TimingError(
            f"joint {', '.join(map(repr, joints))}: no limit of acceleration, jerk or effort, so "
            "there is no minimum time; give one",
            joint=joints[0],
            limit="acceleration",
        )


def _impossible_durations(problem: TimingProblem, direct: bool) -> Iterator[TimingError]:
    """Infeasible durations: too short, excluded since a joint can't stop, or without a minimum."""
    speeds = np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
    moves = np.abs(np.diff(problem.position, axis=0)) + np.abs(speeds[:-1]) + np.abs(speeds[1:])
    still = problem.free & (moves.max(axis=1) == 0.0) & (problem.at_least == 0.0)
    for i in np.flatnonzero(still).tolist():
        yield TimingError(
            f"from {problem.names[i]!r} to {problem.names[i + 1]!r} no joint moves, so there is no "
            "minimum duration; give one, or a lower bound",
            waypoint=i,
            interval=True,
            limit="duration",
        )
    if problem.total is not None:
        shortest = float(interval_bounds(problem).sum())
        if problem.total < shortest * (1.0 - EQUAL_DURATION):
            reason = f"under the limits it takes more than {rounded_up(shortest):.6g} s"
            yield _short_total(problem.total, reason, shortest)
        if len(problem.position) == 2:
            problem = replace(problem, duration=np.array([problem.total]), total=None)
    wrong = problem.duration < min_durations(problem) * (1.0 - EQUAL_DURATION)
    if wrong.any():
        yield from _given_durations(problem, wrong, "", direct=direct)


def _short_total(total: float, reason: str, bound: float) -> TimingError:
    message = f"the motion must last {total:.6g} s; {reason}"
    return TimingError(message, limit="duration", value=total, bound=bound)


def _given_durations(
    problem: TimingProblem, wrong: BoolArray, prefix: str, *, direct: bool = True
) -> list[TimingError]:
    """Errors for given durations, with durations in which the arm can come to rest.

    Args:
        problem: The task.
        wrong: Whether each duration is wrong.
        prefix: Beginning of the reason.
        direct: See `infeasible_values`.
    """
    rests, shortest = resting_motion(with_longer(problem), "resting"), min_durations(problem)
    together = ", with those named for the other intervals," if wrong.sum() > 1 else ""
    errors = []
    for i in np.flatnonzero(wrong).tolist():
        bound = float(shortest[i])
        reason = (
            f"under the limits of velocity and acceleration {slowest(problem, i)} takes more "
            f"than {rounded_up(bound):.6g} s"
        )
        if not direct:
            reason += "; without a time, the motion takes its minimum time"
        elif rests is not None:
            bound = sufficient_duration(float(rests.time[i + 1] - rests.time[i]))
            reason += f"; {bound:.6g} s{together} is enough for a motion that stops at both ends"
        errors.append(
            TimingError(
                f"from {problem.names[i]!r} to {problem.names[i + 1]!r} {problem.duration[i]:.6g} "
                f"s are given; {prefix}{reason}",
                waypoint=i,
                interval=True,
                limit="duration",
                value=float(problem.duration[i]),
                bound=bound,
            )
        )
    return errors


def _too_short(problem: TimingProblem) -> list[TimingError]:
    """Given durations in which the arm can't come to rest, with durations in which it can."""
    rests = resting_motion(with_longer(problem), "resting")
    if rests is None:
        return []
    takes = np.diff(rests.time)
    if problem.total is None:
        wrong = takes > problem.duration * (1.0 + EQUAL_DURATION)
        return _given_durations(problem, wrong, f"{NO_MOTION}; ")
    sufficient = sufficient_duration(float(np.where(problem.free, takes, problem.duration).sum()))
    if problem.total >= sufficient:
        return []
    reason = f"{NO_MOTION}; {sufficient:.6g} s is enough for a motion that stops at each waypoint"
    return [_short_total(problem.total, reason, sufficient)]
