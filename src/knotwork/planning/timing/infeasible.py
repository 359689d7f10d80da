"""Infeasible tasks in closed form: infeasible values, short durations, and sufficient ones.

No search is needed: values beyond limits, lower bounds on the duration of each interval under
limits of velocity, acceleration and tool speed, and the motion that rests in each interval.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.planning.timing.attempts import resting
from knotwork.planning.timing.bounds import least_durations, slowest
from knotwork.planning.timing.given_values import (
    ROUNDING,
    feasible_part,
    outside_limits,
    value_faults,
)
from knotwork.planning.timing.problem import BoolArray, TimingProblem
from knotwork.planning.timing.rounding import with_room
from knotwork.planning.timing.stop_to_stop import with_longer
from knotwork.units import rounded_down, rounded_up
from knotwork.waypoints import FloatArray

NOTHING = "no motion was found that keeps all limits"


def impossible(problem: TimingProblem, *, direct: bool = True) -> list[TimingError]:
    """Make an error for each given value that no motion within the limits has.

    Args:
        problem: The task.
        direct: Whether the motion may be straight between its waypoints; otherwise no sufficient
            duration is known where one is too short.
    """
    outside, faults = list(outside_limits(problem)), value_faults(problem)
    errors = sorted([*outside, *faults.values()], key=lambda one: one.waypoint or 0)
    errors = _overloads(problem, certain=True) + errors
    if outside:
        return errors
    for (name, i), one in faults.items():
        # later checks use the nearest feasible value
        changed: Any = np.array(getattr(problem, name))
        changed[i] *= feasible_part(one) * (1.0 - ROUNDING)
        problem = replace(problem, **{name: changed})
    return errors + (list(_unlimited(problem)) or list(_impossible_durations(problem, direct)))


def unsolved(problem: TimingProblem) -> list[TimingError]:
    """Causes and sufficient values for a problem without a motion, after `impossible`."""
    return _overloads(problem, certain=False) or _too_short(problem) or [_not_found(problem)]


def _overloads(problem: TimingProblem, *, certain: bool) -> list[TimingError]:
    """Joints that can't hold the arm at rest, each at the waypoint with its largest effort.

    Args:
        problem: The task.
        certain: Whether only proofs of infeasibility are errors: with an unknown acceleration the
            arm may fall through a waypoint, and elsewhere it may not stop.
    """
    limits, unit = problem.limits, JOINT_QUANTITIES["effort"].units
    rests = (problem.velocity == 0.0).all(axis=1)
    known = rests & (problem.acceleration == 0.0).all(axis=1)
    rows = np.flatnonzero(known if certain else rests | ~problem.velocity_known)
    if not np.isfinite(limits.effort).any() or not rows.size:
        return []
    q = problem.position[rows]
    effort = np.abs(problem.arm.effort(q, np.zeros_like(q), np.zeros_like(q)))
    joints = np.flatnonzero((effort > limits.effort * (1.0 + ROUNDING)).any(axis=0)).tolist()
    heavy = [(int(rows[effort[:, k].argmax()]), k, float(effort[:, k].max())) for k in joints]
    if not heavy:
        return []

    def text(effort: float, k: int) -> str:
        return problem.units.text(effort / limits.margin, unit[problem.joint_units[k]])

    messages = [
        f"{'to rest ' if not rests[i] else ''}at {problem.names[i]!r} joint "
        f"{problem.joint_names[k]!r} needs a limit of effort above {text(rounded_up(most), k)}; "
        f"it is {text(float(limits.effort[k]), k)}"
        for i, k, most in heavy
    ]
    i, k, most = heavy[0]
    return [
        TimingError(
            f"{'no motion keeps all limits' if certain else NOTHING}: {'; and '.join(messages)}"
            f"{limits.margin_note}",
            waypoint=i,
            joint=problem.joint_names[k],
            limit="effort",
            value=float(limits.effort[k]),
            bound=most,
        )
    ]


def _unlimited(problem: TimingProblem) -> Iterator[TimingError]:
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
    """Durations that are too short, that a joint can't wait for, or that have no minimum."""
    least = least_durations(problem)
    speeds = np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
    moves = np.abs(np.diff(problem.position, axis=0)) + np.abs(speeds[:-1]) + np.abs(speeds[1:])
    still = problem.free & (moves.max(axis=1) == 0.0) & (problem.at_least == 0.0)
    for i in np.flatnonzero(still).tolist():
        yield TimingError(
            f"from {problem.names[i]!r} to {problem.names[i + 1]!r} nothing moves, so there is no "
            "minimum duration; give one, or a lower bound",
            waypoint=i,
            interval=True,
            limit="duration",
        )
    shortest = float(
        np.where(problem.free, np.maximum(least, problem.at_least), problem.duration).sum()
    )
    if problem.total is not None and problem.total < shortest * (1.0 - 1e-9):
        yield TimingError(
            f"the motion is to last {problem.total:.6g} s; under the limits it takes more than "
            f"{rounded_up(shortest):.6g} s",
            limit="duration",
            value=problem.total,
            bound=shortest,
        )
    if problem.total is not None and len(problem.position) == 2:
        problem = replace(problem, duration=np.array([problem.total]), total=None)
    wrong = np.where(problem.free, np.inf, problem.duration) < least * (1.0 - 1e-9)
    for i in np.flatnonzero(~problem.free).tolist():
        wrong[i] |= bool(_no_wait(problem, i))
    if wrong.any():
        yield from _given_durations(problem, wrong, "", direct=direct)


