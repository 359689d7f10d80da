"""Why a problem has no solution: the interval at fault, and the least change that would do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES
from knotwork.timing.attempts import with_longer
from knotwork.timing.binding import binding_limits
from knotwork.timing.holding import needs, overloads, too_heavy
from knotwork.timing.motion import Binding
from knotwork.timing.problem import BoolArray, Objective, TimingProblem, part_of
from knotwork.timing.safe_numbers import rounded_down, rounded_up, with_room
from knotwork.timing.search import ROOMS, OutOfStepsError, Search
from knotwork.timing.section import Found
from knotwork.timing.windows import LONGEST
from knotwork.waypoints import FloatArray

LARGEST = 8.0
"""Limits are tried up to this many times what they are."""

PRECISION = 0.1
"""How well the least change is known, relative to it."""

BESIDE = 2
"""So many intervals on both sides of one that is too short get longer with it, where need be."""

TOOL = "tool_speed"
"""The limit that is the tool's, not a joint's."""


def explained(problem: TimingProblem, before: int = 0) -> list[TimingError]:
    """Find out why no motion was found.

    A joint that can't hold the arm where it rests is told at once, and one that can't where the
    velocity is chosen as soon as more effort leads to a motion. Each interval that can't be
    solved alone, its velocities being given, is a cause. Given durations are then let go, and after
    that each kind of limit is raised, to see what would do.

    Args:
        problem: What has no solution.
        before: How many waypoints of the whole task are before its first one.

    Returns:
        At least one error.
    """
    found = too_heavy(problem, certain=False) or _causes(problem)
    for one in found:
        if one.waypoint is not None:
            one.waypoint += before
    return found


def _causes(problem: TimingProblem) -> list[TimingError]:
    search = Search()
    found: list[TimingError] = []
    n = len(problem.position)
    try:
        if 2 < n <= LONGEST + 1 and problem.total is None:
            found = _too_short(problem, 0, search)
            if found:
                return found
        found = _too_heavy_to_rest(problem, search)
        if found:
            return found
        for i in range(n - 1) if n > 2 else ():
            part = replace(part_of(problem, i, i + 1), total=None)
            told = any(one.waypoint == i for one in found)
            if not told and part.velocity_known.all() and search.solved(part) is None:
                begin = max(0, i - BESIDE)
                around = replace(part_of(problem, begin, min(n - 1, i + 1 + BESIDE)), total=None)
                found += _too_short(around, begin, search) or _of_part(part, i, search)
        return found or _of_part(problem, 0, search)
    except OutOfStepsError:
        why = "the search for one cause took too many steps"
        return found or [_unexplained(problem, 0, why)]


def _of_part(problem: TimingProblem, first: int, search: Search) -> list[TimingError]:
    found = _too_short(problem, first, search)
    if found:
        return found
    limits = problem.limits
    for name in (TOOL, *MAGNITUDES[1:], MAGNITUDES[0], "position"):
        if name != "position" and not np.any(np.isfinite(getattr(limits, name))):
            continue
        changes = _least_changes(problem, name, search)
        if changes:
            return [_limit_error(problem, first, name, changes)]
    return [_unexplained(problem, first, "no single cause")]


def _too_heavy_to_rest(problem: TimingProblem, search: Search) -> list[TimingError]:
    """See whether a motion is found once the arm can rest where velocities are chosen."""
    heavy = overloads(problem, ~problem.velocity_known)
    limit = problem.limits.effort
    for room in ROOMS if heavy else ():
        factors = {one: (1.0 + room) * one.effort / float(limit[one.joint]) for one in heavy}
        changes = [
            change
            for one, factor in factors.items()
            for change in _changes(problem, [("effort", one.joint)], factor)
        ]
        if search.solved(_with(problem, changes)) is not None:
            error = _limit_error(problem, heavy[0].waypoint, "effort", changes)
            error.add(
                f"{_to_rest(problem)}, and in motion it may pass there with less, which the search "
                "did not find"
            )
            return [error]
    return []


def _to_rest(problem: TimingProblem) -> str:
    """Which joints can't hold still where a velocity is chosen; empty if all can."""
    heavy = overloads(problem, ~problem.velocity_known)
    return "; and ".join(f"to rest at {needs(problem, one)}" for one in heavy)


def _unexplained(problem: TimingProblem, first: int, why: str) -> TimingError:
    rest = _to_rest(problem)
    return TimingError(
        f"between {problem.names[0]!r} and {problem.names[-1]!r} no motion was found that keeps "
        f"all limits, and {why}: allow longer durations, lower speeds or higher limits"
        + (f"; {rest}" if rest else ""),
        waypoint=first,
        interval=len(problem.position) == 2,
    )


