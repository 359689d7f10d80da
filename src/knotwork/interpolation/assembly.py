"""From accelerations at the waypoints to the polynomials between the knots."""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.accelerations import BLOCK, knot_accelerations
from knotwork.interpolation.knots import PlacedKnots
from knotwork.waypoints import FloatArray


def coefficients(
    x: FloatArray, y: FloatArray, dydx: FloatArray, a: FloatArray, knots: PlacedKnots
) -> FloatArray:
    """Assemble the polynomials between the knots.

    Acceleration is linear between the knots, so it is built from its values there; position and
    velocity at each knot come from the waypoint beside it. Both pieces that meet at a knot are
    made from its one state, so that they agree to rounding.

    Args:
        x: Waypoint times [s], shape (n,).
        y: Positions as rows, shape (d, n).
        dydx: Velocities as rows, shape (d, n).
        a: Accelerations as rows, shape (d, n).
        knots: The knots.

    Returns:
        Coefficients, shape (4, m-1, d), highest power first.
    """
    n = x.size
    # pieces in turn: the one around a waypoint, then the one from there to the next waypoint's;
    # without doubled ends the first and the last of them do not exist
    shift = 0 if knots.doubled_ends else 1
    c = np.empty((4, knots.time.size - 1, y.shape[0]))
    for low in range(0, n, BLOCK):
        high = min(low + BLOCK, n)
        after, before = _beside_waypoints(x, y, dydx, a, knots, low, high)
        left, right = knots.left[low : high + 1], knots.right[low:high]
        r_left, v_left = _state(x, y, dydx, a, left, before, low)
        r_right, v_right = _state(x, y, dydx, a, right, after, low)

        first = 1 if shift and low == 0 else 0
        last = high - low - 1 if shift and high == n else high - low
        used = slice(first, last)
        around = slice(2 * (low + first) - shift, 2 * (low + last) - shift, 2)
        cubic = after[:, used] - before[:, used]
        cubic /= 6.0 * (right[used] - left[used])
        _put(c, around, cubic, before[:, used], v_left[:, used], r_left[:, used])

        gaps = left.size - 1
        between = slice(2 * low + 1 - shift, 2 * (low + gaps) + 1 - shift, 2)
        cubic = before[:, 1:] - after[:, :gaps]
        cubic /= 6.0 * (left[1:] - right[:gaps])
        _put(c, between, cubic, after[:, :gaps], v_right[:, :gaps], r_right[:, :gaps])
    return c


def _beside_waypoints(
    x: FloatArray,
    y: FloatArray,
    dydx: FloatArray,
    a: FloatArray,
    knots: PlacedKnots,
    low: int,
    high: int,
) -> tuple[FloatArray, FloatArray]:
    """Accelerations at the right knots of waypoints low … high - 1, at the left ones of one more.

    The first waypoint is its own left knot, the last one its own right knot.
    """
    n = x.size
    start, stop = max(low - 1, 0), min(high, n - 1)
    knot = knot_accelerations(x, y, dydx, knots, start, stop)
    after, before = knot.at(a[:, start : stop + 1])
    if low == 0:
        before = np.concatenate((a[:, :1], before), axis=1)
    else:
        after = after[:, 1:]
    if high == n:
        after = np.concatenate((after, a[:, -1:]), axis=1)
    return after, before


def _state(
    x: FloatArray,
    y: FloatArray,
    dydx: FloatArray,
    a: FloatArray,
    side: FloatArray,
    acceleration: FloatArray,
    low: int,
) -> tuple[FloatArray, FloatArray]:
    """Position and velocity at knots beside the waypoints from `low` on, shape (d, knots) each."""
    part = slice(low, low + side.size)
    u = side - x[part]
    velocity = a[:, part] + acceleration
    velocity *= 0.5 * u
    velocity += dydx[:, part]
    position = a[:, part] * 2.0
    position += acceleration
    position *= u / 6.0
    position += dydx[:, part]
    position *= u
    position += y[:, part]
    return position, velocity


def _put(
    c: FloatArray,
    pieces: slice,
    cubic: FloatArray,
    acceleration: FloatArray,
    velocity: FloatArray,
    position: FloatArray,
) -> None:
    """Store the coefficients of every other piece, given as rows, shape (d, pieces)."""
    c[0, pieces] = cubic.T
    np.multiply(acceleration.T, 0.5, out=c[1, pieces])
    c[2, pieces] = velocity.T
    c[3, pieces] = position.T
