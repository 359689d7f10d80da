"""Why a problem has no solution: the interval at fault, and the least change that would do."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, replace

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import DERIVATIVES, JOINT_QUANTITIES, MAGNITUDES
from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.attempts import Attempt, solved_section
from knotwork.timing.binding import binding_limits
from knotwork.timing.efforts import effort_shares
from knotwork.timing.problem import Objective, TimingProblem, part_of
from knotwork.timing.safe_numbers import with_room
from knotwork.timing.watch import Watch

LARGEST = 8.0
"""Limits are tried up to this many times what they are."""

PATIENCE = 10.0
"""Time that the search for a cause may take, about [s]."""

PRECISION = 0.1
"""How well the least change is known, relative to it."""


def explained(problem: TimingProblem) -> TimingError:
    """Find out why no motion was found.

    An interval that can't be solved alone, its velocities being given, is the cause. Given
    durations are then let go, and after that each kind of limit is raised, to see what would do.
    """
    search = _Search(clock.perf_counter() + PATIENCE)
    try:
        for i in range(len(problem.position) - 1) if len(problem.position) > 2 else ():
            part = replace(part_of(problem, i, i + 1), total=None)
            if part.velocity_known.all() and search.solved(part) is None:
                return _of_part(part, i, search)
        return _of_part(problem, 0, search)
    except _OutOfTimeError:
        return _unexplained(problem, 0)


class _OutOfTimeError(Exception):
    """The search for a cause takes too long."""


@dataclass(frozen=True)
class _Search:
    """Solves changed problems until its patience ends."""

    deadline: float

    def solved(self, problem: TimingProblem) -> Attempt | None:
        if clock.perf_counter() > self.deadline:
            raise _OutOfTimeError
        return solved_section(problem, Watch(), starts=1)


def _of_part(problem: TimingProblem, first: int, search: _Search) -> TimingError:
    found = _too_short(problem, first, search)
    if found is not None:
        return found
    limits = problem.limits
    for name in (*MAGNITUDES[1:], MAGNITUDES[0], "position"):
        if name != "position" and not np.isfinite(getattr(limits, name)).any():
            continue
        raised = _least_change(problem, name, search)
        if raised is not None:
            return _limit_error(problem, first, name, raised)
    return _unexplained(problem, first)


def _unexplained(problem: TimingProblem, first: int) -> TimingError:
    return TimingError(
        f"between {problem.names[0]!r} and {problem.names[-1]!r} no motion was found that keeps "
        "all limits, and no single cause: allow longer durations, lower speeds or higher limits",
        waypoint=first,
        interval=len(problem.position) == 2,
    )


def _too_short(problem: TimingProblem, first: int, search: _Search) -> TimingError | None:
    """See whether longer durations than those given would do."""
    if problem.free.all() and problem.total is None:
        return None
    longer = replace(
        problem,
        duration=np.full(problem.duration.shape, np.nan),
        at_least=np.where(problem.free, problem.at_least, problem.duration),
        total=None,
        objective=replace(problem.objective, time=1.0, jerk=0.0, acceleration=0.0, effort=0.0),
    )
    found = search.solved(longer)
    if found is None:
        return None
    least = np.diff(found.found.knots.time)
    if problem.total is not None and problem.free.any():
        total = float(np.where(problem.free, least, problem.duration).sum())
        return _of_total(problem, problem.total, total)
    given = np.where(problem.free, np.inf, problem.duration)
    i = int(np.argmax(least / given))
    knots = found.found.knots
    held = binding_limits(longer, knots.time, found.found.curve)
    one = next((one for one in held if one.start == problem.names[i] and one.joint), None)
    return TimingError(
        f"from {problem.names[i]!r} to {problem.names[i + 1]!r} {given[i]:.6g} s are given; "
        + _passing(problem, i, search)
        + f"under the limits it takes {with_room(float(least[i])):.6g} s"
        + ("" if one is None else f", {one.joint!r} at its limit of {one.quantity}"),
        waypoint=first + i,
        interval=True,
        joint="" if one is None else one.joint,
        limit="duration",
        value=float(given[i]),
        bound=with_room(float(least[i])),
    )


def _of_total(problem: TimingProblem, given: float, least: float) -> TimingError:
    """Say why a motion can't last as long as is given."""
    found = f"the motion is to last {given:.6g} s; under the limits it takes at least "
    if least >= given * (1.0 - 1e-9):
        found += f"{with_room(least):.6g} s"
    else:
        found = (
            f"no motion that lasts {given:.6g} s was found: joints that pass waypoints at given "
            f"velocities can't wait; {with_room(least):.6g} s, the least, would do, or so much "
            "more that they can stop and go back"
        )
    return TimingError(found, limit="duration", value=given, bound=with_room(least))