def _too_short(problem: TimingProblem, first: int, search: Search) -> list[TimingError]:
    """See whether longer durations than those given would do: all of them together."""
    if problem.free.all() and problem.total is None:
        return []
    longer = with_longer(problem)
    found = search.solved(longer)
    if found is None:
        return []
    least = np.diff(found.found.knots.time)
    if problem.total is not None and problem.free.any():
        total = float(np.where(problem.free, least, problem.duration).sum())
        return [_of_total(problem, problem.total, total)]
    given = np.where(problem.free, np.inf, problem.duration)
    short = least > given * (1.0 + 1e-9)
    least_change = _needed_durations(problem, found.found, short, search)
    if least_change is None:
        return []
    needed, motion = least_change
    held = [
        one
        for each in (motion, found.found)
        for one in binding_limits(longer, each.knots.time, each.curve)
    ]
    errors = []
    for i in np.flatnonzero(short).tolist():
        one = next((one for one in held if one.start == problem.names[i]), None)
        errors.append(
            TimingError(
                f"from {problem.names[i]!r} to {problem.names[i + 1]!r} {given[i]:.6g} s are "
                "given, and no motion was found; "
                + _passing(problem, i, search)
                + f"with {needed[i]:.6g} s"
                + ("" if short.sum() == 1 else ", and with what is said of the other intervals,")
                + " one was found"
                + ("" if one is None else f", {_at_its_limit(one)}"),
                waypoint=first + i,
                interval=True,
                joint="" if one is None else one.joint,
                limit="duration",
                value=float(given[i]),
                bound=float(needed[i]),
            )
        )
    return errors


def _at_its_limit(one: Binding) -> str:
    who = repr(one.joint) if one.joint else "the tool"
    return f"{who} at its limit of {one.quantity.removeprefix('tool ')}"


def _needed_durations(
    problem: TimingProblem, longer: Found, short: BoolArray, search: Search
) -> tuple[FloatArray, Found] | None:
    """Durations, as they are printed, with which a motion is found, and that motion.

    The shortest motion that lasts no less than is given may take longer for an interval than need
    be, so these are nearer to those given, as far as the search allows. Where it takes too long,
    they are those of that motion.
    """
    least = np.diff(longer.knots.time)

    def printed(durations: FloatArray) -> FloatArray:
        return np.where(short, [with_room(float(h)) for h in durations], problem.duration)

    needed = printed(least)
    try:
        for room in ROOMS:
            needed = printed(least * (1.0 + room))
            found = search.solved(replace(problem, duration=needed))
            if found is not None:
                break
        else:
            return None
        longer, change = found.found, needed - problem.duration
        low, high, part = 0.0, 1.0, 1.0 - PRECISION
        while high - low > PRECISION * max(high, PRECISION):
            fewer = printed(problem.duration + part * change)
            found = search.solved(replace(problem, duration=fewer))
            if found is None:
                low = part
            else:
                needed, longer, high = fewer, found.found, part
            part = 0.5 * (low + high)
    except OutOfStepsError:
        pass  # what was found so far does
    return needed, longer


def _of_total(problem: TimingProblem, given: float, least: float) -> TimingError:
    """Say why a motion can't last as long as is given."""
    if least >= given * (1.0 - 1e-9):
        found = (
            f"the motion is to last {given:.6g} s; the shortest that was found under the limits "
            f"takes {with_room(least):.6g} s"
        )
    else:
        found = (
            f"no motion that lasts {given:.6g} s was found: joints that pass waypoints at given "
            f"velocities can't wait; {with_room(least):.6g} s, the least, would do, or so much "
            "more that they can stop and go back"
        )
    return TimingError(found, limit="duration", value=given, bound=with_room(least))


def _passing(problem: TimingProblem, i: int, search: Search) -> str:
    """Say if an interval can also be shorter than given: then its joints can't wait in it."""
    given = float(problem.duration[i])
    part = replace(
        part_of(problem, i, i + 1),
        duration=np.array([np.nan]),
        at_least=np.zeros(1),
        total=None,
        objective=Objective(),
    )
    try:
        found = search.solved(part) if part.velocity_known.all() else None
    except OutOfStepsError:
        return ""  # what would do is known without it
    if found is None:
        return ""
    least = with_room(float(np.ptp(found.found.knots.time)))
    return f"in passing it takes {least:.6g} s, or else " if least < 0.99 * given else ""


