"""The search for what would do where no motion was found: changed problems, solved one by one."""

from __future__ import annotations

from dataclasses import dataclass

from knotwork.timing.attempts import Attempt, solved_section
from knotwork.timing.problem import TimingProblem
from knotwork.timing.watch import Watch

PATIENCE = 200_000
"""Steps of the solver times waypoints times joints that the search for a cause may take, about."""

EFFORT_WORK = 8
"""A step with dynamics takes about so many times as long as one without."""

ROOMS = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3)
"""Room given to a change, relative to it, until the solver finds a motion with just that change."""


class OutOfStepsError(Exception):
    """The search for a cause takes too long."""


@dataclass
class Search:
    """Solves changed problems until its patience ends: by steps, so that errors do not vary."""

    work: int = 0

    def solved(self, problem: TimingProblem) -> Attempt | None:
        """A motion that keeps every limit, or `None` where none was found.

        Raises:
            OutOfStepsError: Too many steps were taken before.
        """
        if self.work > PATIENCE:
            raise OutOfStepsError
        watch = Watch()
        found = solved_section(problem, watch, starts=1)
        size = problem.position.size * (EFFORT_WORK if problem.dynamics is not None else 1)
        self.work += watch.iterations * size
        return found
