"""`solve`: durations, velocities and accelerations that minimise an objective under limits."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from knotwork.errors import TimingError
from knotwork.timing.binding import binding_limits
from knotwork.timing.bounds import lower_bound
from knotwork.timing.motion import Progress, TimedMotion
from knotwork.timing.problem import TimingProblem
from knotwork.timing.rebuild import Knots, rebuilt
from knotwork.timing.section import MARGIN, Found, Section, excess, plain_guess
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

STARTS = (1.0, 2.0, 0.7, 4.0, 1.4)
"""Factors of the first durations that are tried until one leads to a solution."""

WIDEST_MARGIN = 1e-3
"""If limits are exceeded with this margin, too, there is no answer."""


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
    begun = clock.perf_counter()
    found = [_solved(part) for part in sections(problem)]
    knots = _joined([one.knots for one in found])
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
        binding=binding_limits(problem, knots.time, curve),
        objective=MappingProxyType({"time": float(knots.time[-1])}),
        iterations=sum(one.solution.iterations for one in found),
        seconds=clock.perf_counter() - begun,
    )


def sections(problem: TimingProblem) -> Iterator[TimingProblem]:
    """Divide a problem where position, velocity and acceleration are known."""
    known = problem.velocity_known & problem.acceleration_known
    cuts = [0, *(np.flatnonzero(known[1:-1]) + 1).tolist(), len(known) - 1]
    if problem.total is not None or len(cuts) == 2:
        yield problem
        return
    for first, last in pairwise(cuts):
        yield part_of(problem, first, last)


def part_of(problem: TimingProblem, first: int, last: int) -> TimingProblem:
    """The same problem from one waypoint to another."""
    points, between = slice(first, last + 1), slice(first, last)
    return replace(
        problem,
        **{
            name: getattr(problem, name)[points]
            for name in ("position", "velocity", "names", "along", "most", "acceleration")
        },
        **{name: getattr(problem, name)[between] for name in ("duration", "at_least")},
    )


def _solved(problem: TimingProblem) -> Found:
    for stretch in STARTS:
        section = Section(problem, plain_guess(problem, stretch))
        solution = section.solve()
        margin, position = MARGIN, False
        while solution.solved:
            found = section.rebuild(solution)
            over = excess(problem, found.curve)
            if not over:
                return found
            if "position" in over and not position:
                position = True
            elif margin < WIDEST_MARGIN:
                margin *= 10.0
            else:
                break
            section = Section(problem, section.guess, margin=margin, position=position)
            solution = section.solve(solution.x)
    raise TimingError("no durations keep all limits")


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
