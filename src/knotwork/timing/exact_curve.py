"""Exact curve from the solver's durations and accelerations, by linear algebra.

The solver meets positions and velocities only within its tolerance: the accelerations inside each
interval are corrected by the minimum-norm change that meets them to rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.from_accelerations import (
    corrected_accelerations,
    cubics_from_accelerations,
)
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class Knots:
    """Data of a curve.

    Attributes:
        time: Times of the waypoints [s], shape (n,).
        share: Duration of each piece relative to its interval, shape (n-1, pieces), row sums 1.
        position: Positions at the waypoints, shape (n, d).
        velocity: Velocities at the waypoints, shape (n, d).
        acceleration: Accelerations at the ends of the pieces, shape (n-1, pieces + 1, d), equal at
            a waypoint in both adjoining intervals.
    """

    time: FloatArray
    share: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class ExactCurve:
    """A curve that meets positions and velocities to rounding, with its knots.

    Attributes:
        knots: Data of the curve.
        curve: The curve.
    """

    knots: Knots
    curve: PiecewisePolynomial


def rebuilt(knots: Knots) -> PiecewisePolynomial:
    """Make the C2 cubic curve that meets all positions and velocities to rounding.

    Accelerations at the waypoints are kept; those between get the minimum-norm change.
    """
    breaks, span = _breaks(knots)
    ends = knots.position, knots.velocity
    a = corrected_accelerations(span, knots.acceleration, *ends)
    return PiecewisePolynomial(cubics_from_accelerations(span, a, *ends), breaks)


def in_a_row(parts: Sequence[Knots]) -> list[Knots]:
    """Shift parts of a motion to follow one another, from time 0 on."""
    durations = np.concatenate([np.diff(one.time) for one in parts])
    time = np.concatenate(([0.0], np.cumsum(durations)))
    ends = np.cumsum([0, *(len(one.share) for one in parts)])
    return [
        replace(one, time=time[first : last + 1])
        for one, (first, last) in zip(parts, pairwise(ends), strict=True)
    ]


def corrected(knots: Knots) -> Knots:
    """The knots with the accelerations that meet all positions and velocities."""
    span = _breaks(knots)[1]
    found = corrected_accelerations(span, knots.acceleration, knots.position, knots.velocity)
    return replace(knots, acceleration=found)


def divided(knots: Knots, pieces: int) -> Knots:
    """Divide the longest pieces of each interval, up to n pieces or more."""
    share, a = knots.share, knots.acceleration
    rows = np.arange(len(share))
    for count in range(share.shape[1], pieces):
        longest = share.argmax(axis=1)
        places = np.arange(count + 2)
        before = places - (places > longest[:, None])  # the longest piece twice
        share = np.take_along_axis(share, before[:, :-1], axis=1)
        share[rows, longest] *= 0.5
        share[rows, longest + 1] *= 0.5
        middle = 0.5 * (a[rows, longest] + a[rows, longest + 1])
        a = np.take_along_axis(a, before[:, :, None], axis=1)
        a[rows, longest + 1] = middle
    return replace(knots, share=share, acceleration=a)


def joined(parts: Sequence[Knots]) -> Knots:
    """Concatenate parts that agree where they meet."""
    if len(parts) == 1:
        return parts[0]
    pieces = max(one.share.shape[1] for one in parts)
    # correction after division would give another curve
    parts = [divided(corrected(one), pieces) for one in parts]
    durations = np.concatenate([np.diff(one.time) for one in parts])

    def points(name: str) -> FloatArray:
        arrays = [getattr(one, name) for one in parts]
        return np.concatenate([*(array[:-1] for array in arrays[:-1]), arrays[-1]])

    return Knots(
        np.concatenate(([0.0], np.cumsum(durations))),
        np.concatenate([one.share for one in parts]),
        points("position"),
        points("velocity"),
        np.concatenate([one.acceleration for one in parts]),
    )


def rebuilt_row(parts: Sequence[Knots]) -> PiecewisePolynomial:
    """Make one curve of consecutive parts."""
    curves = [rebuilt(one) for one in parts]
    return PiecewisePolynomial(
        np.concatenate([one.c for one in curves], axis=1),
        np.concatenate([curves[0].x[:1], *(one.x[1:] for one in curves)]),
    )


def _breaks(knots: Knots) -> tuple[FloatArray, FloatArray]:
    """Times of all breaks, and their exact floating-point differences."""
    time, share = knots.time, knots.share
    inner = np.cumsum(share[:, :-1], axis=1) * np.diff(time)[:, None]
    breaks = np.append(np.hstack((time[:-1, None], time[:-1, None] + inner)).ravel(), time[-1])
    return breaks, np.diff(breaks).reshape(share.shape)
