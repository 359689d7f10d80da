"""C2 cubic splines from their accelerations at the breaks: one tridiagonal system.

An interval has the length h, the mean velocity s and the accelerations a0 and a1 at its ends. The
cubic through its end positions then has the velocities

    s - h (2 a0 + a1)/6  at its start,    s + h (a0 + 2 a1)/6  at its end.

They must agree where two intervals meet, which gives for three neighbouring accelerations

    h₋ a₋ / 6 + (h₋ + h₊) a / 3 + h₊ a₊ / 6 = s₊ - s₋.

The matrix is diagonally dominant with positive entries. Counting every other acceleration with
the opposite sign turns it into the M-matrix that the solver is made for.
"""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.tridiagonal import solve_tridiagonal
from knotwork.waypoints import FloatArray


def solve_accelerations(diagonal: FloatArray, between: FloatArray, rhs: FloatArray) -> FloatArray:
    """Solve the symmetric tridiagonal system with positive entries for the accelerations.

    Args:
        diagonal: Shape (m,), each above the sum of its neighbours.
        between: Entries next to it, shape (m-1,), positive.
        rhs: Right-hand sides, shape (m, d).

    Returns:
        Accelerations, shape (m, d).
    """
    signs = np.where(np.arange(diagonal.size) % 2, -1.0, 1.0)
    columns = np.ascontiguousarray(rhs.T) * signs
    solution = solve_tridiagonal(-between, np.array(diagonal), -between, columns)
    return np.ascontiguousarray((solution * signs).T)


def cubic_pieces(t: FloatArray, y: FloatArray, a: FloatArray) -> FloatArray:
    """Coefficients of the cubics with given positions and accelerations at their ends.

    Args:
        t: Times, shape (m,).
        y: Positions, shape (m, d).
        a: Accelerations, shape (m, d).

    Returns:
        Coefficients, shape (4, m-1, d), highest power first.
    """
    h = np.diff(t)[:, None]
    start = np.diff(y, axis=0) / h - h * (2.0 * a[:-1] + a[1:]) / 6.0
    return np.stack((np.diff(a, axis=0) / (6.0 * h), 0.5 * a[:-1], start, y[:-1]))
