"""Feasible durations of one joint between two states, under velocity and acceleration limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray


class FeasibleDurations(NamedTuple):
    """Feasible durations of each joint: from `minimum` to `early_end`, and from `late_start` on.

    Attributes:
        minimum: Minimum durations [s], shape (d,).
        early_end: Ends of the first range [s], shape (d,); infinite where it is the only one.
        late_start: Starts of the second range [s], shape (d,); infinite without one.
    """

    minimum: FloatArray
    early_end: FloatArray
    late_start: FloatArray


def feasible_durations(
    move: FloatArray, v0: FloatArray, v1: FloatArray, V: FloatArray, A: FloatArray
) -> FeasibleDurations:
    """Find the feasible durations of each joint.

    Args:
        move: Displacement, shape (d,).
        v0: Velocity at the start, shape (d,).
        v1: Velocity at the end, shape (d,).
        V: Velocity limits, shape (d,).
        A: Acceleration limits, shape (d,).
    """
    unlimited = np.isinf(A)
    A = np.where(unlimited, 1.0, A)
    # displacement of a direct change from one velocity to the other
    direct = 0.5 * (v0 + v1) * np.abs(v1 - v0) / A
    rounding = 1e-12 * (np.abs(move) + np.abs(direct))
    # mirrored so that the joint accelerates first
    sign = np.where(move > direct, 1.0, -1.0)
    D, a, b = sign * move, sign * v0, sign * v1
    first = np.where(
        np.abs(move - direct) <= rounding, np.abs(v1 - v0) / A, _peaked_duration(D, a, b, V, A)
    )
    # braking first takes longer, up to the duration at which the joint would have to reverse
    lowest_squared = 0.5 * (a * a + b * b) - A * D
    blocked = (np.minimum(a, b) > 0.0) & (lowest_squared > 0.0)
    last = (a + b - 2.0 * np.sqrt(np.maximum(lowest_squared, 0.0))) / A
    later = _peaked_duration(-D, -a, -b, V, A)
    return FeasibleDurations(
        np.where(unlimited, np.abs(move) / V, first),
        np.where(blocked & ~unlimited, np.maximum(last, first), np.inf),
        np.where(blocked & ~unlimited, later, np.inf),
    )


def _peaked_duration(
    D: FloatArray, a: FloatArray, b: FloatArray, V: FloatArray, A: FloatArray
) -> FloatArray:
    """Duration of a motion that accelerates to a peak velocity between 0 and V, and brakes."""
    squares = 0.5 * (a * a + b * b)
    peak = np.minimum(np.sqrt(np.maximum(A * D + squares, 0.0)), V)
    rest = np.maximum(D - (peak * peak - squares) / A, 0.0)
    return np.asarray((2.0 * peak - a - b) / A + np.where(peak < V, 0.0, rest / V))