def _no_wait(problem: TimingProblem, i: int) -> str:
    """Text of why a joint can't take a given duration, because it may not stop."""
    if problem.velocity_known[i] and problem.velocity_known[i + 1]:
        h = problem.duration[i]
        _, last, later = problem.possible_durations(i)
        for k in np.flatnonzero((h > last * (1 + 1e-9)) & (h < later * (1 - 1e-9))).tolist():
            return (
                f"with its velocities at both ends joint {problem.joint_names[k]!r} can't wait: it "
                f"takes less than {rounded_down(float(last[k])):.6g} s, or, if it stops and goes "
                f"back, more than {rounded_up(float(later[k])):.6g} s"
            )
    return ""


def _resting_durations(problem: TimingProblem) -> FloatArray:
    """Durations, at least the given ones, in which the arm can rest [s]; infinite if it can't."""
    rest = resting(with_longer(problem), "resting")
    if rest is None:
        return np.full(problem.duration.shape, np.inf)
    return np.diff(rest.knots.time)


def _given_durations(
    problem: TimingProblem, wrong: BoolArray, what: str, *, direct: bool = True
) -> list[TimingError]:
    """Errors for given durations, with those in which the arm can come to rest.

    Args:
        problem: The task.
        wrong: Whether each duration is wrong.
        what: Text of the reason.
        direct: See `impossible`.
    """
    takes, least = _resting_durations(problem), least_durations(problem)
    together = ", with those named for the other intervals," if wrong.sum() > 1 else ""
    errors = []
    for i in np.flatnonzero(wrong).tolist():
        bound = float(least[i])
        reason = _no_wait(problem, i) or (
            f"under the limits of velocity and acceleration {slowest(problem, i)} takes more "
            f"than {rounded_up(bound):.6g} s"
        )
        if not direct:
            reason += "; without a time, the motion finds its way in the least that it needs"
        elif np.isfinite(takes[i]):
            bound = with_room(float(takes[i]))
            reason += f"; with {bound:.6g} s{together} there is a motion that rests"
        errors.append(
            TimingError(
                f"from {problem.names[i]!r} to {problem.names[i + 1]!r} {problem.duration[i]:.6g} "
                f"s are given; {what}{reason}",
                waypoint=i,
                interval=True,
                limit="duration",
                value=float(problem.duration[i]),
                bound=bound,
            )
        )
    return errors


def _too_short(problem: TimingProblem) -> list[TimingError]:
    """Given durations in which the arm can't come to rest, with those in which it can."""
    takes = _resting_durations(problem)
    if problem.total is None:
        longer = takes > problem.duration * (1.0 + 1e-9)
        wrong = ~problem.free & np.isfinite(takes) & longer
        return _given_durations(problem, wrong, f"{NOTHING}; ")
    least = with_room(float(np.where(problem.free, takes, problem.duration).sum()))
    if problem.total >= least or np.isinf(least):
        return []
    return [
        TimingError(
            f"the motion is to last {problem.total:.6g} s; {NOTHING}; with {least:.6g} s there is "
            "one that rests",
            limit="duration",
            value=problem.total,
            bound=least,
        )
    ]


def _not_found(problem: TimingProblem) -> TimingError:
    return TimingError(
        f"between {problem.names[0]!r} and {problem.names[-1]!r} {NOTHING}: allow longer "
        "durations, lower speeds or higher limits",
        waypoint=0,
        interval=len(problem.position) == 2,
    )
