"""Long motions solved window by window, so that the time it takes grows linearly.

What happens at a waypoint matters less and less to those farther away: a disturbance of the C2
curve shrinks some twelve times a waypoint. So each window is solved with some intervals ahead of
it, whose solution is thrown away, and the next window starts from the state that is kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knotwork.timing.attempts import Attempt, resting, solved_section
from knotwork.timing.budget import Watch
from knotwork.timing.exact_curve import ExactCurve, Knots, joined, rebuilt
from knotwork.timing.motion import status_of
from knotwork.timing.objective_terms import terms, weighted
from knotwork.timing.problem import TimingProblem, part_of

KEPT = 8
"""Intervals of each window that are kept."""

AHEAD = 4
"""Intervals after these that are solved with them."""

LONGEST = 24
"""Motions of up to as many intervals are solved at once."""


def solved_windows(problem: TimingProblem, watch: Watch) -> Attempt | None:
    """Solve a section, window by window if it is long.

    Args:
        problem: The section.
        watch: Follows the steps and holds the budget.

    Returns:
        The motion, or `None` if there is none.
    """
    last = len(problem.position) - 1
    if last <= LONGEST or problem.total is not None:
        with watch.part(last):
            return solved_section(problem, watch)
    velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
    along = np.array(problem.along)
    kept: list[Attempt] = []
    first = 0
    while first < last:
        end = last if last - first <= KEPT + 2 * AHEAD else first + KEPT + AHEAD
        given = replace(problem, velocity=velocity, acceleration=acceleration, along=along)
        count = end - first if end == last else KEPT
        with watch.part(count):
            found = solved_section(part_of(given, first, end), watch)
        if found is None:
            # the state it starts from may be the reason
            watch.solved -= first + count
            with watch.part(last):
                return solved_section(problem, watch)
        kept.append(replace(found, found=_first_part(found.found, count)))
        knots = kept[-1].found.knots
        first += count
        velocity[first], along[first] = knots.velocity[-1], False
        acceleration[first] = knots.acceleration[-1, -1]
    knots = joined([one.found.knots for one in kept])
    curve = rebuilt(knots)
    status = status_of(one.status for one in kept)
    found = Attempt(ExactCurve(knots, curve), status)
    # parts that rest may be far slower than one motion that does
    rests = resting(problem, status) if status != "optimal" else None
    if rests is None:
        return found
    return min((found, rests), key=lambda one: weighted(problem, terms(problem, one.found.curve)))


def _first_part(found: ExactCurve, count: int) -> ExactCurve:
    knots = found.knots
    part = Knots(
        knots.time[: count + 1],
        knots.share[:count],
        knots.position[: count + 1],
        knots.velocity[: count + 1],
        knots.acceleration[:count],
    )
    return ExactCurve(part, found.curve)
