"""`solve`: durations, velocities and accelerations that minimise an objective under limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from knotwork.errors import TimingError, together
from knotwork.planning.timing.attempts import Attempt
from knotwork.planning.timing.binding import binding_limits
from knotwork.planning.timing.bounds import lower_bound
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.exact_curve import concatenate_curves
from knotwork.planning.timing.infeasible import infeasible_values, unsolved_errors
from knotwork.planning.timing.objective_terms import terms
from knotwork.planning.timing.timed_motion import Progress, Status, TimedMotion, status_of
from knotwork.planning.timing.timing_problem import TimingProblem, part_of
from knotwork.planning.timing.windows import solve_windows
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray


def solve(
    problem: TimingProblem,
    *,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> TimedMotion:
    """Minimise the objective of a problem over its unknowns, within all limits.

    Sections between waypoints with known velocity and acceleration are independent and solved
    separately; a section of more than 24 intervals is solved in windows of 8, each with 4 intervals
    ahead of it. The optimum is local: the solver (IPOPT) starts from one or two plain cubics. If
    none converges, the arm comes to rest in each interval.

    Args:
        problem: The waypoints and the limits.
        budget: Time after which the best motion so far is returned [s]; by default unlimited.
        progress: Called with the progress of the solver.

    Returns:
        A motion that keeps every limit, by the exact extrema of its polynomials.

    Raises:
        TimingError: No motion within the limits was found; the error has the place and sufficient
            values.

    >>> from knotwork.planning.timing import TimingLimits
    >>> limits = TimingLimits(velocity=[1.0], acceleration=[4.0], jerk=[100.0])
    >>> motion = solve(TimingProblem(("a",), [[0], [1]], [[0], [0]], limits))
    >>> motion.status, motion.lower_bound < motion.duration < 1.3
    ('optimal', True)
    """
    try:
        return solve_within(problem, Budget(progress, budget, len(problem.position) - 1))
    except NoMotionError as error:
        raise together(error.causes) from None


class NoMotionError(Exception):
    """No motion within the limits was found.

    Attributes:
        causes: Possible causes with their places, at least one.
    """

    def __init__(self, causes: Sequence[TimingError]) -> None:
        super().__init__()
        self.causes = list(causes)


def solve_within(problem: TimingProblem, budget: Budget) -> TimedMotion:
    """Solve one of several problems that share a budget, see `solve`.

    Args:
        problem: The waypoints and the limits.
        budget: Progress and budget of all problems.

    Raises:
        NoMotionError: No motion within the limits was found.
    """
    iterations = budget.iterations
    wrong = infeasible_values(problem)
    if wrong:
        raise NoMotionError(wrong)
    motion = _solved_sections(problem, budget)
    return replace(motion, iterations=budget.iterations - iterations)


def _solved_sections(problem: TimingProblem, budget: Budget) -> TimedMotion:
    attempts: list[Attempt] = []
    causes: list[TimingError] = []
    for start, end in sections(problem):
        section = part_of(problem, start, end)
        attempt = solve_windows(section, budget)
        if attempt is not None:
            attempts.append(attempt)
        elif budget.late(has_motion=False):
            message = (
                "no motion that keeps every limit was found within the budget of "
                f"{budget.seconds:g} s; allow more time, or none, for a search to its end"
            )
            raise NoMotionError([TimingError(message, limit="budget")])
        else:
            for error in unsolved_errors(section):
                if error.waypoint is not None:
                    error.waypoint += start
                causes.append(error)
    if causes:
        raise NoMotionError(causes)
    parts = [attempt.knots for attempt in attempts]
    time, curve = concatenate_curves(parts)
    velocity = np.concatenate((parts[0].velocity[:1], *(part.velocity[1:] for part in parts)))
    first = parts[0].acceleration[:1, 0]
    acceleration = np.concatenate((first, *(part.acceleration[:, -1] for part in parts)))
    status, least = status_of(attempt.status for attempt in attempts), lower_bound(problem)
    return timed_motion(problem, curve, time, velocity, acceleration, status, least, "fastest")


def timed_motion(
    problem: TimingProblem,
    curve: PiecewisePolynomial,
    time: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    status: Status,
    least: float,
    planner: str,
) -> TimedMotion:
    """The motion of a curve that keeps the limits of a problem; see `TimedMotion`.

    Args:
        problem: The waypoints and the limits.
        curve: Joint positions from time 0 on.
        time: Times of the waypoints [s], shape (n,).
        velocity: Velocities there, shape (n, d).
        acceleration: Accelerations there, shape (n, d).
        status: Status.
        least: Lower bound on the duration [s].
        planner: Name of the planner.
    """
    trajectory = JointTrajectory(
        problem.joint_names,
        curve,
        joint_units=problem.joint_units,
        planner=planner,
        waypoint_times=time,
    )
    binding, objective = binding_limits(problem, time, curve), terms(problem, curve)
    return TimedMotion(trajectory, time, velocity, acceleration, least, status, binding, objective)


def sections(problem: TimingProblem) -> list[tuple[int, int]]:
    """First and last waypoints of independent sections.

    A motion is divided where position, velocity and acceleration are known, unless its total
    duration is given.
    """
    known = problem.velocity_known & problem.acceleration_known
    known &= problem.total is None
    return list(pairwise([0, *(np.flatnonzero(known[1:-1]) + 1).tolist(), len(known) - 1]))
