"""Progress reported, and the budget shared among the parts of a solution."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from knotwork.errors.arguments import finite_number
from knotwork.timing.motion import Progress


@dataclass(eq=False)
class Watch:
    """Follows a solution over all its parts, and shares the budget among them.

    A part whose turn is over stops as soon as it has a motion; without one it goes on until the
    whole budget has ended.

    Raises:
        InputError: The budget is not positive.

    Attributes:
        progress: Called after each run of the solver, or `None`.
        budget: Time that there is for all parts [s], or `None`.
        work: Intervals of all parts together.
        now: The clock [s].
        begun: When the solution began, by this clock.
        iterations: Steps so far.
        solved: Intervals of the parts that are solved.
    """

    progress: Callable[[Progress], None] | None = None
    budget: float | None = None
    work: int = 1
    now: Callable[[], float] = clock.perf_counter
    iterations: int = 0
    solved: int = 0
    begun: float = field(init=False)
    _turn: float = field(init=False, default=np.inf)

    def __post_init__(self) -> None:
        if self.budget is not None:
            self.budget = finite_number(self.budget, "budget", "s", positive=True)
        self.begun = self.now()

    def left(self, *, found: bool = False) -> float:
        """Time left [s]: of the turn if there is a motion, else of the whole; or infinite.

        Args:
            found: Whether there is a motion.
        """
        if self.budget is None:
            return np.inf
        end = self.begun + self.budget
        return (min(end, self._turn) if found else end) - self.now()

    @contextmanager
    def part(self, intervals: int) -> Iterator[None]:
        """Give a part its turn: the budget left, shared by the intervals left."""
        before = self._turn
        if self.budget is not None:
            self._turn = self.now() + self.left() * intervals / max(
                self.work - self.solved, intervals
            )
        yield
        self._turn = before
        self.solved += intervals

    def late(self, *, found: bool) -> bool:
        """Whether to stop: the budget has ended, or the turn has and a motion was found.

        Args:
            found: Whether there is a motion.
        """
        return self.left(found=found) < 0.0

    def step(
        self,
        count: int = 1,
        duration: float | None = None,
        trying: str = "",
        part: float = 0.0,
    ) -> None:
        """Count steps and report them; other arguments as the attributes of `Progress`.

        `part` is done of the interval at hand, from 0 to 1.
        """
        self.iterations += count
        if self.progress is not None:
            seconds, done = self.now() - self.begun, min((self.solved + part) / self.work, 1.0)
            self.progress(Progress(self.iterations, seconds, done, duration, trying))
