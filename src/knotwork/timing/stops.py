"""Motions with stops, solved from stop to stop where that is better than all at once.

At a stop the acceleration may be chosen. With limits of effort that is worth less than what more
pieces in each interval gain, which only short sections have.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from knotwork.timing.attempts import Attempt, solved_section
from knotwork.timing.holding import too_heavy
from knotwork.timing.problem import TimingProblem, part_of
from knotwork.timing.section import part_guess
from knotwork.timing.watch import Watch


def better_parts(problem: TimingProblem, watch: Watch, whole: Attempt) -> list[Attempt]:
    """The parts between stops, each solved alone, or the whole motion where that costs less.

    Args:
        problem: A section.
        watch: What the steps are told to.
        whole: The motion that was found for it.
    """
    stops = problem.velocity_known & (problem.velocity == 0.0).all(axis=1)
    stops[[0, -1]] = True
    tied = problem.total is not None or problem.objective.peaks
    if whole.care.effort is None or tied or stops.sum() <= 2:
        return [whole]
    acceleration = np.array(problem.acceleration)
    acceleration[1:-1][stops[1:-1]] = 0.0
    still = replace(problem, acceleration=acceleration)
    if too_heavy(still, certain=True):
        return [whole]
    parts: list[Attempt] = []
    for first, last in pairwise(np.flatnonzero(stops).tolist()):
        if watch.late(found=True):
            return [whole]
        guess = part_guess(whole.found, first, last)
        part = solved_section(part_of(still, first, last), watch, guess, starts=1)
        if part is None:
            return [whole]
        parts.append(part)
    return parts if sum(one.cost for one in parts) < whole.cost else [whole]
