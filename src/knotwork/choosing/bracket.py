"""`Bracket`: between which two speeds the greatest one along a stretch of a path is sought."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

FIRST_STEP = 1.05
"""The first of the speeds that are tried one after another, until some do and some do not."""

STEP = 1.5
"""The last of them differ by this factor."""

SLOWEST = 1e-3
"""No speed below this is tried [m/s]."""


@dataclass
class Bracket:
    """Between which speeds the greatest of one stretch is sought.

    Attributes:
        low: The greatest that did [m/s]; 0 if none has.
        high: The least that did not [m/s].
        step: The factor by which the next is greater or less, where it lies beyond both.
    """

    low: float = 0.0
    high: float = math.inf
    step: float = FIRST_STEP

    def does(self, speed: float) -> None:
        """Take in that a speed did."""
        self.low = max(self.low, speed)
        if self.low >= self.high:  # which did not beside others
            self.high = math.inf

    def fails(self, speed: float, best: float) -> None:
        """Take in that a speed did not, and that the best ones so far do."""
        self.high = min(self.high, speed)
        if self.low >= self.high:  # which did beside others
            self.low = best if best < self.high else 0.0
            self.step = FIRST_STEP

    def following(self, beside: Iterable[float], above: Callable[[float], float]) -> float:
        """The speed to be tried next.

        Args:
            beside: Speeds to be tried along the neighbours [m/s].
            above: Gives the next greater speed that can be in the file.
        """
        if self.low and math.isfinite(self.high):
            middle = max(math.sqrt(self.low * self.high), above(self.low))
            return middle if middle < self.high else self.low
        factor, self.step = self.step, min(self.step**2, STEP)
        if self.low:
            return factor * self.low
        slower = max(self.high / factor, min(SLOWEST, self.high))
        # where two stretches have the same speed it does not change
        return max((speed for speed in beside if slower < speed < self.high), default=slower)
