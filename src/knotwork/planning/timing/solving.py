"""`solve`: durations, velocities and accelerations that minimise an objective under limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import TimingError, merge_errors
from knotwork.planning.timing.budget import Budget, Progress
from knotwork.planning.timing.infeasible import infeasible_values, unsolved_errors
from knotwork.planning.timing.minimum_durations import lower_bound
from knotwork.planning.timing.motion_curves import concatenate
from knotwork.planning.timing.section_motion import TimedCurve, solve_at_once
from knotwork.planning.timing.state_limits import LimitedQuantity, limits_of
from knotwork.planning.timing.timed_motion import ActiveLimit, TimedMotion, worst_status
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.verification import metrics

WINDOW_INTERVALS = 8
"""Number of intervals of each window that are kept."""
INTERVALS_AHEAD = 4
"""Number of following intervals that are solved with them."""
MAX_INTERVALS = 24
"""Maximum number of intervals of a motion that is solved as a whole."""
LIMIT_SAMPLES = 100
"""Number of samples in each interval."""
ACTIVE_LIMIT_DISTANCE = 1e-3
"""Relative distance within which a joint is at a limit."""
MIN_ACTIVE_SHARE = 0.02
"""Minimum fraction of an interval in which a limit is active to be reported, if there are other
ones.
"""
TOUCH_DISTANCE = 0.02
"""Relative distance within which a limit counts as touched."""


def solve(
    problem: TimingProblem,
    *,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> TimedMotion:
    """Minimise the objective of a problem over its free values, within all limits.

    A long motion is solved in windows, each with a few of the following intervals.
    The optimum is local: the solver (IPOPT) starts from plain cubics. If it does not converge, the
    arm comes to rest in each interval.

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
    motion = solve_windows(problem, budget)
    if motion is None and budget.time_limit.is_over:
        message = (
            "no motion that keeps every limit was found within the budget of "
            f"{budget.time_limit.seconds:g} s; accepted: a larger budget, or none for no limit of "
            "time"
        )
        raise TimingError(message, cause="budget")
    if motion is None:
        raise merge_errors(unsolved_errors(problem))
    timed = timed_motion(problem, motion, lower_bound(problem), "fastest")
    return replace(timed, iterations=budget.iterations - earlier_iterations)


def _consecutive(motions: Sequence[TimedCurve]) -> TimedCurve:
    """Consecutive motions, each from time 0 on, as one."""
    starts = np.cumsum([0.0, *(motion.time[-1] for motion in motions)])
    times = [start + motion.time[:-1] for start, motion in zip(starts, motions, strict=False)]
    return TimedCurve(
        np.append(np.concatenate(times), starts[-1]),
        concatenate(*(motion.curve for motion in motions)),
        worst_status(motion.status for motion in motions),
    )


def timed_motion(
    problem: TimingProblem, motion: TimedCurve, bound: float, origin: str
) -> TimedMotion:
    """A motion that keeps the limits of a problem, with its figures; see `TimedMotion`.

    Args:
        problem: The waypoints and the limits.
        motion: The motion.
        bound: Lower bound on the duration [s].
        origin: Source of the motion, see `JointTrajectory`.
    """
    time, curve = motion.time, motion.curve
    trajectory = JointTrajectory(
        problem.joint_names,
        curve,
        joint_units=problem.joint_units,
        origin=origin,
        waypoint_times=time,
    )
    return TimedMotion(
        trajectory,
        time=time,
        velocity=np.where(problem.velocity_known[:, None], problem.velocity, curve(time, 1)),
        lower_bound=bound,
        status=motion.status,
        active_limits=find_active_limits(problem, time, curve),
        objective_values=_terms(problem, trajectory),
    )


