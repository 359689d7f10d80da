"""`solve`: durations, velocities and accelerations that minimise an objective under limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from knotwork.errors import TimingError, together
from knotwork.timing.attempts import Attempt
from knotwork.timing.binding import binding_limits
from knotwork.timing.bounds import lower_bound
from knotwork.timing.budget import Budget
from knotwork.timing.exact_curve import in_a_row, rebuilt_row
from knotwork.timing.infeasible import impossible, unsolved
from knotwork.timing.motion import Progress, TimedMotion, status_of
from knotwork.timing.objective_terms import terms
from knotwork.timing.problem import TimingProblem, part_of
from knotwork.timing.windows import solved_windows
from knotwork.trajectory import JointTrajectory


def solve(
    problem: TimingProblem,
    *,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> TimedMotion:
    """Minimise the objective of a problem over its unknowns, within all limits.

    Sections between waypoints with known velocity and acceleration are independent and solved
    separately; a section of more than 24 intervals is solved in windows of 8, each with 4 intervals
    ahead of it. The optimum is local: the solver (IPOPT) starts from at most three plain cubics. If
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

    >>> from knotwork.timing import TimingLimits
    >>> limits = TimingLimits(velocity=[1.0], acceleration=[4.0], jerk=[100.0])
    >>> motion = solve(TimingProblem(("a",), [[0], [1]], [[0], [0]], limits))
    >>> motion.status, motion.lower_bound < motion.duration < 1.3
    ('optimal', True)
    """
    try:
        return solved(problem, Budget(progress, budget, len(problem.position) - 1))
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


def solved(problem: TimingProblem, watch: Budget) -> TimedMotion:
    """Solve one of several problems that share a budget, see `solve`.

    Args:
        problem: The waypoints and the limits.
        watch: Progress and budget of all problems.

    Raises:
        NoMotionError: No motion within the limits was found.
    """
    begun, iterations = watch.now(), watch.iterations
    wrong = impossible(problem)
    if wrong:
        raise NoMotionError(wrong)
    motion = _solved_sections(problem, watch)
    return replace(motion, iterations=watch.iterations - iterations, seconds=watch.now() - begun)


def _solved_sections(problem: TimingProblem, watch: Budget) -> TimedMotion:
    found: list[Attempt] = []
    failed: list[tuple[TimingProblem, int]] = []
    for first, last in sections(problem):
        part = part_of(problem, first, last)
        attempt = solved_windows(part, watch)
        if attempt is not None:
            found.append(attempt)
        elif watch.late(found=False):
            raise NoMotionError([_out_of_time(watch)])
        else:
            failed.append((part, first))
    if failed:
        raise NoMotionError([one for part in failed for one in _causes(*part)])
    return _motion(problem, found)


def _causes(part: TimingProblem, before: int) -> list[TimingError]:
    """Causes of a section without a motion, with waypoints counted from the first of all."""
    found = unsolved(part)
    for one in found:
        if one.waypoint is not None:
            one.waypoint += before
    return found


def _motion(problem: TimingProblem, found: list[Attempt]) -> TimedMotion:
    """Concatenate sections."""
    parts = in_a_row([one.found.knots for one in found])
    curve = rebuilt_row(parts)
    time = np.concatenate(([0.0], *(one.time[1:] for one in parts)))
    velocity = np.concatenate((parts[0].velocity[:1], *(one.velocity[1:] for one in parts)))
    first = parts[0].acceleration[:1, 0]
    acceleration = np.concatenate((first, *(one.acceleration[:, -1] for one in parts)))
    return TimedMotion(
        JointTrajectory(
            problem.joint_names,
            curve,
            joint_units=problem.joint_units,
            planner="fastest",
            waypoint_times=time,
        ),
        time,
        velocity,
        acceleration,
        lower_bound(problem),
        status=status_of(one.status for one in found),
        binding=binding_limits(problem, time, curve),
        objective=terms(problem, curve),
    )


def _out_of_time(watch: Budget) -> TimingError:
    return TimingError(
        "no motion that keeps every limit was found within the budget of "
        f"{watch.budget:g} s; allow more time, or none: then the search goes on to its end",
        limit="budget",
    )


def sections(problem: TimingProblem) -> list[tuple[int, int]]:
    """First and last waypoints of independent sections.

    A motion is divided where position, velocity and acceleration are known, unless its total
    duration is given.
    """
    known = problem.velocity_known & problem.acceleration_known
    known &= problem.total is None
    return list(pairwise([0, *(np.flatnonzero(known[1:-1]) + 1).tolist(), len(known) - 1]))
