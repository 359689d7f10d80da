"""Solution of long motions window by window, in linear time.

The influence of a waypoint decays with distance: a disturbance of the C2 curve shrinks about
twelvefold per waypoint. So each window is solved with some intervals ahead of it, whose solution
is discarded, and the next window starts from the state that is kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knotwork.planning.timing.attempts import Attempt, resting, solved_section
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.exact_curve import concatenate_knots
from knotwork.planning.timing.motion import status_of
from knotwork.planning.timing.objective_terms import objective_value
from knotwork.planning.timing.problem import TimingProblem, part_of

KEPT = 8
"""Intervals of each window that are kept."""

AHEAD = 4
"""Additional intervals ahead that are solved with them."""

LONGEST = 24
"""Maximum number of intervals of a motion that is solved at once."""


def solved_windows(problem: TimingProblem, budget: Budget) -> Attempt | None:
    """Solve a section, window by window if it is long.

    Args:
        problem: The section.
        budget: Progress and budget.

    Returns:
        The motion, or `None` if there is none.
    """
    last = len(problem.position) - 1
    if last <= LONGEST or problem.total is not None:
        with budget.part(last):
            return solved_section(problem, budget)
    velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
    along = np.array(problem.along)
    kept: list[Attempt] = []
    first = 0
    while first < last:
        end = last if last - first <= KEPT + 2 * AHEAD else first + KEPT + AHEAD
        given = replace(problem, velocity=velocity, acceleration=acceleration, along=along)
        count = end - first if end == last else KEPT
        with budget.part(count):
            found = solved_section(part_of(given, first, end), budget)
        if found is None:
            # the start state may be the reason
            budget.solved -= first + count
            with budget.part(last):
                return solved_section(problem, budget)
        kept.append(replace(found, knots=found.knots.first_intervals(count)))
        knots = kept[-1].knots
        first += count
        velocity[first], along[first] = knots.velocity[-1], False
        acceleration[first] = knots.acceleration[-1, -1]
    knots = concatenate_knots([attempt.knots for attempt in kept])
    status = status_of(attempt.status for attempt in kept)
    found = Attempt(knots, status)
    # one motion with rests may be far faster than its parts
    rests = resting(problem, status) if status != "optimal" else None
    if rests is None:
        return found
    return min((found, rests), key=lambda attempt: objective_value(problem, attempt.knots.curve))
