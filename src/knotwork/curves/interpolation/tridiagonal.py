"""Tridiagonal M-matrices: a direct solver without pivoting, in NumPy alone.

The systems of this package have a positive diagonal and negative off-diagonals, and their leading
principal minors are positive. Each minor belongs to a shorter interpolation problem, which has
exactly one solution for all admissible knots. So no minor changes its sign between these knots and
the paper's knots, for which the matrix is strictly diagonally dominant. Such a matrix is a
nonsingular M-matrix, and with alternating signs of its rows and columns it is totally nonnegative.

The elimination of unknowns of an M-matrix gives M-matrices, in any order. Only positive numbers are
subtracted from the diagonal, no entry grows, and |L||U| = |A|. The computed solution then solves a
system in which every entry has an error of a few roundings, for any scaling of the rows. With
pivoting, which mixes rows of very different size, this would not hold.

The order here is cyclic reduction. Each step eliminates every other unknown and gives a tridiagonal
system of half the size. This is linear in n, and works on whole arrays and on all right-hand sides
together. It needs no SciPy, whose import takes longer than the solution.
"""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray


def solve_tridiagonal(
    lower: FloatArray, diagonal: FloatArray, upper: FloatArray, rhs: FloatArray
) -> FloatArray:
    """Solve A X = B for a tridiagonal M-matrix A.

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
