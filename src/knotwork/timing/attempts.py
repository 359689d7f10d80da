"""One section solved: from a few starts, until a motion keeps every limit exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

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
from knotwork.timing.problem import TimingProblem
from knotwork.timing.program import Solution, joined_limits
from knotwork.timing.section import Section
from knotwork.timing.stop_to_stop import SLOWER, resting_knots, with_longer
from knotwork.timing.tightening import Tightening, first_tightening, keeps_limits, tightened
from knotwork.waypoints import FloatArray

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
    tightening: Tightening = field(default_factory=Tightening)


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
    given = float(np.nansum(problem.duration))
    if problem.objective.only_time and problem.free.any() and given:
        rests = resting(problem, "resting")
        if rests is not None and rests.found.curve.x[-1] <= NEARLY * given:
            return rests  # the free time is negligible against the given one
    for start, tightening in _starts(problem, watch, guess):
        if watch.late(found=best is not None):
            break
        best = _better(best, _run(start, problem, watch, tightening))
        if best is not None and best.status == "optimal":
            return best
    return _better(best, resting(problem, "stopped" if watch.late(found=False) else "resting"))


def _attempt(problem: TimingProblem, found: ExactCurve, status: Status) -> Attempt:
    return Attempt(found, weighted(problem, terms(problem, found.curve)), status)


def _better(one: Attempt | None, other: Attempt | None) -> Attempt | None:
    if one is None or other is None:
        return one or other
    return min(one, other, key=lambda attempt: attempt.cost)


def _starts(
    problem: TimingProblem, watch: Watch, guess: Guess | None
) -> Iterator[tuple[Guess, Tightening]]:
    """Where to start, and what to hold the solver to at first."""
    tightening = first_tightening(problem)
    if guess is not None:
        yield stretched_guess(guess, problem), tightening
    if (short_durations(problem) < float("inf")).any():
        yield plain_guess(problem, hurried=True), tightening
    yield plain_guess(problem), tightening
    if problem.total is not None or not problem.free.all():
        fastest = solved_section(with_longer(problem, 0.0), watch)
        if fastest is not None and fastest.status == "optimal":
            start = stretched_guess(near_guess(fastest.found), problem)
            # with efforts at their limits the solver would leave the only feasible region
            held = fastest.tightening.held
            yield replace(start, near=not held), replace(tightening, held=held)


def resting(problem: TimingProblem, status: Status) -> Attempt | None:
    """The fastest motion that rests in every interval and keeps every limit, if there is one."""
    moving = bool(problem.velocity[problem.velocity_known].any())
    for slower in SLOWER:
        # a moving arm may have to brake at once, and may go slowly from there
        for braking in sorted({1.0, slower} if moving else {slower}):
            knots = resting_knots(problem, slower, braking)
            if knots is None:
                return None
            curve = rebuilt(knots)
            if keeps_limits(problem, curve):
                return _attempt(problem, ExactCurve(knots, curve), status)
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

        def attempt(x: FloatArray, section: Section = section) -> Attempt | None:
            found = section.rebuild(x)
            if tightened(problem, section.tightening, found.curve) is not None:
                return None
            return _attempt(problem, found, "stopped")

        steps = Steps(watch, *joined_limits(section.limits()), attempt, best)
        solution = section.solve(last, steps if watch.needed else None)
        best = steps.best
        if not watch.needed:
            watch.iterations += solution.iterations
        if not solution.solved:
            if last is None or again or watch.late(found=best is not None):
                return best
            last, again = None, True  # what was near to a solution is none any more
            continue
        found = section.rebuild(solution.x)
        more = tightened(problem, tightening, found.curve)
        if more is None:
            return replace(_attempt(problem, found, "optimal"), tightening=tightening)
        if more.margin >= 1.0:
            return best  # nothing is left of the limits
        # with further equations the solution is a poor start
        last = solution if more.same_equations(tightening) else None
        tightening = more
    return best
