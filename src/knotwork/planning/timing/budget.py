"""Progress of a solution, and its time budget, shared among its parts."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from knotwork.errors.arguments import finite_number
from knotwork.planning.timing.timed_motion import Progress


@dataclass(eq=False)
class Budget:
    """Progress and time budget of a solution over all its parts.

    When the share of a part has ended, the part stops as soon as it has a motion. Without a motion
    it continues until the whole budget has ended.

    Raises:
        InputError: The budget is not positive.

    Attributes:
        progress: Called after each run of the solver, or `None`.
        seconds: Time for all parts [s], or `None`.
        work: Number of intervals of all parts.
        now: The clock [s].
        begun: Start of the solution by this clock [s].
        iterations: Number of steps so far.
        solved: Number of intervals of solved parts.
    """

    progress: Callable[[Progress], None] | None = None
    seconds: float | None = None
    work: int = 1
    now: Callable[[], float] = clock.perf_counter
    iterations: int = 0
    solved: int = 0
    begun: float = field(init=False)
    _turn: float = field(init=False, default=np.inf)

    def __post_init__(self) -> None:
        if self.seconds is not None:
            self.seconds = finite_number(self.seconds, "budget", "s", positive=True)
        self.begun = self.now()

    def remaining(self, *, has_motion: bool = False) -> float:
        """Remaining time [s]: of the share if there is a motion, otherwise of the whole budget.

        Args:
            has_motion: Whether there is a motion.
        """
        if self.seconds is None:
            return np.inf
        end = self.begun + self.seconds
        return (min(end, self._turn) if has_motion else end) - self.now()

    @contextmanager
    def part(self, intervals: int) -> Iterator[None]:
        """Give a part its share of the remaining budget, by its intervals."""
        before = self._turn
        if self.seconds is not None:
            self._turn = self.now() + self.remaining() * intervals / max(
                self.work - self.solved, intervals
            )
        yield
        self._turn = before
        self.solved += intervals

    def late(self, *, has_motion: bool) -> bool:
        """Whether to stop: the budget has ended, or the share has ended and there is a motion.

        Args:
            has_motion: Whether there is a motion.
        """
        return self.remaining(has_motion=has_motion) < 0.0

    def step(
        self,
        count: int = 1,
        duration: float | None = None,
        trying: str = "",
        part: float = 0.0,
    ) -> None:
        """Count steps and report them; other arguments as the attributes of `Progress`.

        `part` is the finished fraction of the current interval.
        """
        self.iterations += count
        if self.progress is not None:
            seconds, done = self.now() - self.begun, min((self.solved + part) / self.work, 1.0)
            self.progress(Progress(self.iterations, seconds, done, duration, trying))