def _least_changes(problem: TimingProblem, name: str, search: Search) -> list[_Change]:
    """Find the fewest joints whose limits of a kind must be raised, and about how far at least.

    A motion was found with just these limits. The list is empty if this kind alone does not do.
    Where the search takes too long, they are more, or raised farther, than need be.
    """

    def does(changes: list[_Change]) -> bool:
        return search.solved(_with(problem, changes)) is not None

    needed = _bounds_of(problem, name)
    low, high = 1.0, LARGEST
    if not does(_changes(problem, needed, high)):
        return []
    try:
        while high - low > PRECISION * low:
            middle = float(np.sqrt(low * high))
            low, high = (low, middle) if does(_changes(problem, needed, middle)) else (middle, high)
        for one in _bounds_of(problem, name):
            fewer = [other for other in needed if other != one]
            if fewer and does(_changes(problem, fewer, high)):
                needed = fewer
    except OutOfStepsError:
        pass  # what was found so far does
    return _changes(problem, needed, high)


@dataclass(frozen=True)
class _Change:
    """A limit of a joint or of the tool, as it is and as it would have to be.

    Attributes:
        field: Of the limits: `"lower"`, `"upper"`, `"tool_speed"` or the name of a magnitude.
        joint: Its index; 0 for the tool.
        given: What it is, in SI.
        needed: What is proposed, in SI, as rounded as it is printed.
    """

    field: str
    joint: int
    given: float
    needed: float


def _bounds_of(problem: TimingProblem, name: str) -> list[tuple[str, int]]:
    fields = ("lower", "upper") if name == "position" else (name,)
    limits = problem.limits
    return [
        (f, int(k))
        for f in fields
        for k in np.flatnonzero(np.isfinite(np.atleast_1d(getattr(limits, f))))
    ]


def _changes(
    problem: TimingProblem, bounds: Sequence[tuple[str, int]], factor: float
) -> list[_Change]:
    """Move some limits outwards, to numbers as they are printed in the units of the file."""
    room = (factor - 1.0) * float(np.ptp(problem.position, axis=0).max())
    changes = []
    for field, k in bounds:
        given = float(np.atleast_1d(getattr(problem.limits, field))[k])
        moved = {"lower": given - room, "upper": given + room}.get(field, given * factor)
        scale, _ = problem.units.shown(1.0, _unit(problem, field, k))
        scale /= _margin(problem, field)
        outwards = rounded_down if (field == "lower") else rounded_up
        changes.append(_Change(field, k, given, outwards(moved * scale, 4) / scale))
    return changes


def _with(problem: TimingProblem, changes: Sequence[_Change]) -> TimingProblem:
    limits = problem.limits
    fields: dict[str, Any] = {}
    for one in changes:
        if one.field == TOOL:
            fields[TOOL] = one.needed
        else:
            fields.setdefault(one.field, getattr(limits, one.field).copy())[one.joint] = one.needed
    return replace(problem, limits=replace(limits, **fields))


def _unit(problem: TimingProblem, field: str, joint: int) -> str:
    if field == TOOL:
        return "m/s"
    name = "position" if field in ("lower", "upper") else field
    return JOINT_QUANTITIES[name].units[problem.joint_units[joint]]


def _margin(problem: TimingProblem, field: str) -> float:
    return 1.0 if field in ("lower", "upper") else problem.limits.margin


def _limit_error(
    problem: TimingProblem, first: int, name: str, changes: Sequence[_Change]
) -> TimingError:
    ends = f"{problem.names[0]!r} and {problem.names[-1]!r}"
    text, margin = problem.units.text, _margin(problem, changes[0].field)

    def needs(one: _Change) -> str:
        unit = _unit(problem, one.field, one.joint)
        limit = (
            TOOL
            if one.field == TOOL
            else f"joint {problem.joint_names[one.joint]!r} at a limit of {name}"
        )
        return (
            f"{limit} of about {text(one.needed / margin, unit)}; "
            f"it is {text(one.given / margin, unit)}"
        )

    worst = changes[0]
    return TimingError(
        f"between {ends} no motion was found that keeps all limits; one was found with "
        + "; and ".join(needs(one) for one in changes)
        + problem.limits.said_of_margin,
        waypoint=first,
        interval=len(problem.position) == 2,
        joint="" if worst.field == TOOL else problem.joint_names[worst.joint],
        limit=name.replace("_", " "),
        value=worst.given,
        bound=worst.needed,
    )
