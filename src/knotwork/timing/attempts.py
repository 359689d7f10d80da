"""One section solved: from a few starts, until a motion keeps every limit exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from knotwork.timing.budget import Steps, Watch
from knotwork.timing.exact_curve import ExactCurve, rebuilt
from knotwork.timing.initial_guess import (
    Guess,
    near_guess,
    plain_guess,
    short_durations,
    stretched_guess,
)
from knotwork.timing.motion import Status
from knotwork.timing.objective_terms import terms, weighted
from knotwork.timing.problem import Objective, TimingProblem
from knotwork.timing.program import Solution, joined_limits
from knotwork.timing.section import Section
from knotwork.timing.stop_to_stop import SLOWER, resting_knots, with_longer
from knotwork.timing.tightening import (
    Tightening,
    equations_of,
    first_tightening,
    keeps_limits,
    tightened,
)
from knotwork.waypoints import FloatArray

STARTS = (1.0, 0.5, 2.0)
"""Factors of the first durations that are tried until one leads to a solution."""

MOST_TIMES = 12
"""How often a start is solved again, with more tightening, before it has failed."""

NEARLY = 1.001
"""A motion with rests is not improved on if it takes at most this many times as long."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A motion that keeps every limit.

    Attributes:
        found: The motion.
        cost: What it costs.
        status: As of a `TimedMotion`.
        tightening: The limits as the solver had them.
    """

    found: ExactCurve
    cost: float
    status: Status
    tightening: Tightening


def solved_section(
    problem: TimingProblem, watch: Watch, guess: Guess | None = None
) -> Attempt | None:
    """Solve a section: the first start that leads to a solution decides.

    Args:
        problem: The section.
        watch: Follows the steps and holds the budget.
        guess: Where to start first.

    Returns:
        The motion; where no start led to a solution, or the budget ended before, one that rests
        in each interval if it is the best; `None` if there is none.
    """
    best: Attempt | None = None
    rests = _negligible_free_time(problem)
    if rests is not None:
        return rests
    for start, tightening in _starts(problem, watch, guess):
        found = _run(start, problem, watch, tightening)
        best = _better(best, found)
        if best is not None and (best.status == "optimal" or watch.late(found=True)):
            break
        if watch.late(found=False):
            break
    if best is not None and best.status == "optimal":
        return best
    return _better(best, resting(problem, "stopped" if watch.late(found=False) else "resting"))


def _negligible_free_time(problem: TimingProblem) -> Attempt | None:
    """The motion with rests, if its free time is negligible against its given time."""
    given = float(np.nansum(problem.duration))
    if not (problem.objective.only_time and problem.free.any() and given):
        return None
    rests = resting(problem, "resting")
    return rests if rests is not None and rests.found.curve.x[-1] <= NEARLY * given else None


def _better(one: Attempt | None, other: Attempt | None) -> Attempt | None:
    if one is None or other is None:
        return one or other
    return min(one, other, key=lambda attempt: attempt.cost)


def _starts(
    problem: TimingProblem, watch: Watch, guess: Guess | None
) -> Iterator[tuple[Guess, Tightening]]:
    """Where to start, and what to hold the solver to at first."""
    if watch.late(found=False):
        return
    tightening, fixed = (
        first_tightening(problem),
        problem.total is not None or not problem.free.all(),
    )
    if guess is not None:
        yield (stretched_guess(guess, problem) if fixed else guess), tightening
    if not np.isnan(short_durations(problem)).all():
        yield plain_guess(problem, STARTS[0], hurried=True), tightening
    varied = problem.free.any() and problem.total is None
    for stretch in STARTS if varied else STARTS[:1]:
        yield plain_guess(problem, stretch), tightening
    for found in _fastest(problem, watch) if fixed else ():
        start = stretched_guess(near_guess(found.found), problem)
        if found.tightening.effort is None:
            yield start, tightening
        else:  # limit efforts from the first step on, or it leaves the only feasible region
            yield replace(start, near=False), found.tightening


def _fastest(problem: TimingProblem, watch: Watch) -> Iterator[Attempt]:
    """Motions without the given total, or without the given durations."""
    whole = [replace(problem, total=None, objective=Objective())]
    for loose in whole if problem.total else (with_longer(problem, part) for part in (0.0, 1.0)):
        found = solved_section(loose, watch)
        if found is not None and found.status == "optimal":
            yield found


def resting(problem: TimingProblem, status: Status) -> Attempt | None:
    """The fastest motion that rests in every interval and keeps every limit, if there is one."""
    for slower in SLOWER:
        knots = resting_knots(problem, slower)
        if knots is None:
            return None
        curve = rebuilt(knots)
        if keeps_limits(problem, curve):
            cost = weighted(problem, terms(problem, curve))
            return Attempt(ExactCurve(knots, curve), cost, status, first_tightening(problem))
    return None


def _run(
    guess: Guess, problem: TimingProblem, watch: Watch, tightening: Tightening
) -> Attempt | None:
    """Solve from one start, with more tightening each time that the exact check finds an excess."""
    last: Solution | None = None
    best: Attempt | None = None
    again = False
    for _ in range(MOST_TIMES):
        section = Section(problem, guess, tightening)
        steps = _steps(section, watch, best)
        solution = section.solve(last, steps if watch.needed else None)
        if not watch.needed:
            watch.iterations += solution.iterations
        if steps.best is not None:
            best = Attempt(steps.best[1], steps.best[0], "stopped", tightening)
        if solution.solved:
            found = section.rebuild(solution.x)
            more = tightened(problem, tightening, found.curve)
            if more is None:
                cost = weighted(problem, terms(problem, found.curve))
                return Attempt(found, cost, "optimal", tightening)
            # with further equations the solution is a poor start
            same = equations_of(more) == equations_of(tightening)
            tightening, last = more, solution if same else None
        elif last is None or again or watch.late(found=best is not None):
            return best
        else:  # what was near to a solution is none any more: start again, once
            last, again = None, True
    return best


def _steps(section: Section, watch: Watch, best: Attempt | None) -> Steps:
    problem = section.problem

    def attempt(x: FloatArray) -> tuple[float, ExactCurve] | None:
        found = section.rebuild(x)
        if tightened(problem, section.tightening, found.curve) is not None:
            return None
        return weighted(problem, terms(problem, found.curve)), found

    known = None if best is None else (best.cost, best.found)
    return Steps(watch, *joined_limits(section.limits()), attempt, known)
