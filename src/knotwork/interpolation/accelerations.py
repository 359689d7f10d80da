"""The accelerations at the waypoints that make the jerk continuous there: one tridiagonal system.

Take an interval of length h between two waypoints with positions y0, y1, velocities v0, v1 and
accelerations a0, a1, and its two knots a time p h after the one and b h before the other. Position
and velocity at the far end fix the accelerations at the knots. With q = 1 - b, s = (y1 - y0) / h:

    A = -p (1 + q)/q a0 + (1 - p) b/q a1 + [6 s - 2 (1 + p + q) v0 - 2 (1 - p + b) v1] / (h q)
    B = p q/(1 - p) a0 - b (2 - p)/(1 - p) a1
            - [6 s - 2 (p + q) v0 - 2 (2 - p + b) v1] / (h (1 - p))

and so the first jerk of the interval, (A - a0) / (p h), and its last, (a1 - B) / (b h). No knot
sits at a waypoint, so the last jerk of an interval is the first jerk of the next one: that is one
equation in three neighbouring accelerations. These are Eqs. (30), (31) and (34) with everything
but the accelerations eliminated.

The first interval of the paper's curve has one knot only, which is the case p = 0: its A is the
acceleration at the start, and a0 drops out of B. The last interval, with b = 0, is its mirror
image. For n = 2 both hold, and what is left is the plain cubic.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from knotwork.interpolation.knots import PlacedKnots
from knotwork.interpolation.tridiagonal import solve_tridiagonal
from knotwork.waypoints import FloatArray

Terms: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]
"""y1 - y0, v0 and v1 of consecutive intervals, shape (d, intervals) each."""

BLOCK = 49152
"""Values that are worked on together, so that the temporaries stay in the nearer caches."""


@dataclass(frozen=True, eq=False)
class Waypoints:
    """The data of a spline, one row a component.

    Attributes:
        x: Times [s], shape (n,).
        y: Positions, shape (d, n).
        dydx: Velocities, shape (d, n).
        knots: The knots.
    """

    x: FloatArray
    y: FloatArray
    dydx: FloatArray
    knots: PlacedKnots

    @property
    def block(self) -> int:
        """Number of waypoints to work on together."""
        # odd, as rows a power of two apart would compete for the same lines of the cache
        return max(16, BLOCK // max(1, int(self.y.shape[0]))) | 1

    def weights(self, low: int, high: int) -> IntervalWeights:
        """Weights of the intervals low … high - 1; of few intervals all are kept."""
        if self.x.size > self.block:
            return _interval_weights(self, low, high)
        return self._all_weights.part(low, high)

    def terms(self, low: int, high: int) -> Terms:
        """Terms of the intervals low … high - 1 that are given; of few intervals all are kept."""
        if self.x.size > self.block:
            return _given_terms(self, low, high)
        change, start, end = self._all_terms
        return change[:, low:high], start[:, low:high], end[:, low:high]

    @cached_property
    def _all_weights(self) -> IntervalWeights:
        return _interval_weights(self, 0, self.x.size - 1)

    @cached_property
    def _all_terms(self) -> Terms:
        return _given_terms(self, 0, self.x.size - 1)


@dataclass(frozen=True, eq=False)
class IntervalWeights:
    """Accelerations at the two knots of consecutive intervals as sums of what is at their ends.

    Attributes:
        after: Weights of a0, a1, y1 - y0, v0, v1 in A, shape (5, intervals).
        before: Weights of the same in B, shape (5, intervals).
        after_time: From the first waypoint to its knot, p h [s], shape (intervals,).
        before_time: From the second knot to its waypoint, b h [s], shape (intervals,).
    """

    after: FloatArray
    before: FloatArray
    after_time: FloatArray
    before_time: FloatArray

    def part(self, low: int, high: int) -> IntervalWeights:
        """The weights of some of the intervals."""
        if high - low == self.after_time.size:
            return self
        own = slice(low, high)
        return IntervalWeights(
            self.after[:, own], self.before[:, own], self.after_time[own], self.before_time[own]
        )


def _interval_weights(data: Waypoints, low: int, high: int) -> IntervalWeights:
    """Set up the accelerations at the knots of the intervals low … high - 1."""
    start, end = data.x[low:high], data.x[low + 1 : high + 1]
    left, right = data.knots.left[low + 1 : high + 1], data.knots.right[low:high]
    after_time, before_time = right - start, end - left
    per_h = 1.0 / (end - start)
    # differences of times rather than 1 - p and 1 - b: knots may be very near to a waypoint
    p, p_rest = after_time * per_h, (end - right) * per_h
    b, b_rest = before_time * per_h, (left - start) * per_h

    after, before = np.empty((2, 5, high - low))
    after[0] = -p * (1.0 + b_rest)
    after[1] = p_rest * b
    after[2] = 6.0 * per_h * per_h
    after[3] = (1.0 + p + b_rest) * (-2.0 * per_h)
    after[4] = (p_rest + b) * (-2.0 * per_h)
    before[0] = p * b_rest
    before[1] = -b * (1.0 + p_rest)
    before[2] = -after[2]
    before[3] = (p + b_rest) * (2.0 * per_h)
    before[4] = (1.0 + p_rest + b) * (2.0 * per_h)
    after *= 1.0 / b_rest
    before *= 1.0 / p_rest
    return IntervalWeights(after, before, after_time, before_time)


def _weighted_sum(
    weights: FloatArray, terms: tuple[FloatArray, ...], out: FloatArray, scratch: FloatArray
) -> None:
    """Sum terms of shape (d, k) with weights of shape (terms, k) into `out`, shape (d, k)."""
    np.multiply(terms[0], weights[0], out=out)
    for weight, term in zip(weights[1:], terms[1:], strict=True):
        np.multiply(term, weight, out=scratch)
        np.add(out, scratch, out=out)


def waypoint_accelerations(data: Waypoints, given: FloatArray) -> FloatArray:
    """Solve for the accelerations at the waypoints.

    Args:
        data: Times, positions, velocities and knots.
        given: Accelerations as rows, shape (d, n); those at waypoints where the knots say that
            they are known are kept.

    Returns:
        Accelerations as rows, shape (d, n).
    """
    n = data.x.size
    # the jerks (A - a)/(p h) after and (a - B)/(b h) before waypoint i are equal, so row i reads
    #     -before[0]/(b h) a[i-1] + ((1 - before[1])/(b h) + (1 - after[0])/(p h)) a[i]
    #         - after[1]/(p h) a[i+1] = the other terms of A/(p h) and B/(b h)
    # and where it is known a = what is given; at an end where it isn't, a is found afterwards
    lower, diagonal, upper = np.zeros(n - 1), np.zeros(n), np.zeros(n - 1)
    rhs = np.empty((data.y.shape[0], n))
    rhs[:, 0] = 0.0
    for low in range(0, n - 1, data.block):
        high = min(low + data.block, n - 1)
        own, following = slice(low, high), slice(low + 1, high + 1)
        weights = data.weights(low, high)
        per_after, per_before = inverse(weights.after_time), inverse(weights.before_time)
        after, before = weights.after * per_after, weights.before * per_before
        np.negative(before[0], out=lower[own])
        np.negative(after[1], out=upper[own])
        np.subtract(per_before, before[1], out=diagonal[following])
        per_after -= after[0]
        diagonal[own] += per_after
        terms = data.terms(low, high)
        scratch, total = np.empty((2, *terms[0].shape))
        _weighted_sum(before[2:], terms, rhs[:, following], scratch)
        _weighted_sum(after[2:], terms, total, scratch)
        rhs[:, own] += total
    known = data.knots.known
    ends = known.copy()
    ends[0] = ends[-1] = True
    fixed = np.flatnonzero(ends)
    diagonal[fixed] = 1.0
    upper[fixed[:-1]] = lower[fixed[1:] - 1] = 0.0
    rhs[:, fixed] = np.where(known[fixed], given[:, fixed], 0.0)
    a = solve_tridiagonal(lower, diagonal, upper, rhs)
    for end, (low, side) in ((0, (0, 0)), (-1, (n - 2, 1))):
        if not known[end]:
            found = np.empty((2, data.y.shape[0], 1))
            knot_accelerations(data, a, low, low + 1, *found)
            a[:, end] = found[side, :, 0]
    return a


def knot_accelerations(
    data: Waypoints, a: FloatArray, low: int, high: int, after: FloatArray, before: FloatArray
) -> None:
    """Find the accelerations A and B at the knots of the intervals low … high - 1.

    Args:
        data: Times, positions, velocities and knots.
        a: Accelerations at the waypoints as rows, shape (d, n).
        low: First interval.
        high: The one after the last.
        after: Takes A, shape (d, high - low).
        before: Takes B, shape (d, high - low).
    """
    weights = data.weights(low, high)
    terms = (a[:, low:high], a[:, low + 1 : high + 1], *data.terms(low, high))
    scratch = np.empty(terms[2].shape)
    _weighted_sum(weights.after, terms, after, scratch)
    _weighted_sum(weights.before, terms, before, scratch)


def _given_terms(data: Waypoints, low: int, high: int) -> Terms:
    """The terms of the intervals low … high - 1 that are given."""
    position, velocity = data.y[:, low : high + 1], data.dydx[:, low : high + 1]
    # the data may be a transposed view, and NumPy would keep its order in what is made from it
    change = np.empty((position.shape[0], high - low))
    np.subtract(position[:, 1:], position[:, :-1], out=change)
    velocity = np.ascontiguousarray(velocity)
    return change, velocity[:, :-1], velocity[:, 1:]


def inverse(value: FloatArray) -> FloatArray:
    """1 / value; 0 where the value is 0, at an end waypoint that has no knot on that side."""
    if value.all():
        return 1.0 / value
    return np.divide(1.0, value, out=np.zeros_like(value), where=value > 0.0)
