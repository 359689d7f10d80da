"""Motion of a section of a timing problem: solutions from a guess until one keeps every limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.long_intervals import guessed_states
from knotwork.planning.timing.motion_curves import concatenate
from knotwork.planning.timing.motion_states import States
from knotwork.planning.timing.nonlinear_program import Solution
from knotwork.planning.timing.stop_to_stop import SLOWDOWN_FACTORS, resting_intervals
from knotwork.planning.timing.tightening import first_tightening, keeps_limits, tighten
from knotwork.planning.timing.timed_motion import Status
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.planning.timing.timing_program import TimingProgram

MAX_TIGHTENINGS = 12
"""Maximum number of solutions from a start, each with more tightening."""

MAX_RESTING_RATIO = 1.001
"""Maximum ratio of the duration of a motion with rests to the given time for which it is kept."""


@dataclass(frozen=True, eq=False)
class TimedCurve:
    """Motion of a section, which keeps every limit; `TimedMotion` is that of a whole problem.

    Attributes:
        time: Times of the waypoints from 0 on [s], shape (n,).
        curve: Joint positions over time.
        status: Status, see `TimedMotion`.
    """

    time: FloatArray
    curve: PiecewisePolynomial
    status: Status


def solve_at_once(problem: TimingProblem, budget: Budget) -> TimedCurve | None:
    """Solve a section, or a window of one, from a plain guess.

    Args:
        problem: The section or window.
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
    motion = _optimised_motion(problem, budget)
    if motion is not None:
        return motion
    return resting_motion(problem, "budget" if budget.time_limit.is_over else "resting")


def resting_motion(problem: TimingProblem, status: Status) -> TimedCurve | None:
    """A motion that rests in every interval and keeps every limit, or `None`.

    It is the first of `SLOWDOWN_FACTORS` that does; a smaller factor between them may be enough.
    """
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
                return TimedCurve(time, curve, status)
    return None


def _optimised_motion(problem: TimingProblem, budget: Budget) -> TimedCurve | None:
    """Solve a section with more tightening whenever the exact check finds an excess."""
    guess, tightening = plain_guess(problem), first_tightening(problem)
    last: Solution | None = None
    for _ in range(MAX_TIGHTENINGS):
        seconds = budget.time_limit.remaining
        if seconds <= 0.0:
            return None
        program = TimingProgram(problem, guess, tightening)
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
            return TimedCurve(time, curve, "optimal")
        if more.margin >= 1.0:
            return None  # no margin is left
        # with further equations the solution is a poor start
        last = solution if more.equations == tightening.equations else None
        tightening = more
    return None


def plain_guess(problem: TimingProblem) -> States:
    """An initial guess of plain cubics, by the states at the breaks of the solver's pieces.

    Joints pass waypoints without a stop where they may.
    """
    velocity = first_velocities(problem)
    duration = first_durations(problem, velocity)
    duration = np.where(problem.free, np.maximum(duration, problem.at_least), duration)
    short = short_durations(problem)
    duration = np.where(np.isnan(short), duration, np.minimum(short, duration))
    if problem.total is not None:
        duration = duration * (problem.total / duration.sum())
    return guessed_states(problem, duration, velocity)


def first_durations(problem: TimingProblem, velocity: FloatArray) -> FloatArray:
    """Durations in which each interval is likely to be feasible [s], shape (n-1,)."""
    limits = problem.limits
    D = np.abs(np.diff(problem.position, axis=0))
    v0, v1 = np.abs(velocity[:-1]), np.abs(velocity[1:])
    V, A, J = limits.velocity, limits.acceleration, limits.jerk
    with np.errstate(invalid="ignore"):
        ramp = np.where(np.isinf(A), 0.0, np.divide(A, J))  # 0 where the jerk is not limited
        h = np.maximum(np.maximum(D / V, 2.0 * np.sqrt(D / A)), np.cbrt(32.0 * D / J))
        h = h + (v0 + v1) / A + np.where(np.isfinite(ramp), ramp, 0.0)
    typical = h.max(axis=1)
    mean = np.divide(D, np.maximum(v0, v1), out=np.zeros_like(D), where=np.maximum(v0, v1) > 0.0)
    typical = np.where(typical > 0.0, typical, mean.max(axis=1))
    typical = np.maximum(typical, problem.at_least)
    typical = np.where(typical > 0.0, typical, 1.0)
    return np.where(problem.free, 1.3 * typical, problem.duration)


def short_durations(problem: TimingProblem) -> FloatArray:
    """Durations in which no joint has to stop [s], shape (n-1,).

    They are the middle of the common interval. NaN if no joint has such a limit, or if there is no
    common interval.
    """
    durations = np.full(problem.duration.shape, np.nan)
    known = problem.velocity_known
    for i in np.flatnonzero(known[:-1] & known[1:] & problem.free).tolist():
        first, last, _ = problem.feasible_durations(i)
        if first.max() <= last.min() < np.inf and last.min() >= problem.at_least[i]:
            durations[i] = 0.5 * (first.max() + last.min())
    return durations


def first_velocities(problem: TimingProblem) -> FloatArray:
    """Initial velocities at the waypoints, given or guessed, shape (n, d)."""
    v = np.array(problem.velocity)
    known = problem.velocity_known
    if known.all():
        return v
    still = np.zeros_like(v)
    slope = np.diff(problem.position, axis=0) / first_durations(problem, still)[:, None]
    before, after = np.vstack((slope[:1], slope)), np.vstack((slope, slope[-1:]))
    same = before * after > 0.0
    guess = np.where(same, np.sign(after) * np.minimum(np.abs(before), np.abs(after)), 0.0)
    cap = 0.8 * problem.limits.velocity
    guess = np.clip(guess, -cap, cap)
    for i in np.flatnonzero(~known):
        if not problem.is_direction[i]:
            v[i] = guess[i]
            continue
        direction = v[i]
        length = float(direction @ direction)
        factor = max(float(guess[i] @ direction) / length, 0.0) if length else 0.0
        v[i] = min(factor, float(problem.max_factor[i]), _max_factor(direction, cap)) * direction
    return v


def _max_factor(direction: FloatArray, cap: FloatArray) -> float:
    """Largest factor on a direction with which no joint is faster than its cap."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.min(np.where(direction == 0.0, np.inf, cap / np.abs(direction))))
