"""Tridiagonal M-matrices: a direct solver without pivoting, in NumPy alone.

The systems of this package have a positive diagonal and negative off-diagonals, and their leading
principal minors are positive: each belongs to a shorter interpolation problem, which has exactly
one solution wherever the knots are admissible, so no minor changes sign between those knots and
the paper's, where the matrix is strictly diagonally dominant. Such a matrix is a nonsingular
M-matrix, and with alternating signs of its rows and columns it is totally nonnegative.

Eliminating the unknowns of an M-matrix, in whatever order, leaves M-matrices: nothing but positive
numbers is subtracted from the diagonal, nothing grows, |L||U| = |A|. The computed solution then
solves a system in which every entry is off by a few roundings only, row by row, however the rows
are scaled. Pivoting would mix rows of very different size, and lose that.

The order here is cyclic reduction: every other unknown is eliminated at once, which leaves a
tridiagonal system of half the size. That is linear in n, works on whole arrays and on all
right-hand sides together, and needs no SciPy, the import of which takes longer than solving. The
last few unknowns are eliminated one after the other: arrays would take longer for them.
"""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray

BLOCK = 49152
"""Values of the right-hand sides that are worked on together."""

FEW = 256
"""Values of the right-hand sides that are worked on one after the other, in plain Python."""


def solve_tridiagonal(
    lower: FloatArray, diagonal: FloatArray, upper: FloatArray, rhs: FloatArray
) -> FloatArray:
    """Solve A X = B for a tridiagonal M-matrix A.

    Args:
        lower: A[i+1, i] <= 0, shape (n-1,).
        diagonal: A[i, i] > 0, shape (n,).
        upper: A[i, i+1] <= 0, shape (n-1,).
        rhs: Right-hand sides as rows, B transposed, shape (d, n); overwritten by the solutions.

    Returns:
        The solutions as rows, shape (d, n): `rhs`.
    """
    n = diagonal.size
    if rhs.size <= FEW or n == 1:
        rows = _one_by_one(lower.tolist(), diagonal.tolist(), upper.tolist(), rhs.tolist())
        rhs[:] = np.reshape(rows, rhs.shape)
        return rhs
    # even rows are eliminated; odd row k lies between the even rows k and, if there is one, k + 1
    rights = (n - 1) // 2
    even_diagonal = diagonal[0::2]
    to_left = lower[0::2] / even_diagonal[: n // 2]
    to_right = upper[1::2] / even_diagonal[1 : rights + 1]
    reduced_diagonal = diagonal[1::2] - to_left * upper[0::2]
    reduced_diagonal[:rights] -= to_right * lower[1::2]
    reduced_lower = -to_left[1:] * lower[1::2][: n // 2 - 1]
    reduced_upper = -to_right[: n // 2 - 1] * upper[2::2]

    reduced = np.empty((rhs.shape[0], n // 2))
    step = max(16, BLOCK // max(1, rhs.shape[0]))
    for low in range(0, n // 2, step):
        high = min(low + step, n // 2)
        last = min(high, rights)
        even = rhs[:, 2 * low : 2 * high + 1 : 2]
        own = reduced[:, low:high]
        np.multiply(even[:, : high - low], to_left[low:high], out=own)
        own[:, : last - low] += even[:, 1 : last - low + 1] * to_right[low:last]
        np.subtract(rhs[:, 2 * low + 1 : 2 * high : 2], own, out=own)
    solve_tridiagonal(reduced_lower, reduced_diagonal, reduced_upper, reduced)

    for low in range(0, n // 2, step):
        high = min(low + step, n // 2)
        last = min(high, rights)
        odd = reduced[:, low:high]
        rhs[:, 2 * low + 1 : 2 * high : 2] = odd
        even = rhs[:, 2 * low : 2 * high : 2]
        # this also updates the row right of the last odd one; the next block divides it
        rhs[:, 2 * low + 2 : 2 * last + 1 : 2] -= (
            odd[:, : last - low] * lower[2 * low + 1 : 2 * last : 2]
        )
        even -= odd * upper[2 * low : 2 * high : 2]
        even /= even_diagonal[low:high]
    if n % 2:
        rhs[:, -1] /= diagonal[-1]
    return rhs


def _one_by_one(
    lower: list[float], diagonal: list[float], upper: list[float], rhs: list[list[float]]
) -> list[list[float]]:
    """Solve a small system by elimination from the top; the solutions are rows, as `rhs` is."""
    pivot, pivots, factors = diagonal[0], diagonal[:1], []
    for below, above, entry in zip(lower, upper, diagonal[1:], strict=True):
        factor = below / pivot
        pivot = entry - factor * above
        factors.append(factor)
        pivots.append(pivot)
    back = list(zip(upper[::-1], pivots[-2::-1], strict=True))
    solutions = []
    for row in rhs:
        value, left = row[0], row[:1]
        for factor, entry in zip(factors, row[1:], strict=True):
            value = entry - factor * value
            left.append(value)
        value = left.pop() / pivot
        found = [value]
        for (above, divisor), entry in zip(back, left[::-1], strict=True):
            value = (entry - above * value) / divisor
            found.append(value)
        solutions.append(found[::-1])
    return solutions


def solve_accelerations(diagonal: FloatArray, between: FloatArray, rhs: FloatArray) -> FloatArray:
    """Solve the symmetric tridiagonal system of the accelerations of a C2 cubic spline.

    An interval has the length h, the mean velocity s and the accelerations a0 and a1 at its ends.
    The cubic through its end positions has the velocities s - h (2 a0 + a1)/6 at its start and
    s + h (a0 + 2 a1)/6 at its end. They agree where two intervals meet:

        h₋ a₋ / 6 + (h₋ + h₊) a / 3 + h₊ a₊ / 6 = s₊ - s₋.

    The matrix is diagonally dominant with positive entries. Counting every other acceleration with
    the opposite sign turns it into an M-matrix.

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
