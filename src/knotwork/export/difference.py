"""Distance of the curve through points from a motion, by polynomials and not by samples."""

from __future__ import annotations

import math

import numpy as np

from knotwork.polynomial.critical_points import critical_points, horner
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray


def largest_difference(
    trajectory: JointTrajectory, times: FloatArray, joined: FloatArray, order: int = 0
) -> FloatArray:
    """Largest absolute difference of a derivative on each piece, shape (pieces, d).

    Args:
        trajectory: The motion; its breaks are among the times.
        times: Ends of the pieces [s], shape (pieces + 1,).
        joined: Polynomials of the pieces, highest power first, shape (k + 1, pieces, d).
        order: Order of the derivative: 0 for the position.
    """
    polynomials = _difference(trajectory, times, joined)
    for _ in range(order):
        powers = np.arange(len(polynomials) - 1, 0, -1.0)[:, None, None]
        polynomials = polynomials[:-1] * powers / np.diff(times)[:, None]
    return _largest(polynomials)


def _difference(trajectory: JointTrajectory, times: FloatArray, joined: FloatArray) -> FloatArray:
    """Motion less the joined pieces, in the unit variable of each, shape (k+1, pieces, d)."""
    size = max(len(trajectory.polynomial.c), len(joined))
    h = np.diff(times)[:, None]
    difference = np.zeros((size, *joined.shape[1:]))
    for power in range(size):
        row = size - 1 - power
        if power < len(trajectory.polynomial.c):
            own = trajectory(times[:-1], power) / math.factorial(power)
            difference[row] += own * h**power
        if power < len(joined):
            difference[row] -= joined[len(joined) - 1 - power] * h**power
    return difference


def _largest(polynomials: FloatArray) -> FloatArray:
    """Largest absolute value on [0, 1] of each polynomial, shape (pieces, d)."""
    inner = critical_points(polynomials)
    ends = np.zeros((2, *polynomials.shape[1:]))
    ends[1] = 1.0
    values = horner(polynomials[:, None], np.concatenate((ends, inner)))
    return np.asarray(np.abs(values).max(axis=0))
