"""From accelerations at the waypoints to the polynomials between the knots."""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.accelerations import Waypoints, inverse, knot_accelerations
from knotwork.waypoints import FloatArray


def coefficients(data: Waypoints, a: FloatArray) -> FloatArray:
    """Assemble the polynomials between the knots.

    Acceleration is linear between the knots, so it is built from its values there; position and
    velocity at each knot come from the waypoint beside it. Both pieces that meet at a knot are
    made from its one state, so that they agree to rounding.

    Args:
        data: Times, positions, velocities and knots.
        a: Accelerations at the waypoints as rows, shape (d, n).

    Returns:
        Coefficients, shape (4, m-1, d), highest power first.
    """
    n = data.x.size
    # For each waypoint the piece from its left to its right knot, and from there to the left knot
    # of the next one. Pieces that do not exist are cut off: the last, and at an end without an
    # acceleration given also the first or the last but one.
    c = np.empty((4, 2 * n, data.y.shape[0]))
    for low in range(0, n, data.block):
        high = min(low + data.block, n)
        _assemble(data, a, low, high, c[:, 2 * low : 2 * high])
    first, last = data.knots.range
    return _cut(data, a, c)[:, first : last + data.knots.cuts.size]


def _cut(data: Waypoints, a: FloatArray, c: FloatArray) -> FloatArray:
    """Divide the pieces around waypoints that are knots; the jerk may jump there."""
    cuts = data.knots.cuts
    if not cuts.size:
        return c
    own, x = a[:, cuts].T, data.x[cuts]
    before, after = (x - data.knots.left[cuts])[:, None], (data.knots.right[cuts] - x)[:, None]
    c[0, 2 * cuts] = (own - 2.0 * c[1, 2 * cuts]) / (6.0 * before)
    jerk = (2.0 * c[1, 2 * cuts + 1] - own) / (6.0 * after)
    following = np.stack((jerk, 0.5 * own, data.dydx[:, cuts].T, data.y[:, cuts].T))
    return np.insert(c, 2 * cuts + 1, following, axis=1)


def _assemble(data: Waypoints, a: FloatArray, low: int, high: int, c: FloatArray) -> None:
    """Fill the coefficients c, shape (4, 2 k, d), of the pieces of waypoints low … high - 1."""
    part, count = slice(low, high), high - low
    # leading axis: left knot and right knot; both are computed at once
    knot = np.stack((data.knots.left[part], data.knots.right[part]))[:, None]
    u = knot - data.x[part]
    bend = _beside_waypoints(data, a, low, high)
    second = bend[..., 1 : count + 1]
    y, v = (np.ascontiguousarray(rows[:, part]) for rows in (data.y, data.dydx))
    # pieces alternate: those of left knots, those of right knots
    pieces = c.reshape(4, count, 2, -1).transpose(0, 2, 3, 1)

    np.multiply(second, 0.5, out=pieces[1])
    value = a[:, part] + second
    value *= 0.5 * u
    value += v
    pieces[2] = value
    np.multiply(a[:, part], 2.0, out=value)
    value += second
    value *= u / 6.0
    value += v
    value *= u
    value += y
    pieces[3] = value
    np.subtract(second[1], second[0], out=value[0])
    np.subtract(bend[0, :, 2:], second[1], out=value[1])
    following = np.append(data.knots.left[low + 1 : high + 1], data.knots.right[high - 1 :][:1])
    span = np.stack((knot[1, 0] - knot[0, 0], following[:count] - knot[1, 0]))[:, None]
    value *= inverse(6.0 * span)
    pieces[0] = value


def _beside_waypoints(data: Waypoints, a: FloatArray, low: int, high: int) -> FloatArray:
    """Accelerations at the left and the right knots of the waypoints low - 1 … high.

    The first waypoint is its own left knot, the last one its own right knot.

    Returns:
        Shape (2, d, high - low + 2); entries that no piece of the waypoints low … high - 1 needs
        are left at 0.
    """
    n = data.x.size
    bend = np.empty((2, data.y.shape[0], high - low + 2))
    bend[..., [0, -1]] = 0.0
    start, stop = max(low - 1, 0), min(high, n - 1)
    shift = 1 - low
    knot_accelerations(
        data,
        a,
        start,
        stop,
        bend[1, :, start + shift : stop + shift],
        bend[0, :, start + 1 + shift : stop + 1 + shift],
    )
    if low == 0:
        bend[0, :, 1] = a[:, 0]
    if high == n:
        bend[1, :, -2] = a[:, -1]
    return bend
