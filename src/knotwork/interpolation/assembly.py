"""From accelerations at the waypoints to the polynomials between the knots."""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.accelerations import Intervals, Waypoints
from knotwork.waypoints import FloatArray


def coefficients(data: Waypoints, a: FloatArray) -> FloatArray:
    """Assemble the polynomials between the knots.

    Acceleration is linear between the knots, so it is built from its values there; position and
    velocity at each knot come from the waypoint next to it. Both pieces that meet at a knot are
    made from its one state, so that they agree to rounding.

    Args:
        data: Times, positions, velocities and knots.
        a: Accelerations at the waypoints as rows, shape (d, n).

    Returns:
        Coefficients, shape (4, m-1, d), highest power first.
    """
    first, last = data.knots.range
    c = np.empty((4, last - first, data.y.shape[0]))
    bend = a[:, 0]
    for intervals in data.blocks():
        bend = _assemble(data, a, intervals, bend, c)
    return _cut(data, a, c) if data.knots.cuts.size else c


def _cut(data: Waypoints, a: FloatArray, c: FloatArray) -> FloatArray:
    """Divide the pieces around waypoints that are knots; the jerk may jump there."""
    cuts = data.knots.cuts
    pieces = 2 * cuts - data.knots.range[0]
    own, x = a[:, cuts].T, data.x[cuts]
    before, after = (x - data.knots.left[cuts])[:, None], (data.knots.right[cuts] - x)[:, None]
    c[0, pieces] = (own - 2.0 * c[1, pieces]) / (6.0 * before)
    jerk = (2.0 * c[1, pieces + 1] - own) / (6.0 * after)
    following = np.stack((jerk, 0.5 * own, data.dydx[:, cuts].T, data.y[:, cuts].T))
    return np.insert(c, pieces + 1, following, axis=1)


def _assemble(
    data: Waypoints, a: FloatArray, intervals: Intervals, before_first: FloatArray, c: FloatArray
) -> FloatArray:
    """Fill the coefficients of the pieces of the waypoints where some intervals begin.

    Each waypoint has a piece from its left to its right knot, and one from there to the left knot
    of the next. The last waypoint, with the last interval, has no second piece; where an end has no
    acceleration, the piece between its knots has no length: values computed for these mean nothing.

    Args:
        data: Times, positions, velocities and knots.
        a: Accelerations at the waypoints as rows, shape (d, n).
        intervals: Some intervals.
        before_first: Acceleration at the left knot of the first of the waypoints, shape (d,).
        c: Takes the coefficients, shape (4, m-1, d).

    Returns:
        The acceleration at the left knot of the waypoint after them, shape (d,).
    """
    low, high, last = intervals.low, intervals.high, intervals.high == data.x.size - 1
    part, count = slice(low, high + last), high + last - low
    y, v = (np.ascontiguousarray(rows[:, part]) for rows in (data.y, data.dydx))
    own, left, right = a[:, part], data.knots.left[part], data.knots.right[part]
    # leading axis: left knot and right knot; both are computed at once
    u = np.stack((left, right))[:, None] - data.x[part]
    per_span = np.zeros((2, 1, count))
    per_span[0] = 1.0 / (6.0 * (right - left))
    following = data.knots.left[low + 1 : high + 1]
    per_span[1, 0, : following.size] = 1.0 / (6.0 * (following - right[: following.size]))
    bend = _knot_accelerations(a, intervals, before_first, last=last)
    following_bend = bend[2, :, high - low - 1].copy()
    # pieces alternate: those of left knots, those of right knots
    first, end = data.knots.range
    ranges = (max(0, first - 2 * low), count - max(0, 2 * (low + count) - 1 - end)), (0, high - low)
    sides = []
    for side, (start, stop) in enumerate(ranges):
        begin = 2 * (low + start) + side - first
        pieces = c[:, begin : begin + 2 * (stop - start) : 2].transpose(0, 2, 1)
        sides.append((side, slice(start, stop), pieces))

    def put(power: int, rows: FloatArray) -> None:
        for side, part, pieces in sides:
            pieces[power] = rows[side, :, part]

    total = own + bend[:2]
    value = total * (0.5 * u)
    value += v
    put(2, value)
    total += own
    total *= u / 6.0
    total += v
    total *= u
    total += y
    put(3, total)
    np.subtract(bend[1:], bend[:2], out=value)
    value *= per_span
    put(0, value)
    bend *= 0.5
    put(1, bend)
    return following_bend


def _knot_accelerations(
    a: FloatArray, intervals: Intervals, before_first: FloatArray, *, last: bool
) -> FloatArray:
    """Accelerations at the left and right knot of each waypoint, and at the next left one.

    The first waypoint of all is its own left knot, the last its own right one. Arguments as of
    `_assemble`; shape (3, d, waypoints).
    """
    low, high = intervals.low, intervals.high
    bend = np.empty((3, a.shape[0], high + last - low))
    inside = bend[1:, :, : high - low]
    intervals.knot_accelerations(a[:, low : high + 1], out=inside)
    if last:
        bend[1, :, -1], bend[2, :, -1] = a[:, high], 0.0
    bend[0, :, 0], bend[0, :, 1:] = before_first, inside[1, :, : bend.shape[2] - 1]
    return bend
