"""Candidates for extrema of polynomials of any degree inside their pieces, vectorised.

Everything is in the unit variable s in [0, 1] of a piece. A returned point need not be a root of
the derivative. If there is no root, another point of the piece replaces it. This does no harm in a
search for the largest and smallest values.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb

import numpy as np

from knotwork.arrays import BoolArray, FloatArray

NEWTON_STEPS = 128
"""Maximum number of safeguarded Newton steps.

Each at least halves the previous step or the bracket, and 53 halvings exhaust the digits.
"""

ROOT_RESOLUTION = 1e-14
"""Length of the bracket, in the unit of the piece, at which the search ends."""

LAST_STEP = 1e-9
"""Newton step at which the search ends.

The next step would be its square, and values at the points depend on their errors only to second
order.
"""


def horner(c: FloatArray, s: FloatArray) -> FloatArray:
    """Evaluate polynomials with coefficients c[k, ...], highest power first, at s[..., ...]."""
    if len(c) == 1:
        return np.asarray(c[0] + 0.0 * s)
    value: FloatArray = c[0] * s
    value += c[1]
    for coefficient in c[2:]:
        value *= s
        value += coefficient
    return value


def differentiate(c: FloatArray) -> FloatArray:
    """Differentiate polynomials with coefficients c[k, ...], highest power first."""
    powers = np.arange(c.shape[0] - 1, 0, -1.0)
    return np.asarray(c[:-1] * powers.reshape(-1, *[1] * (c.ndim - 1)))


@lru_cache(maxsize=64)
def to_bernstein(degree: int) -> FloatArray:
    """Matrix that turns coefficients, lowest power first, into Bernstein coefficients on [0, 1]."""
    return np.array(
        [[comb(i, j) / comb(degree, j) for j in range(degree + 1)] for i in range(degree + 1)]
    )


def find_critical_points(c: FloatArray) -> FloatArray:
    """Points that include all inner extrema of polynomials on [0, 1].

    Degrees up to three are solved in closed form. For higher degrees, the roots of each derivative
    divide [0, 1] into intervals on which the next lower derivative is monotone, so that its root is
    bracketed.

    Args:
        c: Coefficients in the unit variable, shape (k+1, ...), highest power first.

    Returns:
        Points in [0, 1], ascending along the first axis, shape (max(k-1, 0), ...).
    """
    degree = c.shape[0] - 1
    if degree <= 1:
        return np.empty((0, *c.shape[1:]))
    slope = differentiate(c)
    # the roots do not depend on the scale, but products of tiny or huge coefficients exceed the
    # range
    scale = np.abs(slope).max(axis=0)
    slope /= np.where(scale > 0.0, scale, 1.0)
    if degree == 2:
        return _find_linear_root(slope)
    if degree == 3:
        return _find_quadratic_roots(slope)
    return _find_bracketed_roots(slope, find_critical_points(slope))


def _clip_to_piece(s: FloatArray) -> FloatArray:
    """Replace values outside [0, 1] and NaN by 0."""
    return np.where((s >= 0.0) & (s <= 1.0), s, 0.0)


def _find_linear_root(c: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return _clip_to_piece(-c[1:] / c[:1])


def _find_quadratic_roots(c: FloatArray) -> FloatArray:
    """Find the roots of c[0] s² + c[1] s + c[2]. The first coefficient may be zero.

    One root would lose digits by cancellation, so it follows from the product of both. A
    discriminant slightly below zero is a double root of the slope up to rounding, which is not an
    extremum.
    """
    a, b, constant = c
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = np.sqrt(b * b - 4.0 * a * constant)
        q = -0.5 * (b + np.copysign(root, b))
        return np.sort(_clip_to_piece(np.stack((q / a, constant / q))), axis=0)


def _find_bracketed_roots(c: FloatArray, cuts: FloatArray) -> FloatArray:
    """One point for each interval between the cuts: the root of c there, if it exists.

    Args:
        c: Coefficients in the unit variable, shape (k+1, ...), monotone between the cuts.
        cuts: Ascending points in [0, 1], shape (k-1, ...).

    Returns:
        Ascending points, shape (k, ...).
    """
    low = np.concatenate((np.zeros((1, *cuts.shape[1:])), cuts))
    high = np.concatenate((cuts, np.ones((1, *cuts.shape[1:]))))
    at_low, at_high = horner(c, low), horner(c, high)
    point = np.where(np.abs(at_low) <= np.abs(at_high), low, high)
    is_bracketed = np.sign(at_low) * np.sign(at_high) < 0.0
    columns = np.broadcast_to(c[:, None], (len(c), *low.shape))[:, is_bracketed]
    point[is_bracketed] = _refine_roots(
        columns, low[is_bracketed], high[is_bracketed], at_high[is_bracketed] > 0.0
    )
    return point


def _refine_roots(
    c: FloatArray, low: FloatArray, high: FloatArray, rising: BoolArray
) -> FloatArray:
    """Find roots of polynomials c[k, r] in brackets [low[r], high[r]] with a change of sign.

    A Newton step is used if it stays in the bracket and is at most half of the previous step.
    Otherwise the bracket is bisected, so that multiple roots converge as well.
    """
    slope = differentiate(c)
    point, step = 0.5 * (low + high), high - low
    roots, index = np.empty_like(point), np.arange(point.size)
    for _ in range(NEWTON_STEPS):
        value = horner(c, point)
        is_below = (value < 0.0) == rising
        low, high = np.where(is_below, point, low), np.where(is_below, high, point)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            newton = point - value / horner(slope, point)
        inside = (newton > low) & (newton < high) & (np.abs(newton - point) <= 0.5 * step)
        inside |= value == 0.0
        following = np.where(value == 0.0, point, np.where(inside, newton, 0.5 * (low + high)))
        step, point = np.abs(following - point), following
        roots[index] = point
        going = ~((inside & (step <= LAST_STEP)) | (high - low <= ROOT_RESOLUTION))
        if not going.any():
            break
        c, slope, index, rising = c[:, going], slope[:, going], index[going], rising[going]
        low, high, point, step = low[going], high[going], point[going], step[going]
    return roots
