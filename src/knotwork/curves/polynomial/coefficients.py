"""Checks of coefficients of piecewise polynomials, and of orders of derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.critical_points import horner
from knotwork.errors import InputError

MAX_DEGREE = 30
"""Degree above which a curve is refused.

No planner makes such curves, rounding errors are large, and extrema take minutes.
"""
MAX_TERM = 1e200
"""Size above which numbers are refused, so that neither values nor derivatives overflow."""


def checked_order(nu: Any, name: str = "derivative order nu") -> int:
    """Check the order of a derivative, and return it as an integer.

    Raises:
        InputError: The order is not an integer, or negative.
    """
    if not isinstance(nu, int | np.integer) or isinstance(nu, bool) or nu < 0:
        raise InputError(f"{name} is {nu!r}; it must be an integer, 0 or greater")
    return int(nu)


def _limit_degree(c: FloatArray) -> FloatArray:
    """Return coefficients without leading zeros above the maximum degree.

    Raises:
        InputError: The degree is too high.
    """
    excess = c.shape[0] - 1 - MAX_DEGREE
    if excess <= 0:
        return c
    if c[:excess].any():
        is_needed = c.reshape(c.shape[0], -1).any(axis=1)
        degree = c.shape[0] - 1 - int(is_needed.argmax())
        raise InputError(f"the degree is {degree}; at most {MAX_DEGREE} is accepted")
    return np.ascontiguousarray(c[excess:])


def _check_magnitudes(c: FloatArray, x: FloatArray) -> None:
    """Check that the sum of the terms' magnitudes is small enough for derivatives.

    Raises:
        InputError: The sum of the terms is too large within a piece, or within 1 s.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        span = np.maximum(np.diff(x), 1.0)
        reached = horner(np.abs(c), span.reshape(-1, *[1] * (c.ndim - 2)))
    if not (reached <= MAX_TERM).all():
        piece = int(np.argwhere(~(reached <= MAX_TERM))[0][0])
        raise InputError(
            f"the terms of piece {piece + 1} reach {reached[piece].max():.6g} within "
            f"{span[piece]:.6g} s; at most {MAX_TERM:g} is accepted"
        )


def checked_coefficients(c: ArrayLike, breaks: FloatArray, axis: int) -> FloatArray:
    """Copy coefficients with the axes of powers and pieces in front.

    Args:
        c: Coefficients, as for `PiecewisePolynomial`.
        breaks: Breaks of the pieces, shape (m+1,).
        axis: Index of the axis of powers.

    Returns:
        Shape (k+1, m, ...).

    Raises:
        InputError: Coefficients are complex, not finite or above 1e200, do not fit the breaks or
            the axis, or have a degree above 30.
    """
    coefficients = np.asarray(c)
    if coefficients.dtype.kind not in "buif":
        raise InputError(f"coefficients must be real numbers, not {coefficients.dtype}")
    if coefficients.ndim < 2 or not 0 <= axis < coefficients.ndim - 1:
        raise InputError(
            f"coefficients have shape {coefficients.shape}, axis is {axis}; axes {axis} and "
            f"{axis + 1} of the coefficients must be those of powers and pieces"
        )
    coefficients = np.moveaxis(coefficients, (axis, axis + 1), (0, 1))
    if coefficients.shape[0] == 0 or coefficients.shape[1] != breaks.size - 1:
        raise InputError(
            f"{breaks.size} breaks bound {breaks.size - 1} pieces; the coefficients have "
            f"{coefficients.shape[0]} powers and {coefficients.shape[1]} pieces"
        )
    if not np.isfinite(coefficients).all():
        index = np.argwhere(~np.isfinite(coefficients))[0]
        raise InputError(
            f"coefficient {index.tolist()} is {coefficients[tuple(index)]}; "
            "every coefficient must be finite"
        )
    result = _limit_degree(np.array(coefficients, dtype=float, order="C"))
    _check_magnitudes(result, breaks)
    return result
