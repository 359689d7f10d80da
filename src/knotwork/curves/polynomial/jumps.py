"""Jumps of a curve at its inner breaks, and bounds on those that rounding causes.

A jump counts if it is larger than 1e-9 of the peak of its quantity and larger than the effect of
rounding of coefficients and times, and in any case if it is larger than `ALWAYS_A_JUMP`. This last
rule does not depend on the curve, so no choice of breaks and no other part of the curve can
hide a jump.
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.critical_points import horner
from knotwork.curves.polynomial.piecewise import PiecewisePolynomial

CONTINUITY_TOLERANCE = 1e-9
"""Jump relative to the peak below which a derivative counts as continuous.

Rounding causes jumps of about 1e-14, and the resolution of controllers is far coarser than 1e-9.
"""

TERM_ROUNDING = 64 * np.finfo(float).eps
"""Rounding of coefficients, relative to the largest term of their piece."""

ALWAYS_A_JUMP = (1e-9, 1e-7, 1e-5)
"""A larger jump of position, velocity or acceleration counts on every curve [rad or m, per s,
per s²]. Rounding alone causes jumps of acceleration up to 8 · 2⁻⁵² · |q| / h² at pieces of length
h. This is more than the threshold below h = 30 µs (at |q| = 6), where it counts as a jump.
"""

TIME_STEP = 1e-9
"""Resolution of times in messages and drives [s]. A break that is moved by a time causes a jump of
this time multiplied by the jump of the next derivative."""

JUMP_WINDOW = 1e-6
"""Time within which jumps are added [s], because no drive distinguishes them."""


def measure_jumps(curve: PiecewisePolynomial, nu: int) -> tuple[FloatArray, FloatArray]:
    """Measure the jumps of the nu-th derivative at the inner breaks.

    Args:
        curve: A curve of m breaks along axis 0, trailing shape (d,).
        nu: Order of the derivative.

    Returns:
        Sum of the absolute jumps at each break and within `JUMP_WINDOW` after it, and the largest
        sum that does not count as a jump, shape (m-2, d) each. Noise about zero, as in the
        acceleration of a straight motion, does not count, nor does rounding of breaks to whole
        nanoseconds.
    """
    sizes = _sum_in_window(curve.x, np.abs(curve.jumps(nu)))
    moved = TIME_STEP * np.abs(curve.jumps(nu + 1))
    noise = _sum_in_window(curve.x, np.maximum(jump_rounding(curve, nu), moved))
    allowed = np.maximum(CONTINUITY_TOLERANCE * curve.extrema(nu).peak, noise)
    return sizes, np.minimum(allowed, ALWAYS_A_JUMP[nu]) if nu < len(ALWAYS_A_JUMP) else allowed


def jump_rounding(curve: PiecewisePolynomial, nu: int) -> FloatArray:
    """Bound the jumps of the nu-th derivative that rounding causes, shape (m-2, d).

    Each term c Hᵏ of a piece of length H has the rounding error of the largest term.
    """
    h = np.diff(curve.x)[:, None]
    size = np.zeros(curve.c.shape[1:])
    for power, coefficient in enumerate(curve.c[::-1]):
        np.maximum(size, np.abs(coefficient) * h**power, out=size)
    with np.errstate(over="ignore"):
        size *= TERM_ROUNDING / h**nu
    return np.maximum(size[:-1], size[1:])


def _sum_in_window(x: FloatArray, sizes: FloatArray) -> FloatArray:
    """Add to the size at each inner break those at the breaks that follow within `JUMP_WINDOW`."""
    inner = x[1:-1]
    if not (np.diff(inner) < JUMP_WINDOW).any():
        return sizes
    last = np.searchsorted(inner, inner + JUMP_WINDOW, side="left")
    sums = np.concatenate((np.zeros((1, sizes.shape[1])), np.cumsum(sizes, axis=0)))
    return np.asarray(np.maximum(sizes, sums[last] - sums[:-1]))


def evaluation_noise(curve: PiecewisePolynomial, orders: int) -> FloatArray:
    """Bound the rounding errors of computed derivatives, shape (orders, d).

    The error of Horner's scheme of degree k is at most 2 k · 2⁻⁵³ of the sum of the terms' sizes.
    """
    span = np.diff(curve.x)[:, None]
    noise = np.zeros((orders, curve.c.shape[2]))
    for order in range(min(orders, curve.degree + 1)):
        sizes = horner(np.abs(curve.derivative(order).c), span)
        noise[order] = curve.degree * np.finfo(float).eps * sizes.max(axis=0)
    return noise
