"""The exact curve from the solver's durations and accelerations, by linear algebra.

The solver meets positions and velocities only up to its tolerance: the accelerations inside each
interval are corrected by the least change that meets them to rounding.
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
    """What a curve is made from.

    Attributes:
        time: Of the waypoints [s], shape (n,).
        share: Part of each interval that each piece takes, shape (n-1, pieces), rows sum to one.
        position: At the waypoints, shape (n, d).
        velocity: At the waypoints, shape (n, d).
        acceleration: At the ends of the pieces, shape (n-1, pieces + 1, d); at a waypoint the same
            in both adjoining intervals.
    """

    time: FloatArray
    share: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class ExactCurve:
    """A curve that meets positions and velocities to rounding, and its knots.

    Attributes:
        knots: What the curve is made from.
        curve: The curve.
    """

    knots: Knots
    curve: PiecewisePolynomial


def rebuilt(knots: Knots) -> PiecewisePolynomial:
    """Make the C2 cubic curve that meets all positions and velocities to rounding.

    Accelerations at the waypoints are kept; those between change as little as is needed.
    """
    breaks, span = _breaks(knots)
    ends = knots.position, knots.velocity
    a = corrected_accelerations(span, knots.acceleration, *ends)
    return PiecewisePolynomial(cubics_from_accelerations(span, a, *ends), breaks)


def in_a_row(parts: Sequence[Knots]) -> list[Knots]:
    """Parts of a motion one after another, the first one from time 0 on."""
    durations = np.concatenate([np.diff(one.time) for one in parts])
    time = np.concatenate(([0.0], np.cumsum(durations)))
    ends = np.cumsum([0, *(len(one.share) for one in parts)])
    return [
        replace(one, time=time[first : last + 1])
        for one, (first, last) in zip(parts, pairwise(ends), strict=True)
    ]


def corrected(knots: Knots) -> Knots:
    """The accelerations that the curve has, so that it meets all positions and velocities."""
    span = _breaks(knots)[1]
    found = corrected_accelerations(span, knots.acceleration, knots.position, knots.velocity)
    return replace(knots, acceleration=found)


def divided(knots: Knots, pieces: int) -> Knots:
    """The same motion with n pieces an interval, or more: the longest are halved."""
    share, a = knots.share, knots.acceleration
    rows = np.arange(len(share))
    for count in range(share.shape[1], pieces):
        longest = share.argmax(axis=1)
        places = np.arange(count + 2)
        before = places - (places > longest[:, None])  # the longest piece's twice
        share = np.take_along_axis(share, before[:, :-1], axis=1)
        share[rows, longest] *= 0.5
        share[rows, longest + 1] *= 0.5
        middle = 0.5 * (a[rows, longest] + a[rows, longest + 1])
        a = np.take_along_axis(a, before[:, :, None], axis=1)
        a[rows, longest + 1] = middle
    return replace(knots, share=share, acceleration=a)


def joined(parts: Sequence[Knots]) -> Knots:
    """Put parts one after another; where they meet they agree."""
    if len(parts) == 1:
        return parts[0]
    pieces = max(one.share.shape[1] for one in parts)
    # corrected once divided, a curve would be another one
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
    """Make one curve of parts that follow one another."""
    curves = [rebuilt(one) for one in parts]
    return PiecewisePolynomial(
        np.concatenate([one.c for one in curves], axis=1),
        np.concatenate([curves[0].x[:1], *(one.x[1:] for one in curves)]),
    )


def _breaks(knots: Knots) -> tuple[FloatArray, FloatArray]:
    """Times of all breaks, and what lies between them, exactly as floats have it."""
    time, share = knots.time, knots.share
    inner = np.cumsum(share[:, :-1], axis=1) * np.diff(time)[:, None]
    breaks = np.append(np.hstack((time[:-1, None], time[:-1, None] + inner)).ravel(), time[-1])
    return breaks, np.diff(breaks).reshape(share.shape)
