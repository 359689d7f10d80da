"""Lexicographic costs of choices."""

from __future__ import annotations

import math
import operator
from typing import Any, NamedTuple

import numpy as np

# Absolute and relative differences below which costs are equal: then the next level decides, and
# finally the first candidate wins, on every machine.
TIE = 1e-9
RELATIVE_TIE = 1e-14
# Absolute and relative widening of a bound, so that equal costs are within it.
WIDER = 1e-6


class Cost(NamedTuple):
    """Lexicographic cost of choices: an earlier level counts before all later ones.

    Each attribute is an array over the choices, or a number that holds for all.

    Attributes:
        impossible: Sum over waypoints with an unattainable twist of 1 + residual; infinite for a
            forbidden change of branch.
        collisions: Number of colliding candidates and steps.
        infeasible: Sum of the ratios of joint speeds above their limits, on average over an
            interval or at a waypoint, to the limits.
        violation: Mid-interval violations: 2 − 1/u for a cubic at u times a velocity limit
            halfway, 1 + excess [rad or m] for one beyond a position limit at `PLACES`.
        changes: Number of avoidable changes of branch.
        distance: Distance from the preferred configuration [s].
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
        """Sum of two costs, with broadcasting."""
        return Cost(*map(operator.add, self, other))

    def take(self, index: Any) -> Cost:
        """The costs of some of the choices."""
        return Cost(*[x[index] if isinstance(x, np.ndarray) else x for x in self])

    def first_least(self) -> Any:
        """Index of the lexicographic minimum along axis 0; ties within rounding go to the first.

        A level with one value along the other axis holds for all of it; travel has all values.
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
        """Whether each choice costs no more than a bound, within rounding."""
        result: Any = True
        for level, most in zip(reversed(self), reversed(bound), strict=True):
            if isinstance(level, float) and level == most:
                continue
            slack = 0.0 if math.isinf(most) else WIDER * (1.0 + abs(most))
            result = (level < most - slack) | ((level <= most + slack) & result)
        return result

    def without_zeros(self) -> Cost:
        """The same cost, with all-zero arrays replaced by 0.0 so that they are skipped."""
        levels = [0.0 if isinstance(x, np.ndarray) and not x.any() else x for x in self]
        return Cost(*levels)._replace(travel=self.travel)


UNBOUNDED = Cost(*[np.inf] * len(Cost._fields))
