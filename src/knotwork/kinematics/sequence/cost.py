"""Lexicographic costs of choices."""

from __future__ import annotations

import math
import operator
from typing import Any, NamedTuple

import numpy as np

# Costs that differ by less, absolute and relative, are equal: then what counts next decides, and in
# the end the first candidate wins, on every machine.
TIE = 1e-9
RELATIVE_TIE = 1e-14
# A bound is widened by this, absolute and relative, so that equal costs are within it.
WIDER = 1e-6


class Cost(NamedTuple):
    """Cost of choices in levels: what comes first counts before all that comes after.

    Each attribute is an array over the choices; or a number, if it is the same for all.

    Attributes:
        impossible: Waypoints where no joint velocities give the twist: for each 1 and what they
            leave of it; infinite for a change of branch that is forbidden.
        collisions: Candidates that collide, and steps on which the motion was found to.
        infeasible: Joint speeds beyond their limits, on average over an interval or at a waypoint:
            the sum of how many times the limit.
        violation: Mid-interval violations: intervals where a cubic is beyond a velocity limit
            halfway, at u times it 2 − 1/u, or beyond a position limit at `PLACES`, 1 and by how
            much [rad or m].
        changes: Changes of branch where they are to be avoided.
        distance: From the configuration to be near [s].
        travel: Weighted travel [s].
    """

    impossible: Any = 0.0
    collisions: Any = 0.0
    infeasible: Any = 0.0
    violation: Any = 0.0
    changes: Any = 0.0
    distance: Any = 0.0
    travel: Any = 0.0

    def plus(self, other: Cost) -> Cost:
        """The sum, broadcast as arrays are."""
        return Cost(*map(operator.add, self, other))

    def take(self, index: Any) -> Cost:
        """The costs of some of the choices."""
        return Cost(*[x[index] if isinstance(x, np.ndarray) else x for x in self])

    def first_least(self) -> Any:
        """Along the first axis the first choice that is as good as the least, but for rounding.

        A level with one value along the other axis is the same for all of it; travel has all.
        """
        tied: Any = None
        for level in self:
            if not isinstance(level, np.ndarray):
                continue
            value = level if tied is None else np.where(tied, level, np.inf)
            least = value.min(axis=0, keepdims=True)
            tied = value <= least * (1.0 + RELATIVE_TIE) + TIE
        return tied.argmax(axis=0)

    def within(self, bound: Cost) -> Any:
        """Which choices cost no more than a bound, equal to it but for rounding included."""
        result: Any = True
        for level, most in zip(reversed(self), reversed(bound), strict=True):
            if isinstance(level, float) and level == most:
                continue
            slack = 0.0 if math.isinf(most) else WIDER * (1.0 + abs(most))
            result = (level < most - slack) | ((level <= most + slack) & result)
        return result

    def without_zeros(self) -> Cost:
        """The same, arrays of zeros as a number: nothing is spent on them."""
        levels = [0.0 if isinstance(x, np.ndarray) and not x.any() else x for x in self]
        return Cost(*levels)._replace(travel=self.travel)


UNBOUNDED = Cost(*[np.inf] * len(Cost._fields))
