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
image. For n = 2 both hold, and the plain cubic remains.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from knotwork.interpolation.knots import PlacedKnots
from knotwork.interpolation.tridiagonal import solve_tridiagonal
from knotwork.waypoints import FloatArray

BLOCK = 24576
"""Values that are worked on together, so that the temporaries stay in the nearer caches."""

KEPT = 16
"""Blocks that are kept; to keep more costs as much as to compute them again."""


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

    def blocks(self) -> Iterable[Intervals]:
        """All intervals, in blocks to work on together; they are kept where these are few."""
        # odd, as rows a power of two apart would compete for the same lines of the cache
        size = max(16, BLOCK // max(1, int(self.y.shape[0]))) | 1
        last = self.x.size - 1
        made = (_intervals(self, i, min(i + size, last)) for i in range(0, last, size))
        if last > KEPT * size:
            return made
        if not self._kept:
            self._kept.extend(made)
        return self._kept

    @cached_property
    def _kept(self) -> list[Intervals]:
        return []


class Intervals(NamedTuple):
    """Accelerations at the two knots of consecutive intervals as sums of the values at their ends.

    The first of the two is A, the acceleration at the knot after the first waypoint, the second is
    B, that at the knot before the second waypoint.

    Attributes:
        low: Index of the first.
        high: Index after that of the last.
        start: Weights of a0 in A and B, shape (2, 1, intervals).
        end: Weights of a1 in A and B, shape (2, 1, intervals).
        given: What positions and velocities give of A and B, shape (2, d, intervals).
        rate: One over the time from the first waypoint to its knot, p h, and over that from the
            second knot to its waypoint, b h [1/s]; 0 where a waypoint has no knot on that side;
            shape (2, 1, intervals).
    """

    low: int
    high: int
    start: FloatArray
    end: FloatArray
    given: FloatArray
    rate: FloatArray

    def knot_accelerations(
        self, a: FloatArray, part: slice = slice(None), out: FloatArray | None = None
    ) -> FloatArray:
        """A and B of some of the intervals, shape (2, d, k).

        Args:
            a: Accelerations at the waypoints next to them, shape (d, k + 1).
            part: Which of the intervals.
            out: Takes them; by default an array of their own.
        """
        sums = np.multiply(a[:, :-1], self.start[..., part], out=out)
        sums += a[:, 1:] * self.end[..., part]
        sums += self.given[..., part]
        return sums


def _intervals(data: Waypoints, low: int, high: int) -> Intervals:
    """Set up the accelerations at the knots of the intervals low … high - 1."""
    x = data.x[low : high + 1]
    knots = np.stack((data.knots.right[low:high], data.knots.left[low + 1 : high + 1]))
    # differences of times rather than 1 - p and 1 - b: knots may be very near to a waypoint
    from_start, to_end = knots - x[:-1], x[1:] - knots
    per_h = 1.0 / (x[1:] - x[:-1])
    (p, q), (p_rest, b) = from_start * per_h, to_end * per_h
    rate = 1.0 / np.stack((from_start[0], to_end[1]))
    if low == 0 and not data.knots.known[0]:
        rate[0, 0] = 0.0
    if high == data.x.size - 1 and not data.knots.known[-1]:
        rate[1, -1] = 0.0

    weights = np.empty((5, 2, 1, high - low))
    (start, end, change, first, last), twice = weights[:, :, 0], 2.0 * per_h
    start[0], start[1] = -p * (1.0 + q), p * q
    end[0], end[1] = p_rest * b, -b * (1.0 + p_rest)
    change[0] = 3.0 * per_h * twice
    first[0] = (1.0 + p + q) * twice
    last[0] = (p_rest + b) * twice
    first[1], last[1] = (p + q) * twice, (1.0 + p_rest + b) * twice
    np.negative(change[0], out=change[1])
    np.negative(weights[3:, 0], out=weights[3:, 0])
    weights[:, 0] *= 1.0 / q
    weights[:, 1] *= 1.0 / p_rest

    # the data may be a transposed view, and NumPy would keep its order in what is made from it
    velocity = np.ascontiguousarray(data.dydx[:, low : high + 1])
    position = data.y[:, low : high + 1]
    moves = np.empty((position.shape[0], high - low))
    np.subtract(position[:, 1:], position[:, :-1], out=moves)
    given = moves * weights[2]
    given += velocity[:, :-1] * weights[3]
    given += velocity[:, 1:] * weights[4]
    return Intervals(low, high, weights[0], weights[1], given, rate[:, None])


def waypoint_accelerations(data: Waypoints, given: FloatArray) -> FloatArray:
    """Solve for the accelerations at the waypoints.

    Args:
        data: Times, positions, velocities and knots.
        given: Accelerations as rows at the waypoints where the knots say that they are known,
            shape (d, known).

    Returns:
        Accelerations as rows, shape (d, n).
    """
    n = data.x.size
    # the jerks (A - a)/(p h) after and (a - B)/(b h) before waypoint i are equal, so row i reads,
    # with the weights of a0 and a1 in A and B,
    #     -B0/(b h) a[i-1] + ((1 - B1)/(b h) + (1 - A0)/(p h)) a[i] - A1/(p h) a[i+1]
    #         = what is given of A/(p h) and B/(b h)
    # and where it is known a = what is given; at an end where it isn't, a is found afterwards
    lower, diagonal, upper = np.zeros(n - 1), np.zeros(n), np.zeros(n - 1)
    rhs = np.empty((data.y.shape[0], n))
    rhs[:, 0] = 0.0
    for part in data.blocks():
        own, following = slice(part.low, part.high), slice(part.low + 1, part.high + 1)
        (after,), (before,) = part.rate
        np.multiply(part.start[1, 0], -before, out=lower[own])
        np.multiply(part.end[0, 0], -after, out=upper[own])
        np.multiply(1.0 - part.end[1, 0], before, out=diagonal[following])
        diagonal[own] += (1.0 - part.start[0, 0]) * after
        np.multiply(part.given[1], before, out=rhs[:, following])
        rhs[:, own] += part.given[0] * after
        if part.low == 0:
            first = part
    known = data.knots.known
    ends = known.copy()
    ends[0] = ends[-1] = True
    fixed = np.flatnonzero(ends)
    diagonal[fixed] = 1.0
    upper[fixed[:-1]] = lower[fixed[1:] - 1] = 0.0
    rhs[:, fixed] = 0.0
    rhs[:, known] = given
    a = solve_tridiagonal(lower, diagonal, upper, rhs)
    if not known[0]:
        a[:, 0] = first.knot_accelerations(a[:, :2], slice(1))[0, :, 0]
    if not known[-1]:
        a[:, -1] = part.knot_accelerations(a[:, -2:], slice(-1, None))[1, :, 0]
    return a
