"""Accelerations at the waypoints with continuous jerk: one tridiagonal system.

Take an interval of length h between two waypoints with accelerations a0, a1. Its two knots are the
time p h after the first waypoint and b h before the second; q = 1 - b. Position and velocity at the
far end determine the accelerations at the knots, A and B, as sums of a0, a1 and constants (page
"The method" of the documentation). The first jerk of the interval is (A - a0) / (p h), and its last
jerk is (a1 - B) / (b h). There is no knot at a waypoint, so the last jerk of an interval equals the
first jerk of the next one. This is one equation in three neighbouring accelerations. These are Eqs.
(30), (31) and (34), where all unknowns but the accelerations are eliminated.

The first interval of the paper's curve has only one knot. This is the case p = 0, in which A is the
acceleration at the start, and B does not depend on a0. The last interval, with b = 0, is its mirror
image. For n = 2 both cases apply, and the curve is the plain cubic.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray


class SplineData(NamedTuple):
    """The data of a spline, one row per component.

    Attributes:
        waypoint_times: Times of the waypoints [s], shape (n,).
        y: Positions, shape (d, n).
        dydx: Velocities, shape (d, n).
        left: Knot at or before each waypoint [s], shape (n,).
        right: Knot at or after each waypoint [s], shape (n,).
        known: Whether the acceleration at each waypoint is given, shape (n,).
    """

    waypoint_times: FloatArray
    y: FloatArray
    dydx: FloatArray
    left: FloatArray
    right: FloatArray
    known: BoolArray


class _Sums(NamedTuple):
    """A or B of all intervals as sums of the values at their ends.

    Attributes:
        start: Weights of a0, shape (n-1,).
        end: Weights of a1, shape (n-1,).
        constant: Terms of positions and velocities, shape (d, n-1).
    """

    start: FloatArray
    end: FloatArray
    constant: FloatArray

    def evaluate(self, a: FloatArray) -> FloatArray:
        """Compute accelerations at knots, shape (d, n-1), from those at the waypoints, (d, n)."""
        return a[:, :-1] * self.start + a[:, 1:] * self.end + self.constant


def solve_knot_accelerations(
    data: SplineData, known_values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Solve for the accelerations at the waypoints.

    Args:
        data: Times, positions, velocities and knots.
        known_values: Known accelerations at waypoints as rows, shape (d, known).

    Returns:
        Accelerations as rows at the waypoints, at their left knots and at their right ones, shape
        (d, n) each.
    """
    x, known = data.waypoint_times, data.known
    # differences of times and not 1 - p and 1 - b, because knots may be very near to a waypoint
    after, before = data.right[:-1] - x[:-1], x[1:] - data.left[1:]
    A, B = _knot_sums(data, after, before)
    # The jerks (A - a)/(p h) after and (a - B)/(b h) before waypoint i are equal, so row i reads,
    # with the weights of a0 and a1 in A and B,
    #     -B0/(b h) a[i-1] + ((1 - B1)/(b h) + (1 - A0)/(p h)) a[i] - A1/(p h) a[i+1]
    #         = the constant terms of A/(p h) and B/(b h)
    # Where the acceleration is known, row i reads a[i] = its value. An unknown one at an end is
    # computed afterwards.
    rate_after, rate_before = 1.0 / after, 1.0 / before
    if not known[0]:
        rate_after[0] = 0.0
    if not known[-1]:
        rate_before[-1] = 0.0
    lower, upper = -B.start * rate_before, -A.end * rate_after
    diagonal, rhs = np.zeros(x.size), np.zeros(data.y.shape)
    diagonal[1:] = (1.0 - B.end) * rate_before
    diagonal[:-1] += (1.0 - A.start) * rate_after
    rhs[:, 1:] = B.constant * rate_before
    rhs[:, :-1] += A.constant * rate_after
    fixed = known.copy()
    fixed[0] = fixed[-1] = True
    diagonal[fixed] = 1.0
    upper[fixed[:-1]] = lower[fixed[1:]] = 0.0
    rhs[:, fixed] = 0.0
    rhs[:, known] = known_values
    a = solve_tridiagonal(lower, diagonal, upper, rhs)
    right, left = A.evaluate(a), B.evaluate(a)
    if not known[0]:  # p = 0: neither depends on a[0]
        a[:, 0] = right[:, 0]
    if not known[-1]:
        a[:, -1] = left[:, -1]
    return a, np.hstack((a[:, :1], left)), np.hstack((right, a[:, -1:]))


