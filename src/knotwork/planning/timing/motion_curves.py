"""Curves of motions: from the solver's variables, in sequence, reversed, and slowed down."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.from_accelerations import (
    correct_accelerations,
    cubics_from_accelerations,
)


def exact_curve(
    time: FloatArray,
    share: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> PiecewisePolynomial:
    """The C2 cubic curve that meets all positions and velocities to rounding.

    The solver meets them only within its tolerance. Accelerations at the waypoints stay; those
    between them get the minimum-norm correction.

    Args:
        time: Times of the waypoints [s], shape (n,).
        share: Duration of each piece relative to its interval, shape (n-1, pieces), row sums 1.
        position: Positions at the waypoints, shape (n, d).
        velocity: Velocities at the waypoints, shape (n, d).
        acceleration: Accelerations at the ends of the pieces, shape (n-1, pieces + 1, d), equal at
            a waypoint in both adjoining intervals.
    """
    inner = np.cumsum(share[:, :-1], axis=1) * np.diff(time)[:, None]
    breaks = np.append(np.hstack((time[:-1, None], time[:-1, None] + inner)).ravel(), time[-1])
    span = np.diff(breaks).reshape(share.shape)  # the exact floating-point differences
    a = correct_accelerations(span, acceleration, position, velocity)
    return PiecewisePolynomial(cubics_from_accelerations(span, a, position, velocity), breaks)


def concatenate(*motions: PiecewisePolynomial | None) -> PiecewisePolynomial:
    """Concatenate motions, each from time 0 on, without those that are `None`."""
    present = [part for part in motions if part is not None]
    starts = np.cumsum([0.0, *(part.x[-1] for part in present)])
    x = [start + part.x[:-1] for start, part in zip(starts[:-1], present, strict=True)]
    return PiecewisePolynomial(
        np.concatenate([part.c for part in present], axis=1),
        np.append(np.concatenate(x), starts[-1]),
    )


def slow_down(curve: PiecewisePolynomial, factor: float) -> PiecewisePolynomial:
    """A cubic motion that begins at time 0, slowed down by a constant factor."""
    scale = factor ** -np.arange(3.0, -1.0, -1.0)
    return PiecewisePolynomial(curve.c * scale[:, None, None], factor * curve.x)


def reverse(curve: PiecewisePolynomial) -> PiecewisePolynomial:
    """A cubic motion that begins at time 0, reversed."""
    span = np.diff(curve.x)[:, None]
    a, b, c, d = curve.c
    turned = (-a, b + 3.0 * a * span, -c - (2.0 * b + 3.0 * a * span) * span)
    at_end = d + (c + (b + a * span) * span) * span
    return PiecewisePolynomial(np.stack((*turned, at_end))[:, ::-1], curve.x[-1] - curve.x[::-1])
