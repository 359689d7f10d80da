"""Bernstein polynomials: their values, and their coefficients on subintervals of [0, 1].

A polynomial is a mean of its Bernstein coefficients, so their maximum is an upper bound.
"""

from __future__ import annotations

import math

import numpy as np

from knotwork.waypoints import FloatArray


def basis(degree: int, u: FloatArray) -> FloatArray:
    """Values of the Bernstein polynomials of a degree, shape (degree + 1, *u.shape)."""
    v = 1.0 - u
    return np.array([math.comb(degree, i) * u**i * v ** (degree - i) for i in range(degree + 1)])


def sums_of_basis(values: FloatArray) -> FloatArray:
    """Sums of the Bernstein polynomials i to n, for i = 1 … n, shape (n, k)."""
    return np.asarray(np.cumsum(values[:0:-1], axis=0)[::-1])


def on_interval(coefficients: FloatArray, u0: FloatArray, u1: FloatArray) -> FloatArray:
    """Bernstein coefficients of polynomials on [u0, u1] instead of [0, 1].

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
    values = coefficients
    for layer in range(coefficients.shape[0]):
        value = values
        for _ in range(coefficients.shape[0] - 1 - layer):
            value = step(value, u1)
        result.append(value[0])
        if len(values) > 1:
            values = step(values, u0)
    return np.array(result[::-1])
