"""Polynomials between the knots, from accelerations at the waypoints."""

from __future__ import annotations

import numpy as np

from knotwork.spline.interpolation.accelerations import Waypoints
from knotwork.waypoints import FloatArray


def assemble_pieces(
    data: Waypoints, a: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Assemble the polynomials between the knots.

    Acceleration is linear between the knots, so it is built from its values there; position and
    velocity at each knot come from the waypoint next to it. Both pieces that meet at a knot are
    made from its one state, so that they agree to rounding. A waypoint whose acceleration is given
    is a knot itself: the jerk may jump there.

    Args:
        data: Times, positions, velocities and knots.
        a: Accelerations at the waypoints as rows, shape (d, n).
        left: Accelerations at their left knots, shape (d, n).
        right: Accelerations at their right knots, shape (d, n).

    Returns:
        The knots [s], shape (m,), and the coefficients, shape (4, m-1, d), highest power first.
    """
    time = _interleave(data.left, data.right)
    u, bend = time - data.x.repeat(2), _interleave(left, right)
    own_acceleration, v = a.repeat(2, axis=1), data.dydx.repeat(2, axis=1)
    position = data.y.repeat(2, axis=1) + u * (v + u * (2.0 * own_acceleration + bend) / 6.0)
    states = [time, bend, v + 0.5 * u * (own_acceleration + bend), position]
    cuts = np.flatnonzero(data.known[1:-1]) + 1
    if cuts.size:
        values = data.x, a, data.dydx, data.y
        states = [
            np.insert(state, 2 * cuts + 1, own_acceleration[..., cuts], axis=-1)
            for state, own_acceleration in zip(states, values, strict=True)
        ]
    # an end whose acceleration isn't given has one knot only
    inside = slice(0 if data.known[0] else 1, None if data.known[-1] else -1)
    time, bend, v, position = (state[..., inside] for state in states)
    c = np.empty((4, time.size - 1, a.shape[0]))
    c[0] = (np.diff(bend) / (6.0 * np.diff(time))).T
    c[1], c[2], c[3] = 0.5 * bend[:, :-1].T, v[:, :-1].T, position[:, :-1].T
    return np.array(time), c


def _interleave(left: FloatArray, right: FloatArray) -> FloatArray:
    """Interleave values at the left and the right knots of the waypoints, shape (..., 2n)."""
    return np.stack((left, right), axis=-1).reshape(*left.shape[:-1], 2 * left.shape[-1])
