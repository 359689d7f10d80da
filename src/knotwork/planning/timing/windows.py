"""Solution of long motions window by window, in linear time.

The influence of a waypoint decays with distance: a disturbance of the C2 curve shrinks about
twelvefold per waypoint. So each window is solved with some intervals ahead of it, whose solution
is discarded, and the next window starts from the state that is kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knotwork.planning.timing.attempts import Attempt, resting_motion, solve_section
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.exact_curve import concatenate_knots
from knotwork.planning.timing.objective_terms import objective_value
from knotwork.planning.timing.timed_motion import status_of
from knotwork.planning.timing.timing_problem import TimingProblem, part_of

WINDOW_INTERVALS = 8
"""Intervals of each window that are kept."""

INTERVALS_AHEAD = 4
"""Additional intervals ahead that are solved with them."""

MAX_INTERVALS = 24
"""Maximum number of intervals of a motion that is solved at once."""


def solve_windows(problem: TimingProblem, budget: Budget) -> Attempt | None:
    """Solve a section, window by window if it is long.

    Args:
        problem: The section.
        budget: Progress and budget.

    Returns:
        The motion, or `None` if there is none.
    """
    last = len(problem.position) - 1
    if last <= MAX_INTERVALS or problem.total is not None:
        with budget.part(last):
            return solve_section(problem, budget)
    velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
    along = np.array(problem.along)
    windows: list[Attempt] = []
    first = 0
    while first < last:
        end = (
            last
            if last - first <= WINDOW_INTERVALS + 2 * INTERVALS_AHEAD
            else first + WINDOW_INTERVALS + INTERVALS_AHEAD
        )
        start_known = replace(problem, velocity=velocity, acceleration=acceleration, along=along)
        count = end - first if end == last else WINDOW_INTERVALS
        with budget.part(count):
            attempt = solve_section(part_of(start_known, first, end), budget)
        if attempt is None:
            # the start state may be the reason
            budget.solved -= first + count
            with budget.part(last):
                return solve_section(problem, budget)
        windows.append(replace(attempt, knots=attempt.knots.first_intervals(count)))
        knots = windows[-1].knots
        first += count
        velocity[first], along[first] = knots.velocity[-1], False
        acceleration[first] = knots.acceleration[-1, -1]
    knots = concatenate_knots([attempt.knots for attempt in windows])
    status = status_of(attempt.status for attempt in windows)
    attempt = Attempt(knots, status)
    # one motion with rests may be far faster than its parts
    rests = resting_motion(problem, status) if status != "optimal" else None
    if rests is None:
        return attempt
    return min((attempt, rests), key=lambda attempt: objective_value(problem, attempt.knots.curve))
