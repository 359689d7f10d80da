"""Tasks without a motion, by closed forms: infeasible values, short durations, sufficient ones.

None of it takes a search: values beyond limits, the least time of each interval under the limits
of velocity, acceleration and tool speed, and the motion that rests in each interval.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.attempts import resting
from knotwork.timing.bounds import least_durations, slowest
from knotwork.timing.efforts import effort_shares, tool_shares
from knotwork.timing.exact_curve import rebuilt
from knotwork.timing.infeasible_values import (
    ROUNDING,
    faults,
    overloads,
    rounded_down,
    rounded_up,
    with_room,
)
from knotwork.timing.problem import BoolArray, TimingProblem
from knotwork.timing.stop_to_stop import SLOWER, resting_knots, with_longer
from knotwork.waypoints import FloatArray

NOTHING = "no motion was found that keeps all limits"


def impossible(problem: TimingProblem) -> list[TimingError]:
    """An error for each thing that is given and that no motion within the limits has."""
    found = faults(problem)
    errors = [*overloads(problem, certain=True), *(one.error(problem) for one in found)]
    if any(one.given == "position" for one in found):
        return errors
    for one in found:
        # the checks that follow are for the nearest feasible value
        changed: Any = np.array(getattr(problem, one.given))
        changed[one.waypoint] *= min(one.factor, 1.0) * (1.0 - ROUNDING)
        problem = replace(problem, **{one.given: changed})
    return errors + (list(_unlimited(problem)) or list(_durations(problem)))


def unsolved(problem: TimingProblem, before: int = 0) -> list[TimingError]:
    """Say what keeps a problem from a motion, where `impossible` finds nothing, and what suffices.

    Args:
        problem: What has no solution.
        before: Number of waypoints of the whole task before its first one.

    Returns:
        At least one error.
    """
    found = overloads(problem, certain=False) or _too_short(problem) or [_exceeded(problem)]
    for one in found:
        if one.waypoint is not None:
            one.waypoint += before
    return found


def _unlimited(problem: TimingProblem) -> Iterator[TimingError]:
    """Every joint must be limited, or durations would shrink to nothing."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isinf(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        joints = [problem.joint_names[k] for k in np.flatnonzero(unlimited)]
        yield TimingError(
            f"joint {', '.join(map(repr, joints))}: no limit of acceleration, jerk or effort, so "
            "there is no least time; give one",
            joint=joints[0],
            limit="acceleration",
        )


