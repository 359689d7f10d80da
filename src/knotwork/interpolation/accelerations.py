"""The accelerations at the waypoints that make the jerk continuous there: one tridiagonal system.

Take an interval of length h between two waypoints with positions y0, y1, velocities v0, v1 and
accelerations a0, a1, and its two knots a time p h after the one and b h before the other. Position
and velocity at the far end fix the accelerations at the knots. With q = 1 - b, s = (y1 - y0) / h:

    A = [-p (1 + q) a0 + (1 - p) b a1 + (6 (s - v0) - 2 (1 + b - p) (v1 - v0)) / h] / q
    B = [p q a0 - b (2 - p) a1 - (6 (s - v0) - 2 (2 + b - p) (v1 - v0)) / h] / (1 - p)

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

import numpy as np

from knotwork.interpolation.knots import PlacedKnots
from knotwork.interpolation.tridiagonal import solve_tridiagonal
from knotwork.waypoints import FloatArray

BLOCK = 2048
"""Waypoints handled together, so that the temporaries stay in the cache."""


@dataclass(frozen=True, eq=False)
class KnotAccelerations:
    """Accelerations at the two knots of consecutive intervals, linear in those at their ends.

    A = -after_0 a0 + after_1 a1 + after_given and B = before_0 a0 - before_1 a1 + before_given.

    Attributes:
        after_0, after_1, before_0, before_1: Factors, shape (intervals,).
        after_given, before_given: What positions and velocities contribute, shape (d, intervals).
        after_time: From the first waypoint to its knot, p h [s], shape (intervals,).
        before_time: From the second knot to its waypoint, b h [s], shape (intervals,).
    """

    after_0: FloatArray
    after_1: FloatArray
    after_given: FloatArray
    before_0: FloatArray
    before_1: FloatArray
    before_given: FloatArray
    after_time: FloatArray
    before_time: FloatArray

    def at(self, a: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return A and B, shape (d, intervals), from accelerations a, shape (d, intervals + 1)."""
        a0, a1 = a[:, :-1], a[:, 1:]
        after = self.after_1 * a1
        after += self.after_given
        after -= self.after_0 * a0
        before = self.before_0 * a0
        before += self.before_given
        before -= self.before_1 * a1
        return after, before


def knot_accelerations(
    x: FloatArray, y: FloatArray, dydx: FloatArray, knots: PlacedKnots, low: int, high: int
) -> KnotAccelerations:
    """Set up the accelerations at the knots of the intervals low … high - 1.

    Args:
        x: Waypoint times [s], shape (n,).
        y: Positions as rows, shape (d, n).
        dydx: Velocities as rows, shape (d, n).
        knots: The knots of all waypoints.
        low: First interval.
        high: The one after the last.
    """
    ends = slice(low, high + 1)
    start, end = x[low:high], x[low + 1 : high + 1]
    left, right = knots.left[low + 1 : high + 1], knots.right[low:high]
    h = end - start
    after_time, before_time = right - start, end - left
    # differences of times rather than 1 - p and 1 - b: knots may be very near to a waypoint
    p, p_rest = after_time / h, (end - right) / h
    b, b_rest = before_time / h, (left - start) / h

    slope, change = np.diff(y[:, ends]), np.diff(dydx[:, ends])
    slope /= h
    slope -= dydx[:, low:high]
    slope *= 6.0
    change *= 2.0
    after = slope - (b + p_rest) * change
    after /= h * b_rest
    change *= 1.0 + b + p_rest
    change -= slope
    change /= h * p_rest
    return KnotAccelerations(
        after_0=p * (1.0 + b_rest) / b_rest,
        after_1=p_rest * b / b_rest,
        after_given=after,
        before_0=p * b_rest / p_rest,
        before_1=b * (1.0 + p_rest) / p_rest,
        before_given=change,
        after_time=after_time,
        before_time=before_time,
    )


def waypoint_accelerations(
    x: FloatArray,
    y: FloatArray,
    dydx: FloatArray,
    knots: PlacedKnots,
    end_acceleration: tuple[FloatArray, FloatArray] | None,
) -> FloatArray:
    """Solve for the accelerations at the waypoints.

    Args:
        x: Waypoint times [s], shape (n,).
        y: Positions as rows, shape (d, n).
        dydx: Velocities as rows, shape (d, n).
        knots: The knots; with doubled ends exactly if end accelerations are given.
        end_acceleration: First and last acceleration, shape (d,) each, or `None`.

    Returns:
        Accelerations as rows, shape (d, n).
    """
    n = x.size
    # the jerks (A - a)/(p h) after and (a - B)/(b h) before waypoint i are equal, so row i reads
    #     -before_0/(b h) a[i-1] + ((1 + before_1)/(b h) + (1 + after_0)/(p h)) a[i]
    #         - after_1/(p h) a[i+1] = after_given/(p h) + before_given/(b h)
    # and at both ends a = what is asked for; without that it is decoupled, and found afterwards
    lower, diagonal, upper = np.zeros(n - 1), np.zeros(n), np.zeros(n - 1)
    rhs = np.empty((y.shape[0], n))
    rhs[:, 0] = 0.0
    for low in range(0, n - 1, BLOCK):
        high = min(low + BLOCK, n - 1)
        own, following = slice(low, high), slice(low + 1, high + 1)
        knot = knot_accelerations(x, y, dydx, knots, low, high)
        per_after, per_before = _inverse(knot.after_time), _inverse(knot.before_time)
        lower[own], upper[own] = -knot.before_0 * per_before, -knot.after_1 * per_after
        diagonal[following] = (1.0 + knot.before_1) * per_before
        diagonal[own] += (1.0 + knot.after_0) * per_after
        np.multiply(knot.before_given, per_before, out=rhs[:, following])
        rhs[:, own] += knot.after_given * per_after
    diagonal[0] = diagonal[-1] = 1.0
    upper[0] = lower[-1] = 0.0
    rhs[:, 0], rhs[:, -1] = (0.0, 0.0) if end_acceleration is None else end_acceleration
    a = solve_tridiagonal(lower, diagonal, upper, rhs)
    if end_acceleration is None:
        start = knot_accelerations(x, y, dydx, knots, 0, 1).at(a[:, :2])[0]
        end = knot_accelerations(x, y, dydx, knots, n - 2, n - 1).at(a[:, -2:])[1]
        a[:, 0], a[:, -1] = start[:, 0], end[:, 0]
    return a


def _inverse(value: FloatArray) -> FloatArray:
    """1 / value; 0 where the value is 0, at an end waypoint that has no knot on that side."""
    return np.divide(1.0, value, out=np.zeros_like(value), where=value > 0.0)
