"""One section solved: from a few starts, until a motion keeps every limit exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from knotwork.timing.budget import Watch
from knotwork.timing.exact_curve import ExactCurve, rebuilt
from knotwork.timing.initial_guess import (
    Guess,
    plain_guess,
    short_durations,
)
from knotwork.timing.motion import Status
from knotwork.timing.problem import TimingProblem
from knotwork.timing.program import Solution
from knotwork.timing.section import Section
from knotwork.timing.stop_to_stop import SLOWER, resting_knots
from knotwork.timing.tightening import first_tightening, keeps_limits, tightened

MOST_TIMES = 12
"""How often a start is solved again, with more tightening, before it has failed."""

NEARLY = 1.001
"""A motion with rests is not improved on if it takes at most this many times as long."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A motion that keeps every limit.

    Attributes:
        found: The motion.
        status: As of a `TimedMotion`.
    """

    found: ExactCurve
    status: Status


def solved_section(problem: TimingProblem, watch: Watch) -> Attempt | None:
    """Solve a section: the first start that leads to a solution decides.

    Args:
        problem: The section.
        watch: Follows the steps and holds the budget.

    Returns:
        The motion; where no start led to a solution, or the budget ended before, one that rests
        in each interval; `None` if there is none.
    """
    given = float(np.nansum(problem.duration))
    if problem.objective.only_time and problem.free.any() and given:
        rests = resting(problem, "resting")
        if rests is not None and rests.found.curve.x[-1] <= NEARLY * given:
            return rests  # the free time is negligible against the given one
    rests = None if watch.budget is None else resting(problem, "stopped")
    for start in _starts(problem):
        found = _run(start, problem, watch, found=rests is not None)
        if found is not None:
            return found
    return rests if watch.late(found=rests is not None) else resting(problem, "resting")


def _starts(problem: TimingProblem) -> Iterator[Guess]:
    """Where to start."""
    if (short_durations(problem) < float("inf")).any():
        yield plain_guess(problem, hurried=True)
    yield plain_guess(problem)


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
                return Attempt(ExactCurve(knots, curve), status)
    return None


def _run(guess: Guess, problem: TimingProblem, watch: Watch, *, found: bool) -> Attempt | None:
    """Solve from one start, with more tightening each time that the exact check finds an excess.

    Args:
        guess: The start.
        problem: The section.
        watch: Holds the budget.
        found: Whether there is a motion already.
    """
    tightening = first_tightening(problem)
    last: Solution | None = None
    again = False
    for _ in range(MOST_TIMES):
        seconds = watch.left(found=found)
        if seconds <= 0.0:
            return None
        section = Section(problem, guess, tightening)
        solution = section.solve(last, seconds)
        watch.step(solution.iterations)
        if not solution.solved:
            if last is None or again:
                return None
            last, again = None, True  # what was near to a solution is none any more
            continue
        made = section.rebuild(solution.x)
        more = tightened(problem, tightening, made.curve)
        if more is None:
            return Attempt(made, "optimal")
        if more.margin >= 1.0:
            return None  # nothing is left of the limits
        # with further equations the solution is a poor start
        last = solution if more.same_equations(tightening) else None
        tightening = more
    return None
