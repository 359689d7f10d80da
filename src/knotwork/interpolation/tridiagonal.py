"""Gaussian elimination without pivoting for the tridiagonal systems of this package.

The diagonal is positive and the off-diagonals are negative, so with alternating signs of rows and
columns all entries are nonnegative; and all leading principal minors are positive, because each
belongs to a shorter interpolation problem that has one solution. Such a matrix is an M-matrix.
Elimination then subtracts nothing but makes no entry grow either: |L||U| = |A|, so the
computed solution solves a system whose every entry is perturbed by a few roundings only, row by
row, however the rows are scaled. Pivoting, as LAPACK's general solver does it, could mix rows of
very different size and lose that.
"""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray

LAPACK_SIZE = 512
"""From this many rows on LAPACK is used; below it, importing SciPy costs more than it saves."""


def solve_tridiagonal(
    lower: FloatArray, diagonal: FloatArray, upper: FloatArray, rhs: FloatArray
) -> FloatArray:
    """Solve A X = B for a tridiagonal M-matrix A, one factorisation for all right-hand sides.

    Args:
        lower: A[i+1, i] <= 0, shape (n-1,).
        diagonal: A[i, i] > 0, shape (n,).
        upper: A[i, i+1] <= 0, shape (n-1,).
        rhs: Right-hand sides as rows, B transposed, shape (d, n), C contiguous; overwritten.

    Returns:
        The solutions as rows, shape (d, n).
    """
    if diagonal.size < LAPACK_SIZE:
        return _eliminate(lower, diagonal, upper, rhs)
    return _with_lapack(lower, diagonal, upper, rhs)


def _eliminate(
    lower: FloatArray, diagonal: FloatArray, upper: FloatArray, rhs: FloatArray
) -> FloatArray:
    pivots, multipliers = diagonal.tolist(), []
    for i, (below, above) in enumerate(zip(lower.tolist(), upper.tolist(), strict=True)):
        multiplier = below / pivots[i]
        multipliers.append(multiplier)
        pivots[i + 1] -= multiplier * above
    rows = np.ascontiguousarray(rhs.T)
    for i, multiplier in enumerate(multipliers):
        rows[i + 1] -= multiplier * rows[i]
    rows[-1] /= pivots[-1]
    above = upper.tolist()
    for i in range(len(pivots) - 2, -1, -1):
        rows[i] = (rows[i] - above[i] * rows[i + 1]) / pivots[i]
    return np.ascontiguousarray(rows.T)


def _with_lapack(
    lower: FloatArray, diagonal: FloatArray, upper: FloatArray, rhs: FloatArray
) -> FloatArray:
    from scipy.linalg import lapack

    # The pivots depend on the off-diagonals only through their products: they are those of the
    # symmetric positive definite matrix with ones on the diagonal, which `pttrf` factors.
    coupling = lower * upper
    coupling /= diagonal[:-1]
    coupling /= diagonal[1:]
    pivots, _, info = lapack.dpttrf(np.ones(diagonal.size), np.sqrt(coupling))
    if info:
        raise ArithmeticError(f"leading minor {info} of the tridiagonal system is not positive")
    pivots *= diagonal
    solution, info = lapack.dgttrs(
        lower / pivots[:-1],
        pivots,
        upper,
        np.zeros(diagonal.size - 2),
        np.arange(1, diagonal.size + 1, dtype=np.int32),
        rhs.T,
        overwrite_b=True,
    )
    if info:
        raise ArithmeticError(f"LAPACK gttrs refused argument {-info}")
    return np.ascontiguousarray(solution.T)
