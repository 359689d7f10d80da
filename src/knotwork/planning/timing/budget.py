"""Computing time and progress of the solution of one or several timing problems."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from knotwork.errors.arguments import require_number
from knotwork.errors.old_names import OldAttribute


@dataclass(frozen=True)
class Progress:
    """Progress of a solution.

    Attributes:
        iterations: Number of solver steps so far.
        seconds: Time since the start [s].
        fraction: Fraction of the intervals solved so far, 0 to 1. A running search for a
            collision-free motion counts as a part of its interval.
        duration: Duration of the best motion of that search [s], finally of the whole motion;
            `None` before there is one.
        trying: Current step of that search, for example `"way 2 of 6"`; finally `"check"`;
            otherwise empty.
    """

    iterations: int
    seconds: float
    fraction: float
    duration: float | None = None
    trying: str = ""
    done = OldAttribute("fraction")


class Budget:
    """Computing time and progress, which all problems of a plan share. It begins when it is made.

    Args:
        progress: Called with the progress after each run of the solver, or `None`.
        seconds: Time for all problems [s], or `None`.
        intervals: Number of intervals of all problems.
        now: The clock [s].

    Attributes:
        seconds: Time for all problems [s], infinite without a limit.
        iterations: Number of solver steps so far.

    Raises:
        InputError: The time is not positive.
    """

    def __init__(
        self,
        progress: Callable[[Progress], None] | None = None,
        seconds: float | None = None,
        intervals: int = 1,
        now: Callable[[], float] = clock.perf_counter,
    ) -> None:
        limited = seconds is not None
        self.seconds = require_number(seconds, "budget", "s", positive=True) if limited else np.inf
        self.iterations = 0
        self._progress = progress
        self._now = now
        self._begun = now()
        self.set_intervals(intervals)

    @property
    def elapsed(self) -> float:
        """Time since the beginning [s]."""
        return self._now() - self._begun

    @property
    def remaining(self) -> float:
        """Remaining time [s], infinite without a limit."""
        return self.seconds - self.elapsed

    @property
    def has_ended(self) -> bool:
        """Whether no time remains."""
        return self.remaining <= 0.0

    def set_intervals(self, intervals: int) -> None:
        """Set the number of intervals of all problems, and that of solved ones to 0."""
        self._intervals = intervals
        self._solved = 0

    def count_solved(self, intervals: int) -> None:
        """Add to the number of solved intervals."""
        self._solved += intervals

    def finish_all(self, duration: float) -> None:
        """Report that all intervals are solved, and that the motion is checked next.

        Args:
            duration: Duration of the motion [s].
        """
        self._solved = self._intervals
        self.report(0, duration, "check")

    def report(
        self, count: int = 1, duration: float | None = None, trying: str = "", share: float = 0.0
    ) -> None:
        """Add solver steps to the count, and report the progress; see `Progress` for the arguments.

        `share` is the finished fraction of the current interval.
        """
        self.iterations += count
        if self._progress is not None:
            # without intervals only speeds along paths are unknown
            done = min((self._solved + share) / self._intervals, 1.0) if self._intervals else 1.0
            self._progress(Progress(self.iterations, self.elapsed, done, duration, trying))