def _durations(problem: TimingProblem) -> Iterator[TimingError]:
    """Durations that are too short, that no joint can wait for, or that have no least value."""
    least = least_durations(problem)
    speeds = np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
    moves = np.abs(np.diff(problem.position, axis=0)) + np.abs(speeds[:-1]) + np.abs(speeds[1:])
    still = problem.free & (moves.max(axis=1) == 0.0) & (problem.at_least == 0.0)
    for i in np.flatnonzero(still).tolist():
        yield TimingError(
            f"from {problem.names[i]!r} to {problem.names[i + 1]!r} nothing moves, so there is no "
            "least duration; give one, or a lower bound",
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
        wrong[i] |= _no_wait(problem, i) is not None
    if wrong.any():
        yield from _given_durations(problem, wrong, "")


def _no_wait(problem: TimingProblem, i: int) -> str | None:
    """Why a given duration is none that a joint can take, because it may not stop."""
    if not (problem.velocity_known[i] and problem.velocity_known[i + 1]):
        return None
    h = problem.duration[i]
    _, last, later = problem.possible_durations(i)
    for k in np.flatnonzero((h > last * (1.0 + 1e-9)) & (h < later * (1.0 - 1e-9))).tolist():
        return (
            f"with its velocities at both ends joint {problem.joint_names[k]!r} can't wait: it "
            f"takes less than {rounded_down(float(last[k])):.6g} s, or, if it stops and goes back, "
            f"more than {rounded_up(float(later[k])):.6g} s"
        )
    return None


def _given_durations(
    problem: TimingProblem, wrong: BoolArray | None, what: str
) -> list[TimingError]:
    """Errors for given durations, with those in which the arm can come to rest.

    Args:
        problem: The task.
        wrong: Which they are, or `None` for those in which it can't.
        what: What was found of them, in words.
    """
    rest = resting(with_longer(problem), "resting")
    least = least_durations(problem)
    takes = np.full(least.size, np.inf) if rest is None else np.diff(rest.found.knots.time)
    if wrong is None:
        beyond = np.isfinite(takes) & (takes > problem.duration * (1.0 + 1e-9))
        wrong = ~problem.free & beyond
    together = ", with those named for the other intervals," if wrong.sum() > 1 else ""
    errors = []
    for i in np.flatnonzero(wrong).tolist():
        bound = float(least[i])
        reason = _no_wait(problem, i) or (
            f"under the limits of velocity and acceleration {slowest(problem, i)} takes more "
            f"than {rounded_up(bound):.6g} s"
        )
        if np.isfinite(takes[i]):
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
    if problem.total is None or not problem.free.any():
        return [] if problem.free.all() else _given_durations(problem, None, f"{NOTHING}; ")
    rest = resting(with_longer(problem), "resting")
    if rest is None:
        return []
    takes = np.where(problem.free, np.diff(rest.found.knots.time), problem.duration)
    least = with_room(float(takes.sum()))
    if problem.total >= least:
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


def _exceeded(problem: TimingProblem) -> TimingError:
    """The limit that a motion with rests exceeds least, and what it reaches."""
    reached: list[tuple[float, str, int, float, float]] = []
    for slower in SLOWER:
        knots = resting_knots(with_longer(problem), slower)
        if knots is not None:
            reached.append(max(_reached(problem, rebuilt(knots))))
    ends = f"between {problem.names[0]!r} and {problem.names[-1]!r} {NOTHING}"
    if not reached:
        return TimingError(
            f"{ends}: allow longer durations, lower speeds or higher limits",
            waypoint=0,
            interval=len(problem.position) == 2,
        )
    _, name, k, limit, value = min(reached)
    margin = 1.0 if name == "position" else problem.limits.margin
    joint = problem.joint_names[k] if name != "tool_speed" else ""
    unit = "m/s" if not joint else JOINT_QUANTITIES[name].units[problem.joint_units[k]]
    least = float(np.copysign(rounded_up(abs(value), 4), value))
    text = problem.units.text
    who = f"joint {joint!r}" if joint else "the tool"
    return TimingError(
        f"{ends}; one with rests needs a limit of {name.replace('_', ' ')} of "
        f"{text(least / margin, unit)} for {who}; it is {text(limit / margin, unit)}"
        + (problem.limits.margin_note if margin != 1.0 else ""),
        waypoint=0,
        interval=len(problem.position) == 2,
        joint=joint,
        limit=name.replace("_", " "),
        value=limit,
        bound=least,
    )


def _reached(
    problem: TimingProblem, curve: PiecewisePolynomial
) -> list[tuple[float, str, int, float, float]]:
    """For each limit: its share, its name, the joint, the limit and what a curve reaches."""
    limits = problem.limits
    found = []

    def put(name: str, shares: FloatArray, limit: FloatArray) -> None:
        k = int(np.argmax(shares))
        found.append((float(shares[k]), name, k, float(limit[k]), float(shares[k] * limit[k])))

    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        limit = getattr(limits, name)
        put(name, curve.extrema(order).peak / limit, limit)
    if problem.dynamics is not None and np.isfinite(limits.effort).any():
        put("effort", effort_shares(problem, curve).max(axis=0), limits.effort)
    if problem.dynamics is not None and np.isfinite(limits.tool_speed):
        put("tool_speed", tool_shares(problem, curve).max(axis=0), np.array([limits.tool_speed]))
    places, width = curve.extrema(0), np.ptp(problem.position, axis=0).max() or 1.0
    for limit, peak, over in (
        (limits.upper, places.maximum, places.maximum - limits.upper),
        (limits.lower, places.minimum, limits.lower - places.minimum),
    ):
        k = int(np.argmax(over))
        share = 1.0 + float(over[k]) / width
        found.append((share, "position", k, float(limit[k]), float(peak[k])))
    return found