def _knot_sums(data: SplineData, after: FloatArray, before: FloatArray) -> tuple[_Sums, _Sums]:
    """Make the sums for A and B of all intervals, from the distances of knots to their ends."""
    x, y, v = data.waypoint_times, data.y, data.dydx
    h = np.diff(x)
    p, b = after / h, before / h
    q, p_rest = (data.left[1:] - x[:-1]) / h, (x[1:] - data.right[:-1]) / h
    move, v0, v1 = 6.0 * np.diff(y) / h, 2.0 * v[:, :-1], 2.0 * v[:, 1:]
    return (
        _Sums(
            -p * (1.0 + q) / q,
            p_rest * b / q,
            (move - (1.0 + p + q) * v0 - (p_rest + b) * v1) / (h * q),
        ),
        _Sums(
            p * q / p_rest,
            -b * (1.0 + p_rest) / p_rest,
            ((p + q) * v0 + (1.0 + p_rest + b) * v1 - move) / (h * p_rest),
        ),
    )


def solve_tridiagonal(
    lower: FloatArray, diagonal: FloatArray, upper: FloatArray, rhs: FloatArray
) -> FloatArray:
    """Solve A X = B for a tridiagonal M-matrix A, without pivoting, in NumPy alone.

    The systems of this package have a positive diagonal and negative off-diagonals, and their
    leading principal minors are positive. Each minor belongs to a shorter interpolation problem,
    which has exactly one solution for all admissible knots. Thus no minor changes its sign between
    these knots and the paper's knots, for which the matrix is strictly diagonally dominant. Such a
    matrix is a nonsingular M-matrix, and with alternating signs of its rows and columns it is
    totally nonnegative.

    The elimination of unknowns of an M-matrix gives M-matrices, in any order. Only positive numbers
    are subtracted from the diagonal, no entry grows, and |L||U| = |A|. The computed solution then
    solves a system in which every entry has an error of a few roundings, for any scaling of the
    rows. With pivoting, which mixes rows of very different size, this would not hold.

    The order here is cyclic reduction. Each step eliminates every other unknown and gives a
    tridiagonal system of half the size. This is linear in n, and works on whole arrays and on all
    right-hand sides together. It needs no SciPy, whose import takes longer than the solution.

    Args:
        lower: A[i+1, i] <= 0, shape (n-1,).
        diagonal: A[i, i] > 0, shape (n,).
        upper: A[i, i+1] <= 0, shape (n-1,).
        rhs: Right-hand sides as rows, B transposed, shape (d, n).

    Returns:
        The solutions as rows, shape (d, n).
    """
    n = diagonal.size
    if n == 1:
        return np.asarray(rhs / diagonal)
    # even rows are eliminated; odd row k is between the even rows k and k + 1 (if it exists)
    odds, rights = n // 2, (n - 1) // 2
    even = diagonal[0::2]
    to_left, to_right = lower[0::2] / even[:odds], upper[1::2] / even[1 : rights + 1]
    reduced_diagonal = diagonal[1::2] - to_left * upper[0::2]
    reduced_diagonal[:rights] -= to_right * lower[1::2]
    reduced = rhs[:, 1::2] - to_left * rhs[:, 0::2][:, :odds]
    reduced[:, :rights] -= to_right * rhs[:, 2::2]
    odd = solve_tridiagonal(
        -to_left[1:] * lower[1::2][: odds - 1],
        reduced_diagonal,
        -to_right[: odds - 1] * upper[2::2],
        reduced,
    )
    solution = np.array(rhs)
    solution[:, 1::2] = odd
    solution[:, 0::2][:, :odds] -= odd * upper[0::2]
    solution[:, 2::2] -= odd[:, :rights] * lower[1::2]
    solution[:, 0::2] /= even
    return solution