def solve_windows(problem: TimingProblem, budget: Budget) -> TimedCurve | None:
    """Solve a section, window by window if it is long.

    Args:
        problem: The section.
        budget: Progress and budget.

    Returns:
        The motion, or `None` if there is none.
    """
    last = len(problem.position) - 1
    if last <= MAX_INTERVALS or problem.total is not None:
        motion = solve_at_once(problem, budget)
        budget.finish(last)
        return motion
    windows: list[TimedCurve] = []
    start_known = problem
    first = 0
    while first < last:
        is_last = last - first <= WINDOW_INTERVALS + 2 * INTERVALS_AHEAD
        end = last if is_last else first + WINDOW_INTERVALS + INTERVALS_AHEAD
        count = end - first if is_last else WINDOW_INTERVALS
        motion = solve_at_once(start_known.between(first, end), budget)
        if motion is None or motion.status == "resting":  # the start state may be the reason
            budget.finish(last - first)
            return solve_at_once(problem, budget)
        budget.finish(count)
        first += count
        seam = motion.time[count]
        start_known = start_known.with_state(first, motion.curve(seam, 1), motion.curve(seam, 2))
        windows.append(_first_intervals(motion, count))
    return _consecutive(windows)


def _first_intervals(motion: TimedCurve, count: int) -> TimedCurve:
    """The first intervals of a motion."""
    time, curve = motion.time[: count + 1], motion.curve
    pieces = int(np.searchsorted(curve.x, time[-1]))
    first = PiecewisePolynomial(curve.c[:, :pieces], curve.x[: pieces + 1])
    return TimedCurve(time, first, motion.status)


def _terms(problem: TimingProblem, motion: JointTrajectory) -> dict[str, float]:
    """Unweighted values by name: the time, and the other terms with a weight.

    The integrals run over the motion and are summed over the joints.
    """
    values, objective = {"time": motion.duration}, problem.objective
    if objective.jerk:
        values["jerk"] = metrics.integral_of_square(motion, 3)
    if objective.acceleration:
        values["acceleration"] = metrics.integral_of_square(motion, 2)
    if objective.effort:
        values["effort"] = metrics.squared_effort(problem.required_dynamics.robot, motion)
    return values


def find_active_limits(
    problem: TimingProblem, time: FloatArray, curve: PiecewisePolynomial
) -> tuple[ActiveLimit, ...]:
    """Find the active limits of each interval, those that are active longest first.

    Args:
        problem: The waypoints and the limits.
        time: Times of the waypoints [s], shape (n,).
        curve: Joint positions.
    """
    fractions = (np.arange(LIMIT_SAMPLES) + 0.5) / LIMIT_SAMPLES
    times = time[:-1, None] + fractions * np.diff(time)[:, None]
    limits = problem.limits
    q = curve(times)
    width = limits.upper - limits.lower
    slack = np.where(np.isfinite(width), ACTIVE_LIMIT_DISTANCE * width, 0.0)
    at_end = (q <= limits.lower + slack) | (q >= limits.upper - slack)
    of_states = limits_of(problem)
    utilisation = of_states.utilisation(curve, times)
    utilisation = np.concatenate((utilisation, at_end), axis=-1)
    quantities = of_states.quantities
    quantities += [LimitedQuantity(joint, "position") for joint in problem.joint_names]
    peaks = utilisation.max(axis=1)
    shares = np.mean(utilisation >= 1.0 - ACTIVE_LIMIT_DISTANCE, axis=1)
    active: list[ActiveLimit] = []
    for i, (start, end) in enumerate(pairwise(problem.names)):
        longest_first = np.argsort(-shares[i], kind="stable")
        at_limit = longest_first[shares[i, longest_first] >= MIN_ACTIVE_SHARE]
        if not at_limit.size and (problem.free[i] or problem.total is not None):
            at_limit = peaks[i].argmax(keepdims=True)
            at_limit = at_limit[peaks[i, at_limit] >= 1.0 - TOUCH_DISTANCE]
        for k in at_limit.tolist():
            share = round(float(shares[i, k]), 2)
            limited = quantities[k]
            active.append(ActiveLimit(start, end, limited.subject, limited.quantity, share))
    return tuple(active)
