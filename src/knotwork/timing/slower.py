"""What is given beyond a limit or in too short a time, and what would do, all of it together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from knotwork.errors import TimingError
from knotwork.timing.attempts import with_longer
from knotwork.timing.explain import explained
from knotwork.timing.feasible import Fault, GivenDurationError, faults, unfit_durations
from knotwork.timing.holding import too_heavy
from knotwork.timing.problem import Objective, TimingProblem, part_of
from knotwork.timing.safe_numbers import rounded_down
from knotwork.timing.search import OutOfStepsError, Search
from knotwork.timing.windows import LONGEST

AROUND = 2
"""So many intervals on both sides of a waypoint of a long motion are solved with what is proposed
for it."""

LESS = (0.0, 0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Parts by which what is given is lowered, below what limits rule out, until a motion is found."""

HALVINGS = 3
"""So often the step between what does and what does not is halved."""

STILL = "stop here, or move the waypoint or the limit"
"""What does where a joint is at its position limit and moves."""

DIGITS = 4
"""Digits of a factor that is proposed."""

Factors = Mapping[Fault, float]


@dataclass(frozen=True)
class WronglyGiven:
    """What is given beyond a limit or in too short a time.

    Attributes:
        errors: An error for each waypoint and quantity, for each duration, and one for efforts;
            empty where nothing is wrong that can be seen without a search.
        mended: The problem with what is proposed at waypoints in place of what is given; `None`
            where more than that is wrong.
    """

    errors: list[TimingError]
    mended: TimingProblem | None


def wrongly_given(problem: TimingProblem) -> WronglyGiven:
    """Say what is given at waypoints beyond a limit, which durations are too short, and what does.

    A motion was found with all that is proposed, taken together, unless an error says otherwise.
    """
    heavy = too_heavy(problem, certain=True)
    found = faults(problem)
    if not found:
        wrong = [*heavy, *_wrong_durations(problem)]
        return WronglyGiven(wrong, None if wrong else problem)
    proposal = _proposal(problem, found)
    errors = [_error(problem, one, proposal) for one in found]
    slowed = _with(problem, proposal.factors)
    durations = _wrong_durations(slowed)
    if proposal.longer and not durations:
        durations = [one for one in explained(slowed) if one.limit == "duration"]
    for one in durations if proposal.factors else ():
        one.add("all of this with what is proposed at waypoints")
    whole = not heavy and not durations and proposal.found >= {*found}
    return WronglyGiven([*heavy, *errors, *durations], slowed if whole else None)


def _wrong_durations(problem: TimingProblem) -> list[TimingError]:
    """Durations that do not do, with what they must be under all limits where that is found."""
    wrong = unfit_durations(problem)
    if any(isinstance(one, GivenDurationError) for one in wrong):
        found = explained(problem)
        if all(one.limit == "duration" for one in found):
            return found
    return wrong


@dataclass(frozen=True)
class _Proposal:
    """What part of each thing given would do.

    Attributes:
        factors: The parts; where none was found, those that the limits do not rule out.
        found: Those with which, together, motions were found.
        longer: Whether these need longer durations than those given.
    """

    factors: Factors
    found: frozenset[Fault]
    longer: bool = False


def _proposal(problem: TimingProblem, found: list[Fault]) -> _Proposal:
    most = {one: rounded_down(one.factor, DIGITS) for one in found if one.given != "position"}
    lost = {one.waypoint for one in found if one.given == "position"}
    n = len(problem.position)
    around = [(max(0, one.waypoint - AROUND), min(n - 1, one.waypoint + AROUND)) for one in most]
    parts = {(0, n - 1)} if n <= LONGEST + 1 and not lost else set(around)
    parts = {part for part in parts if not any(part[0] <= i <= part[1] for i in lost)}
    passes = [False] if not unfit_durations(_with(problem, most)) else []
    for longer in passes + [True] * (not problem.free.all()):
        timed = replace(with_longer(problem) if longer else problem, total=None)
        try:
            factors = _that_do(replace(timed, objective=Objective()), most, parts, Search())
        except OutOfStepsError:
            continue
        if factors:
            return _Proposal({**most, **factors}, frozenset(factors), longer)
    return _Proposal(most, frozenset())


def _that_do(
    problem: TimingProblem, most: Factors, parts: set[tuple[int, int]], search: Search
) -> Factors:
    """Parts of what is given with which motions are found, each as large as the others let it be.

    Args:
        problem: The task.
        most: Parts that are not ruled out.
        parts: First and last waypoints of what is solved.
        search: What solves it.

    Returns:
        A part for each waypoint in a part of the motion that was found; empty if none was.
    """

    def does(factors: Factors, within: set[tuple[int, int]]) -> bool:
        tried = _with(problem, factors)
        return all(search.solved(part_of(tried, *one)) is not None for one in within)

    def lowered(fault: Fault, less: float) -> float:
        return rounded_down(fault.factor * (1.0 - less), DIGITS)

    def of(fault: Fault) -> set[tuple[int, int]]:
        return {one for one in parts if one[0] <= fault.waypoint <= one[1]}

    seen = [one for one in most if of(one)]
    less = {}
    for all_less in LESS if seen else ():
        tried = {**most, **{one: lowered(one, all_less) for one in seen}}
        if does(tried, parts):
            less = dict.fromkeys(seen, all_less)
            break
    for one in less:
        low, high = 0.0, less[one]
        for step in range(HALVINGS + 1 if high else 0):
            middle = 0.5 * (low + high) if step else 0.0
            tried = {**most, **{other: lowered(other, less[other]) for other in less}}
            if does({**tried, one: lowered(one, middle)}, of(one)):
                high = less[one] = middle
            else:
                low = middle
    return {one: lowered(one, part) for one, part in less.items()}


def _error(problem: TimingProblem, fault: Fault, proposal: _Proposal) -> TimingError:
    bound, advice = fault.bound, ""
    if fault in proposal.found:
        factor = proposal.factors[fault]
        bound = factor * fault.value
        advice = f". {factor:g} times the {fault.given} given here would do"
        if not factor:
            advice = f". No part of the {fault.given} given here would do: {STILL}"
    elif fault.given != "position" and not fault.factor:
        advice = f". No part of the {fault.given} given here is possible: {STILL}"
    elif fault.given != "position":
        advice = (
            f". At most {proposal.factors[fault]:g} times the {fault.given} given here is "
            "possible, and with jerk and the other waypoints perhaps less"
        )
    return TimingError(
        fault.said + advice,
        waypoint=fault.waypoint,
        joint=problem.joint_names[fault.joint],
        limit=fault.limit,
        value=fault.value,
        bound=bound,
    )


def _with(problem: TimingProblem, factors: Factors) -> TimingProblem:
    """The problem with parts of what is given at waypoints."""
    changed: dict[str, Any] = {}
    for one, factor in factors.items():
        values = changed.setdefault(one.given, np.array(getattr(problem, one.given)))
        values[one.waypoint] *= factor
    return replace(problem, **changed)