def _passing(problem: TimingProblem, i: int, search: _Search) -> str:
    """Say if an interval can also be shorter than given: then its joints can't wait in it."""
    given = float(problem.duration[i])
    part = replace(
        part_of(problem, i, i + 1),
        duration=np.array([np.nan]),
        at_least=np.zeros(1),
        total=None,
        objective=Objective(),
    )
    found = search.solved(part) if part.velocity_known.all() else None
    if found is None:
        return ""
    least = with_room(float(np.ptp(found.found.knots.time)))
    return f"in passing it takes {least:.6g} s, or else " if least < given else ""


def _raised(problem: TimingProblem, name: str, factor: float) -> TimingProblem:
    limits = problem.limits
    if name == "position":
        room = (factor - 1.0) * np.ptp(problem.position, axis=0).max()
        return replace(
            problem, limits=replace(limits, lower=limits.lower - room, upper=limits.upper + room)
        )
    return replace(problem, limits=replace(limits, **{name: factor * getattr(limits, name)}))


def _least_change(problem: TimingProblem, name: str, search: _Search) -> PiecewisePolynomial | None:
    """The motion for which a kind of limit must be raised least, or `None` if that does not do."""

    def motion(factor: float) -> Attempt | None:
        return search.solved(_raised(problem, name, factor))

    low, high = 1.0, LARGEST
    best = motion(high)
    if best is None:
        return None
    while high - low > PRECISION * low:
        middle = float(np.sqrt(low * high))
        found = motion(middle)
        low, high = (low, middle) if found is not None else (middle, high)
        best = found or best
    return best.found.curve


def _limit_error(
    problem: TimingProblem, first: int, name: str, curve: PiecewisePolynomial
) -> TimingError:
    k, value, limit = _worst(problem, name, curve)
    unit = JOINT_QUANTITIES[name].units[problem.joint_units[k]]
    ends = f"{problem.names[0]!r} and {problem.names[-1]!r}"
    return TimingError(
        f"between {ends} no motion keeps all limits: joint {problem.joint_names[k]!r} needs "
        f"a limit of {name} of about {with_room(value):.4g} {unit}; it is {limit:.6g} {unit}",
        waypoint=first,
        interval=len(problem.position) == 2,
        joint=problem.joint_names[k],
        limit=name,
        value=limit,
        bound=value,
    )


def _worst(
    problem: TimingProblem, name: str, curve: PiecewisePolynomial
) -> tuple[int, float, float]:
    """The joint that is farthest beyond its limit: index, value and limit."""
    limits = problem.limits
    if name == "position":
        found = curve.extrema(0)
        below, above = limits.lower - found.minimum, found.maximum - limits.upper
        k = int(np.argmax(np.maximum(below, above)))
        if below[k] > above[k]:
            return k, float(found.minimum[k]), float(limits.lower[k])
        return k, float(found.maximum[k]), float(limits.upper[k])
    limit = getattr(limits, name)
    if name == "effort":
        shares = effort_shares(problem, curve).max(axis=0)
        k = int(np.argmax(shares))
        return k, float(shares[k] * limit[k]), float(limit[k])
    found = curve.extrema(DERIVATIVES.index(name))
    k = int(np.argmax(found.peak / limit))
    return k, float(found.peak[k]), float(limit[k])
