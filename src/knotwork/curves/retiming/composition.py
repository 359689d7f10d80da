"""A curve over another clock: exactly, and as cubics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation import ModifiedHermiteSpline
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.polynomial.monotone import first_times
from knotwork.curves.polynomial.splitting import split_at
from knotwork.curves.polynomial.two_point import raise_degree
from knotwork.errors import InputError

MAX_STEP_HALVINGS = 8
"""Maximum number of halvings of the steps of cubics."""
BREAK_TOLERANCE = 1e-9
"""Difference relative to the duration within which breaks are equal."""

PATH_TOLERANCE = 1e-6
"""Largest deviation of a joint from its path [rad or m]."""


def compose(curve: PiecewisePolynomial, clock: PiecewisePolynomial) -> PiecewisePolynomial:
    """Compose a curve q and a clock τ exactly to q(τ(t)), which is as smooth as both.

    Args:
        curve: Values over the clock's values, trailing shape (d,).
        clock: Time of the curve over time, never decreasing.

    Returns:
        A curve over the clock's time; its degree is the product of both.
    """
    start, end = clock(clock.x[[0, -1]])
    inner = curve.x[(curve.x > start) & (curve.x < end)]
    times = first_times(clock, inner)
    fine = split_at(clock, _drop_breaks(times, clock.x))
    middle = fine(0.5 * (fine.x[1:] + fine.x[:-1]))
    piece = np.clip(np.searchsorted(curve.x, middle, side="right") - 1, 0, len(curve.x) - 2)
    inside = np.array(fine.c)
    inside[-1] -= curve.x[piece]
    # Horner's rule with the clock's polynomial in place of a number
    c = curve.c[:1, piece]
    for row in curve.c[1:, piece]:
        product = np.zeros((len(c) + len(inside) - 1, *c.shape[1:]))
        for power, factor in enumerate(inside):
            product[power : power + len(c)] += factor[:, None] * c
        product[-1] += row
        c = product
    return PiecewisePolynomial(c, fine.x)


def approximate_by_cubics(
    curve: PiecewisePolynomial, tolerance: float = PATH_TOLERANCE, through: Sequence[float] = ()
) -> tuple[PiecewisePolynomial, FloatArray]:
    """Approximate a C2 smooth curve by cubics (C2 smooth), to within a tolerance.

    At every break of the curve, and at given times, position, velocity and acceleration are equal.
    Between them the modified cubic Hermite method places knots. Steps are halved until the
    deviation is within the tolerance. It is computed from the polynomials and not from samples.

    Args:
        curve: A curve of any degree, trailing shape (d,).
        tolerance: Maximum deviation of a component, in its unit.
        through: Additional times at which the curves are equal, within the curve's time.

    Returns:
        The cubics, and the maximum deviation of each component, shape (d,).

    Raises:
        InputError: The tolerance is not met with steps of 1/256 of those of the curve.
    """
    times = sort_distinct(curve.x, _drop_breaks(np.array(through), curve.x))
    for _ in range(MAX_STEP_HALVINGS + 1):
        q, v, a = (curve(times, nu) for nu in range(3))
        cubics = ModifiedHermiteSpline(times, q, v, acceleration=a, end_acceleration=(a[0], a[-1]))
        exact, fine = split_at(curve, cubics.x), split_at(cubics, curve.x)
        c = exact.c - raise_degree(fine.c, exact.degree)
        deviation = PiecewisePolynomial(c, exact.x).extrema(0).peak
        if deviation.max() <= tolerance:
            # cubic pieces are kept: rounding would change their third derivative
            is_cubic = np.logical_not(exact.c[:-4].any(axis=(0, 2)))
            c = np.where(is_cubic.reshape(-1, 1), exact.c[-4:], fine.c)
            return PiecewisePolynomial(c, exact.x), deviation
        times = sort_distinct(times, 0.5 * (times[1:] + times[:-1]))
    raise InputError(
        f"the retimed motion deviates by {deviation.max():.3g} rad or m from the path, and the "
        f"tolerance is {tolerance:g}; accepted: {deviation.max():.3g} or more"
    )


def _drop_breaks(times: FloatArray, breaks: FloatArray) -> FloatArray:
    """Drop the times that are breaks within rounding."""
    after = np.searchsorted(breaks, times).clip(1, len(breaks) - 1)
    distance = np.minimum(np.abs(times - breaks[after - 1]), np.abs(times - breaks[after]))
    return np.asarray(times[distance > BREAK_TOLERANCE * np.ptp(breaks)])
