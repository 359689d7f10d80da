"""Solution of one section: from one start, until a motion keeps every limit exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.timing.initial_guess import plain_guess
from knotwork.planning.timing.motion_curves import concatenate
from knotwork.planning.timing.nonlinear_program import Solution
from knotwork.planning.timing.section import SectionProgram
from knotwork.planning.timing.stop_to_stop import SLOWDOWN_FACTORS, resting_intervals
from knotwork.planning.timing.tightening import first_tightening, keeps_limits, tighten
from knotwork.planning.timing.timed_motion import Budget, Status
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.waypoints import FloatArray

MAX_TIGHTENINGS = 12
"""Maximum number of solutions from a start, each with more tightening."""

MAX_RESTING_RATIO = 1.001
"""Maximum ratio of the duration of a motion with rests to the given time for which it is kept."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A motion that keeps every limit.

    Attributes:
        time: Times of the waypoints from 0 on [s], shape (n,).
        curve: Joint positions over time.
        status: Status, see `TimedMotion`.
    """

    time: FloatArray
    curve: PiecewisePolynomial
    status: Status


def solve_section(problem: TimingProblem, budget: Budget) -> Attempt | None:
    """Solve a section from a plain guess.

    Args:
        problem: The section.
        budget: Progress and budget.

    Returns:
        The motion. If the solver does not converge within the budget, one that rests in each
        interval; `None` if there is none.
    """
    given_time = float(np.nansum(problem.duration))
    if problem.objective.only_time and problem.free.any() and given_time:
        resting = resting_motion(problem, "resting")
        if resting is not None and resting.time[-1] <= MAX_RESTING_RATIO * given_time:
            return resting  # the free time is negligible against the given one
    attempt = _optimised_motion(problem, budget)
    if attempt is not None:
        return attempt
    return resting_motion(problem, "stopped" if budget.is_over else "resting")


def resting_motion(problem: TimingProblem, status: Status) -> Attempt | None:
    """The fastest motion that rests in every interval and keeps every limit, or `None`."""
    moving = bool(problem.velocity[problem.velocity_known].any())
    for slower in SLOWDOWN_FACTORS:
        # a moving arm may have to brake at once, and can move slowly after that
        for braking in sorted({1.0, slower} if moving else {slower}):
            intervals = resting_intervals(problem, slower, braking)
            if intervals is None:
                return None
            curve = concatenate(*intervals)
            if keeps_limits(problem, curve):
                time = np.cumsum([0.0, *(interval.x[-1] for interval in intervals)])
                return Attempt(time, curve, status)
    return None


def _optimised_motion(problem: TimingProblem, budget: Budget) -> Attempt | None:
    """Solve a section with more tightening whenever the exact check finds an excess."""
    guess, tightening = plain_guess(problem), first_tightening(problem)
    last: Solution | None = None
    for _ in range(MAX_TIGHTENINGS):
        seconds = budget.remaining()
        if seconds <= 0.0:
            return None
        program = SectionProgram(problem, guess, tightening)
        solution = program.solve(last, seconds)
        budget.step(solution.iterations)
        if not solution.solved:
            if last is None:
                return None
            last = None  # the previous solution is too far away
            continue
        time, curve = program.motion_of(solution.x)
        more = tighten(problem, tightening, curve)
        if more is None:
            return Attempt(time, curve, "optimal")
        if more.margin >= 1.0:
            return None  # no margin is left
        # with further equations the solution is a poor start
        last = solution if more.same_equations(tightening) else None
        tightening = more
    return None
