"""Progress of a solution, and its time budget."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from knotwork.errors.arguments import require_number
from knotwork.planning.timing.timed_motion import Progress


@dataclass(eq=False)
class Budget:
    """Progress and time budget of a solution over all its parts.

    Attributes:
        progress: Called after each run of the solver, or `None`.
        seconds: Time for all parts [s], or `None`.
        work: Number of intervals of all parts.
        now: The clock [s].
        begun: Start of the solution by this clock [s].
        iterations: Number of steps so far.
        solved: Number of intervals of solved parts.

    Raises:
        InputError: The budget is not positive.
    """

    progress: Callable[[Progress], None] | None = None
    seconds: float | None = None
    work: int = 1
    now: Callable[[], float] = clock.perf_counter
    iterations: int = 0
    solved: int = 0
    begun: float = field(init=False)

    def __post_init__(self) -> None:
        if self.seconds is not None:
            self.seconds = require_number(self.seconds, "budget", "s", positive=True)
        self.begun = self.now()

    def remaining(self) -> float:
        """Remaining time [s]; infinite without a budget."""
        return np.inf if self.seconds is None else self.begun + self.seconds - self.now()

    @property
    def is_over(self) -> bool:
        """Whether the time has ended."""
        return self.remaining() <= 0.0

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
