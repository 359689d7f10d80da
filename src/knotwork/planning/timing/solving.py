"""`solve`: durations, velocities and accelerations that minimise an objective under limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import TimingError, merge_errors
from knotwork.planning.timing.budget import Budget, Progress
from knotwork.planning.timing.infeasible import infeasible_values, unsolved_errors
from knotwork.planning.timing.initial_guess import plain_guess
from knotwork.planning.timing.minimum_durations import lower_bound
from knotwork.planning.timing.motion_curves import concatenate
from knotwork.planning.timing.nonlinear_program import Solution
from knotwork.planning.timing.stop_to_stop import resting_motion
from knotwork.planning.timing.tightening import first_tightening, tighten
from knotwork.planning.timing.timed_motion import TimedCurve, TimedMotion, worst_status
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.planning.timing.timing_program import TimingProgram

KEPT_INTERVALS = 8
"""Number of intervals of each horizon whose motion is kept."""
INTERVALS_AHEAD = 4
"""Number of following intervals that are solved with them."""
MAX_INTERVALS = 24
"""Maximum number of intervals of a motion that is solved at once."""
MAX_TIGHTENINGS = 12
"""Maximum number of solutions from a start, each with more tightening."""

MAX_RESTING_RATIO = 1.001
"""Maximum ratio of the duration of a motion with rests to the given time for which it is kept."""


def solve(
    problem: TimingProblem,
    *,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> TimedMotion:
    """Minimise the objective of a problem over its unknowns, within all limits.

    A long motion is solved over a receding horizon: a few intervals at a time, and some after
    them. The optimum is local: the solver (IPOPT) starts from plain cubics. If it does not
    converge, the arm comes to rest in each interval.

    Args:
        problem: The waypoints and the limits.
        budget: Time after which the best motion so far is returned [s]; by default unlimited.
        progress: Called with the progress of the solver.

    Returns:
        A motion that keeps every limit, by the exact extrema of its polynomials.

    Raises:
        TimingError: No motion within the limits was found. The error has the location and
            sufficient values.

    >>> from knotwork.joint_quantities import JointLimits
    >>> limits = JointLimits(velocity=[1.0], acceleration=[4.0], jerk=[100.0])
    >>> motion = solve(TimingProblem(("a",), [[0], [1]], [[0], [0]], limits))
    >>> motion.status, motion.lower_bound < motion.duration < 1.3
    ('optimal', True)
    """
    return solve_with_budget(problem, Budget(progress, budget, len(problem.position) - 1))


def solve_with_budget(problem: TimingProblem, budget: Budget) -> TimedMotion:
    """Solve one of several problems that share a budget, see `solve`.

    Args:
        problem: The waypoints and the limits.
        budget: Progress and budget of all problems.

    Raises:
        TimingError: No motion within the limits was found. Its `others` are further causes.
    """
    if wrong := infeasible_values(problem):
        raise merge_errors(wrong)
    earlier_iterations = budget.iterations
    intervals = len(problem.duration)
    if intervals <= MAX_INTERVALS or problem.total is not None:
        motion = _solve_at_once(problem, budget)
        budget.count_solved(intervals)
    else:
        motion = _solve_over_horizons(problem, budget)
    if motion is None and budget.has_ended:
        message = (
            "no motion that keeps every limit was found within the budget of "
            f"{budget.seconds:g} s; accepted: a larger budget, or none"
        )
        raise TimingError(message, cause="budget")
    if motion is None:
        raise merge_errors(unsolved_errors(problem))
    timed = TimedMotion.of(problem, motion, lower_bound(problem), "fastest")
    return replace(timed, iterations=budget.iterations - earlier_iterations)


def _solve_over_horizons(problem: TimingProblem, budget: Budget) -> TimedCurve | None:
    """Solve a long problem horizon by horizon, or at once if one has no motion.

    Each horizon begins with the state at the end of the one before.
    """
    motions: list[TimedCurve] = []
    start_known = problem
    first, last = 0, len(problem.duration)
    while first < last:
        is_last = last - first <= KEPT_INTERVALS + 2 * INTERVALS_AHEAD
        end = last if is_last else first + KEPT_INTERVALS + INTERVALS_AHEAD
        count = end - first if is_last else KEPT_INTERVALS
        motion = _solve_at_once(start_known.between(first, end), budget)
        if motion is None or motion.status == "resting":  # the start state may be the reason
            budget.count_solved(last - first)
            return _solve_at_once(problem, budget)
        budget.count_solved(count)
        first += count
        seam = motion.time[count]
        start_known = start_known.with_state(first, motion.curve(seam, 1), motion.curve(seam, 2))
        motions.append(_first_intervals(motion, count))
    return _consecutive(motions)


def _solve_at_once(problem: TimingProblem, budget: Budget) -> TimedCurve | None:
    """Solve a problem, or a part of one, with all its intervals together.

    Returns:
        The motion. If the solver does not converge within the budget, one that rests in each
        interval; `None` if there is none.
    """
    given_time = float(np.nansum(problem.duration))
    if problem.objective.only_time and problem.duration_is_unknown.any() and given_time:
        resting = resting_motion(problem, "resting")
        if resting is not None and resting.time[-1] <= MAX_RESTING_RATIO * given_time:
            return resting  # the unknown time is negligible against the given one
    motion = _optimised_motion(problem, budget)
    if motion is not None:
        return motion
    return resting_motion(problem, "budget" if budget.has_ended else "resting")


def _optimised_motion(problem: TimingProblem, budget: Budget) -> TimedCurve | None:
    """Run the solver, with more tightening whenever the exact check finds an excess."""
    guess, tightening = plain_guess(problem), first_tightening(problem)
    last: Solution | None = None
    for _ in range(MAX_TIGHTENINGS):
        seconds = budget.remaining
        if seconds <= 0.0:
            return None
        program = TimingProgram(problem, guess, tightening)
        solution = program.solve(last, seconds)
        budget.report(solution.iterations)
        if not solution.solved:
            if last is None:
                return None
            last = None  # the previous solution is too far away
            continue
        time, curve = program.motion_of(solution.x)
        more = tighten(problem, tightening, curve)
        if more is None:
            return TimedCurve(time, curve, "optimal")
        if more.margin >= 1.0:
            return None  # no margin is left
        # with further limits the solution is a poor start
        last = solution if more.kinds_of_limits == tightening.kinds_of_limits else None
        tightening = more
    return None


def _first_intervals(motion: TimedCurve, count: int) -> TimedCurve:
    """The first intervals of a motion."""
    time, curve = motion.time[: count + 1], motion.curve
    pieces = int(np.searchsorted(curve.x, time[-1]))
    first = PiecewisePolynomial(curve.c[:, :pieces], curve.x[: pieces + 1])
    return TimedCurve(time, first, motion.status)


def _consecutive(motions: Sequence[TimedCurve]) -> TimedCurve:
    """Consecutive motions, each from time 0 on, as one."""
    starts = np.cumsum([0.0, *(motion.time[-1] for motion in motions)])
    times = [start + motion.time[:-1] for start, motion in zip(starts, motions, strict=False)]
    return TimedCurve(
        np.append(np.concatenate(times), starts[-1]),
        concatenate(*(motion.curve for motion in motions)),
        worst_status(motion.status for motion in motions),
    )
