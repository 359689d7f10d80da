"""Insertion of breaks into curves, and cutting of curves."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.polynomial.piecewise import PiecewisePolynomial


def split_at(curve: PiecewisePolynomial, times: FloatArray) -> PiecewisePolynomial:
    """Insert breaks into a curve.

    >>> parabola = PiecewisePolynomial([[1], [0], [0]], [0, 2])  # t²
    >>> split_at(parabola, [1.0]).c.T
    array([[1., 0., 0.],
           [1., 2., 1.]])

    Args:
        curve: A curve along axis 0.
        times: Additional breaks, within the curve's time.
    """
    breaks = sort_distinct(curve.x, times)
    piece = np.clip(np.searchsorted(curve.x, breaks[:-1], side="right") - 1, 0, len(curve.x) - 2)
    shift = (breaks[:-1] - curve.x[piece]).reshape(-1, *[1] * (curve.c.ndim - 2))
    return PiecewisePolynomial(shift_origin(curve.c[:, piece], shift), breaks)


def shift_origin(c: FloatArray, shift: FloatArray) -> FloatArray:
    """Expand polynomials about another point, by synthetic division for each coefficient.

    >>> shift_origin(np.array([1.0, 0.0, 0.0]), np.array(1.0))  # t² = (t - 1)² + 2 (t - 1) + 1
    array([1., 2., 1.])

    Args:
        c: Coefficients along axis 0, highest power first.
        shift: The new origin, of a shape that multiplies `c[0]`.
    """
    c = np.array(c)
    for end in range(c.shape[0], 1, -1):
        for k in range(1, end):
            c[k] += shift * c[k - 1]
    return c


def cut_curve(curve: PiecewisePolynomial, start: float, end: float) -> PiecewisePolynomial:
    """Cut a part out of a curve.

    >>> parabola = PiecewisePolynomial([[1], [0], [0]], [0, 2])  # t²
    >>> middle = cut_curve(parabola, 0.5, 1.0)
    >>> middle.x, middle(1.0)
    (array([0.5, 1. ]), array(1.))

    Args:
        curve: A curve along axis 0.
        start: Time within the curve's.
        end: Time within the curve's, after the start.
    """
    fine = split_at(curve, np.array([start, end]))
    first, last = np.searchsorted(fine.x, (start, end))
    return PiecewisePolynomial(fine.c[:, first:last], fine.x[first : last + 1])
