"""Composition of a motion with a clock, exactly and as a cubic curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.errors import InputError
from knotwork.spline.interpolation import ModifiedHermiteSpline
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.distinct import distinct
from knotwork.spline.polynomial.refined import split_at
from knotwork.spline.polynomial.two_point import raise_degree
from knotwork.spline.retiming.clock import inverse_time
from knotwork.waypoints import FloatArray

MOST_HALVINGS = 8
# Breaks within this fraction of the duration are one.
SAME_BREAK = 1e-9


def compose(curve: PiecewisePolynomial, clock: PiecewisePolynomial) -> PiecewisePolynomial:
    """The exact composition q(τ(t)) of a curve q and a clock τ, as smooth as both.

    Args:
        curve: Values over the clock's values, trailing shape (d,).
        clock: Time of the curve over time, never decreasing.

    Returns:
        A curve over the clock's time; its degree is the product of both.
    """
    shown = clock(clock.x[[0, -1]])
    inner = curve.x[(curve.x > shown[0]) & (curve.x < shown[1])]
    times = inverse_time(clock, inner)
    near = SAME_BREAK * (clock.x[-1] - clock.x[0])
    times = times[np.abs(times[:, None] - clock.x).min(axis=1, initial=np.inf) > near]
    fine = split_at(clock, times)
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


def cubic_through(
    curve: PiecewisePolynomial, tolerance: float, through: Sequence[float] = ()
) -> tuple[PiecewisePolynomial, FloatArray]:
    """A curve of cubics (C2 smooth) that deviates from a C2 smooth one by at most a tolerance.

    At every break of the curve, and at given times, position, velocity and acceleration are equal.
    Between them the modified cubic Hermite method places knots. Steps are halved until the
    deviation, computed from the polynomials and not from samples, is within the tolerance.

    Args:
        curve: A curve of any degree, trailing shape (d,).
        tolerance: Maximum deviation of a component, in its unit.
        through: Additional times at which the curves are equal, within the curve's time.

    Returns:
        The cubics, and the maximum deviation of each component, shape (d,).

    Raises:
        InputError: The tolerance is not met with steps of 1/256 of those of the curve.
    """
    times = distinct(curve.x, np.array(through))
    for _ in range(MOST_HALVINGS + 1):
        q, v, a = (curve(times, nu) for nu in range(3))
        cubics = ModifiedHermiteSpline(times, q, v, acceleration=a, end_acceleration=(a[0], a[-1]))
        exact, fine = split_at(curve, cubics.x), split_at(cubics, curve.x)
        c = exact.c - raise_degree(fine.c, exact.degree)
        gap = PiecewisePolynomial(c, exact.x).extrema(0).peak
        if gap.max() <= tolerance:
            # cubic pieces are kept: rounding would change their third derivative
            is_cubic = np.logical_not(exact.c[:-4].any(axis=(0, 2)))
            c = np.where(is_cubic.reshape(-1, 1), exact.c[-4:], fine.c)
            return PiecewisePolynomial(c, exact.x), gap
        times = distinct(times, 0.5 * (times[1:] + times[:-1]))
    raise InputError(
        f"the retimed motion deviates by {gap.max():.3g} rad or m from the path; accepted: "
        f"a tolerance of {gap.max():.3g} or more, now {tolerance:g}"
    )
