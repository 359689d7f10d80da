"""Pieces of odd degree from positions and derivatives at their ends (Hermite interpolation)."""

from __future__ import annotations

import math

import numpy as np

from knotwork.arrays import FloatArray


def two_point_coefficients(t: FloatArray, derivatives: tuple[FloatArray, ...]) -> FloatArray:
    """Compute the polynomials that take given derivatives 0 … k-1 at both ends.

    With s = (t - t0)/h from 0 to 1, a piece is p(s) = D(s) + s^k Q(s). D is its Taylor polynomial
    at s = 0. Q, of degree k - 1, removes the residual of D at s = 1. If the residual has the Taylor
    coefficients R_i there, Q is the truncated series of s^-k (sum over i of R_i (s - 1)^i) about s
    = 1. Two cases of it are Eqs. (5), (6), with k = 2, and Eqs. (7), (8), with k = 3.

    Args:
        t: Times, shape (n,).
        derivatives: Positions, velocities, … at these times, shape (n, d) each.

    Returns:
        Coefficients in the local time of each piece, shape (2k, n-1, d), highest power first.
    """
    k = len(derivatives)
    h = np.diff(t)[:, None]
    c = np.empty((2 * k, h.size, derivatives[0].shape[1]))
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        powers = [h**i for i in range(2 * k)]
        taylor = [y * (1.0 / math.factorial(i)) if i > 1 else y for i, y in enumerate(derivatives)]
        # the difference of positions comes first, because it cancels their common part without
        # rounding
        residual = [
            (y[1:] - y[:-1]) * powers[i] if i else y[1:] - y[:-1] for i, y in enumerate(taylor)
        ]
        for m in range(1, k):
            start = taylor[m][:-1] * powers[m]
            for i in range(m):
                residual[i] -= math.comb(m, i) * start
        for p, row in enumerate(_closing_weights(k)):
            terms = [r if w == 1 else w * r for w, r in zip(row, residual, strict=True) if w]
            np.divide(sum(terms[1:], terms[0]), powers[k + p], out=c[k - 1 - p])
        for i, y in enumerate(taylor):
            c[2 * k - 1 - i] = y[:-1]
    return c


def _closing_weights(k: int) -> list[list[int]]:
    """Weights W of Q(s) = sum over p, i of W[p][i] R_i s^p: integers, exact."""
    weights = [[0] * k for _ in range(k)]
    for i in range(k):
        for order in range(i, k):
            # coefficient of (s - 1)^order in s^-k (s - 1)^i
            series = (-1) ** (order - i) * math.comb(k + order - i - 1, order - i)
            for p in range(order + 1):
                weights[p][i] += series * math.comb(order, p) * (-1) ** (order - p)
    return weights


def raise_degree(c: FloatArray, degree: int) -> FloatArray:
    """Write coefficients of polynomials with a higher degree."""
    return np.concatenate((np.zeros((degree + 1 - c.shape[0], *c.shape[1:])), c))
