"""Bernstein polynomials, and bounds of rotation rates from their coefficients on subintervals.

A polynomial is a mean of its Bernstein coefficients, so their maximum is an upper bound.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from knotwork.arrays import FloatArray, IndexArray


def bernstein_values(degree: int, u: FloatArray) -> FloatArray:
    """Evaluate all Bernstein polynomials of a degree, shape (degree + 1, *u.shape)."""
    v = 1.0 - u
    return np.array([math.comb(degree, i) * u**i * v ** (degree - i) for i in range(degree + 1)])


def bernstein_sums(values: FloatArray) -> FloatArray:
    """Sums of the Bernstein polynomials i to n, for i = 1 … n, shape (n, k)."""
    return np.asarray(np.cumsum(values[:0:-1], axis=0)[::-1])


def restrict_to_interval(coefficients: FloatArray, u0: FloatArray, u1: FloatArray) -> FloatArray:
    """Restrict polynomials to [u0, u1]: their Bernstein coefficients there.

    By the algorithm of de Casteljau: coefficient j of degree n takes n - j steps at u0, j at u1.

    Args:
        coefficients: Coefficients on [0, 1], shape (n + 1, k).
        u0: Starts of the intervals, shape (k,).
        u1: Ends of the intervals, shape (k,).

    Returns:
        Coefficients, shape (n + 1, k).
    """

    def step(values: FloatArray, u: FloatArray) -> FloatArray:
        return values[:-1] + u * (values[1:] - values[:-1])

    result = []
    for steps_at_end in reversed(range(len(coefficients))):
        value = coefficients
        for _ in range(steps_at_end):
            value = step(value, u1)
        result.append(value[0])
        coefficients = step(coefficients, u0)
    return np.array(result[::-1])


class TurnBounds:
    """Bounds of |ω| and |dω/du| on parts of pieces, ω the rotation per unit of u.

    With ai the axes vi in base axes, fi' = 5 B(i-1) of degree 4 and fi'' the difference of two
    cubic ones:

        ω = Σ fi' ai              dω/du = 20 Σ Bk (a(k+2) - a(k+1)) + Σ(j<i) fj' fi' aj × ai

    with k = 0…3. Joint i does not turn its own axis: |a(i+1) - ai| = |v(i+1) - vi| and, for
    neighbours, |aj × ai| = |vj × vi|. Beyond neighbours each joint between turns vi by at most
    |vk × vi|, so |aj × ai| <= |vj × vi| + |vj| Σ(j<k<i) |vk × vi|. If all axes are the same,
    the bounds are exact.

    Attributes:
        whole: Bounds of both on whole pieces, shape (m,) each.
    """

    def __init__(self, v: FloatArray) -> None:
        size = np.linalg.norm(v, axis=2).T
        cross = np.linalg.norm(np.cross(v[:, :, None], v[:, None]), axis=3)
        self.rate = 5.0 * size
        self.steps = 20.0 * np.linalg.norm(np.diff(v, axis=1), axis=2).T
        self.products = np.zeros((9, len(v)))
        for j, i in itertools.combinations(range(5), 2):
            aside = cross[:, j, i] + size[j] * cross[:, j + 1 : i, i].sum(axis=1)
            weight = 25.0 * math.comb(4, i) * math.comb(4, j) / math.comb(8, i + j)
            self.products[i + j] += weight * np.minimum(aside, size[i] * size[j])
        rate, steps, products = (x.max(axis=0) for x in (self.rate, self.steps, self.products))
        self.whole = rate, steps + products

    def __call__(
        self, piece: IndexArray, u0: FloatArray, u1: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bounds of |ω| and |dω/du| on [u0, u1] of pieces, shape (k,)."""
        rate, steps, products = (
            restrict_to_interval(coefficients[:, piece], u0, u1).max(axis=0)
            for coefficients in (self.rate, self.steps, self.products)
        )
        return rate, steps + products
