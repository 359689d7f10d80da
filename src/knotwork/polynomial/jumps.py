"""Jumps at the inner breaks, told from those that rounding makes."""

from __future__ import annotations

import numpy as np

from knotwork.polynomial.piecewise import PiecewisePolynomial
from knotwork.waypoints import FloatArray

CONTINUITY_TOLERANCE = 1e-9
"""A derivative counts as continuous if it jumps by less than this, relative to its peak.

Rounding makes jumps of about 1e-14; a controller's resolution is far coarser than 1e-9."""

ROUNDING = 64 * np.finfo(float).eps
"""Coefficients are rounded by up to this, relative to the largest term of their piece."""


def measured_jumps(curve: PiecewisePolynomial, nu: int) -> tuple[FloatArray, FloatArray]:
    """Measure the jumps of the nu-th derivative at the inner breaks.

    Args:
        curve: A curve of m breaks along axis 0, trailing shape (d,).
        nu: Order of the derivative.

    Returns:
        Absolute values, and each relative to the peak absolute value of its component, shape
        (m-2, d) both. A relative jump that rounding can explain is zero: noise about zero, as in
        the acceleration of a straight motion, does not count.
    """
    sizes = np.abs(curve.jumps(nu))
    peak = curve.extrema(nu).peak
    counted = np.where(sizes > rounding(curve, nu), sizes, 0.0)
    return sizes, np.divide(counted, peak, out=np.zeros_like(counted), where=counted > 0.0)


def rounding(curve: PiecewisePolynomial, nu: int) -> FloatArray:
    """Jump of the nu-th derivative that rounding can make at each inner break, shape (m-2, d).

    Each term c Hᵏ of a piece of length H carries the rounding of the largest of them.
    """
    h = np.diff(curve.x)[:, None]
    size = np.zeros(curve.c.shape[1:])
    for power, coefficient in enumerate(curve.c[::-1]):
        np.maximum(size, np.abs(coefficient) * h**power, out=size)
    size *= ROUNDING / h**nu
    return np.maximum(size[:-1], size[1:])


def allowed_jumps(curve: PiecewisePolynomial, nu: int) -> FloatArray:
    """The largest jump of the nu-th derivative at each inner break that counts as none.

    Args:
        curve: A curve of m breaks along axis 0, trailing shape (d,).
        nu: Order of the derivative.

    Returns:
        Shape (m-2, d), in the unit of the derivative.
    """
    return np.maximum(rounding(curve, nu), CONTINUITY_TOLERANCE * curve.extrema(nu).peak)
