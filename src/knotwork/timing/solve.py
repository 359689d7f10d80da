"""`solve`: durations, velocities and accelerations that minimise an objective under limits."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from knotwork.arguments import finite_number
from knotwork.errors import TimingError
from knotwork.timing.attempts import Attempt, solved_section
from knotwork.timing.binding import binding_limits
from knotwork.timing.bounds import lower_bound
from knotwork.timing.costs import terms
from knotwork.timing.explain import explained
from knotwork.timing.feasible import check_feasible
from knotwork.timing.motion import Progress, TimedMotion
from knotwork.timing.problem import TimingProblem, part_of
from knotwork.timing.rebuild import Knots, rebuilt
from knotwork.timing.section import guess_from
from knotwork.timing.watch import Watch
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray


def solve(
    problem: TimingProblem,
    *,
    budget: float | None = None,
    start: TimedMotion | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> TimedMotion:
    """Choose what a problem leaves free, so that its objective is least and every limit is kept.

    Sections between waypoints where velocity and acceleration are both known do not depend on each
    other, and each is solved alone. The optimum is a local one: the solver (IPOPT) starts from
    plain cubics.

    Args:
        problem: What is known, and the limits.
        budget: Time after which the best motion so far is taken [s]; by default it is not limited.
        start: A motion to start from, with as many waypoints.
        progress: Called as the solver goes on.

    Returns:
        A motion that keeps every limit, by the exact extrema of its polynomials.

    Raises:
        TimingError: No motion keeps the limits; it says where and what would be feasible.

    >>> from knotwork.timing import TimingLimits
    >>> limits = TimingLimits(velocity=[1.0], acceleration=[4.0], jerk=[100.0])
    >>> motion = solve(TimingProblem(("a",), [[0], [1]], [[0], [0]], limits))
    >>> motion.status, motion.lower_bound < motion.duration < 1.3
    ('optimal', True)
    """
    watch = Watch(progress)
    if budget is not None:
        watch.deadline = watch.begun + finite_number(budget, "budget", "s", positive=True)
    check_feasible(problem)
    found: list[Attempt] = []
    for first, last in sections(problem):
        part = part_of(problem, first, last)
        attempt = solved_section(
            part, watch, None if start is None else guess_from(start, first, last)
        )
        if attempt is None:
            raise _failure(part, watch, budget)
        found.append(attempt)
        watch.done = last / (len(problem.position) - 1)
    return _motion(problem, found, watch)


def _motion(problem: TimingProblem, found: list[Attempt], watch: Watch) -> TimedMotion:
    """Put sections together."""
    knots = _joined([one.found.knots for one in found])
    curve = rebuilt(knots)
    return TimedMotion(
        JointTrajectory(
            problem.joint_names,
            curve,
            joint_units=problem.joint_units,
            planner="fastest",
            waypoint_times=knots.time,
        ),
        knots.time,
        knots.velocity,
        np.concatenate((knots.acceleration[:, 0], knots.acceleration[-1:, -1])),
        lower_bound(problem),
        status="optimal" if all(one.optimal for one in found) else "stopped",
        binding=binding_limits(problem, knots.time, curve),
        objective=MappingProxyType(terms(problem, curve)),
        iterations=watch.iterations,
        seconds=clock.perf_counter() - watch.begun,
    )


def _failure(problem: TimingProblem, watch: Watch, budget: float | None) -> TimingError:
    if watch.late():
        return TimingError(
            f"no motion that keeps every limit was found in the {budget:g} s given; allow more time"
        )
    return explained(problem)


def sections(problem: TimingProblem) -> list[tuple[int, int]]:
    """First and last waypoints of what can be solved alone.

    A motion is divided where position, velocity and acceleration are known, unless its total
    duration ties its intervals together.
    """
    known = problem.velocity_known & problem.acceleration_known
    known &= problem.total is None
    return list(pairwise([0, *(np.flatnonzero(known[1:-1]) + 1).tolist(), len(known) - 1]))


def _joined(parts: list[Knots]) -> Knots:
    """Put sections one after another; where they meet they agree."""
    if len(parts) == 1:
        return parts[0]
    durations = np.concatenate([np.diff(one.time) for one in parts])

    def points(name: str) -> FloatArray:
        arrays = [getattr(one, name) for one in parts]
        return np.concatenate([*(array[:-1] for array in arrays[:-1]), arrays[-1]])

    return Knots(
        np.concatenate(([0.0], np.cumsum(durations))),
        np.concatenate([one.share for one in parts]),
        points("position"),
        points("velocity"),
        np.concatenate([one.acceleration for one in parts]),
    )
