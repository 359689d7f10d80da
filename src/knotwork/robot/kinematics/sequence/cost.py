"""Lexicographic costs: arrays with one row per `CostLevel`; earlier levels have priority."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

import numpy as np

from knotwork.arrays import BoolArray, FloatArray

COST_TIE = 1e-9
"""Absolute difference below which costs are equal.

Then the next level decides, and finally the order of the candidates, so that every machine chooses
the same one.
"""
RELATIVE_COST_TIE = 1e-14
"""Relative difference below which costs are equal."""
BOUND_WIDENING = 1e-6
"""Absolute and relative widening of a bound, so that equal costs are within it."""


class CostLevel(IntEnum):
    """Levels of a cost.

    Attributes:
        IMPOSSIBLE: Sum over waypoints with an unattainable twist of 1 + residual; infinite for a
            forbidden change of branch.
        COLLISIONS: Number of colliding candidates and steps.
        OVERSPEED: Sum of the ratios of joint speeds above their limits, on average over an
            interval or at a waypoint, to the limits.
        CUBIC_EXCESS: Excess of cubics between waypoints: 2 − 1/u for one at u times a velocity
            limit halfway, 1 + excess [rad or m] for one beyond a position limit.
        CHANGES: Number of avoidable changes of branch.
        DISTANCE: Distance from the preferred configuration [s].
        TRAVEL: Weighted travel [s].
    """

    IMPOSSIBLE = 0
    COLLISIONS = 1
    OVERSPEED = 2
    CUBIC_EXCESS = 3
    CHANGES = 4
    DISTANCE = 5
    TRAVEL = 6


def make_cost(*shape: int, **levels: FloatArray) -> FloatArray:
    """Make costs of a given shape from levels by name; others are zero. A row per level."""
    cost = np.zeros((len(CostLevel), *shape))
    for name, values in levels.items():
        cost[CostLevel[name.upper()]] = values
    return cost


def lexicographic_argmin(cost: FloatArray) -> Any:
    """Index of the lexicographic minimum along axis 1; ties within rounding go to the first."""
    tied = np.ones(cost.shape[1:], dtype=bool)
    for level in cost:
        values = np.where(tied, level, np.inf)
        minimum = values.min(axis=0, keepdims=True)
        tied &= values <= minimum * (1.0 + RELATIVE_COST_TIE) + COST_TIE
    return tied.argmax(axis=0)


def is_within(cost: FloatArray, bound: FloatArray) -> BoolArray:
    """Whether each of m costs is at most a bound, within rounding, shape (m,)."""
    result = np.ones(cost.shape[1:], dtype=bool)
    for level, max_level in zip(cost[::-1], bound[::-1].tolist(), strict=True):
        slack = 0.0 if math.isinf(max_level) else BOUND_WIDENING * (1.0 + abs(max_level))
        result = (level < max_level - slack) | ((level <= max_level + slack) & result)
    return result
