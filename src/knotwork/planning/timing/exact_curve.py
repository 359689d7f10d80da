"""Exact curve from the solver's durations and accelerations, by linear algebra.

The solver meets positions and velocities only within its tolerance. The accelerations inside each
interval get the minimum-norm correction that meets them to rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.from_accelerations import (
    corrected_accelerations,
    cubics_from_accelerations,
)
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class MotionKnots:
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

    @cached_property
    def curve(self) -> PiecewisePolynomial:
        """The C2 cubic curve that meets all positions and velocities to rounding.

        Accelerations at the waypoints stay; those between them get the minimum-norm correction.
        """
        breaks, span = _breaks(self)
        ends = self.position, self.velocity
        a = corrected_accelerations(span, self.acceleration, *ends)
        return PiecewisePolynomial(cubics_from_accelerations(span, a, *ends), breaks)

    def first_intervals(self, count: int) -> MotionKnots:
        """The data of the first intervals."""
        points, intervals = slice(count + 1), slice(count)
        return MotionKnots(
            self.time[points],
            self.share[intervals],
            self.position[points],
            self.velocity[points],
            self.acceleration[intervals],
        )


def correct_accelerations(knots: MotionKnots) -> MotionKnots:
    """The knots with the accelerations that meet all positions and velocities."""
    span = _breaks(knots)[1]
    a = corrected_accelerations(span, knots.acceleration, knots.position, knots.velocity)
    return replace(knots, acceleration=a)


def divide_pieces(knots: MotionKnots, pieces: int) -> MotionKnots:
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


def concatenate_knots(parts: Sequence[MotionKnots]) -> MotionKnots:
    """Concatenate parts that agree where they meet, from time 0 on."""
    if len(parts) == 1:
        return parts[0]
    pieces = max(part.share.shape[1] for part in parts)
    # a correction after the division would give another curve
    parts = [divide_pieces(correct_accelerations(part), pieces) for part in parts]
    return MotionKnots(
        _concatenate_times(parts),
        np.concatenate([part.share for part in parts]),
        np.concatenate([parts[0].position[:1], *(part.position[1:] for part in parts)]),
        np.concatenate([parts[0].velocity[:1], *(part.velocity[1:] for part in parts)]),
        np.concatenate([part.acceleration for part in parts]),
    )


def concatenate_curves(parts: Sequence[MotionKnots]) -> tuple[FloatArray, PiecewisePolynomial]:
    """Times of all waypoints from 0 on, and one curve of consecutive parts."""
    time = _concatenate_times(parts)
    ends = pairwise(np.cumsum([0, *(len(part.share) for part in parts)]))
    curves = [
        replace(part, time=time[first : last + 1]).curve
        for part, (first, last) in zip(parts, ends, strict=True)
    ]
    return time, PiecewisePolynomial(
        np.concatenate([curve.c for curve in curves], axis=1),
        np.concatenate([curves[0].x[:1], *(curve.x[1:] for curve in curves)]),
    )


def _concatenate_times(parts: Sequence[MotionKnots]) -> FloatArray:
    durations = np.concatenate([np.diff(part.time) for part in parts])
    return np.concatenate(([0.0], np.cumsum(durations)))


def _breaks(knots: MotionKnots) -> tuple[FloatArray, FloatArray]:
    """Times of all breaks, and their exact floating-point differences."""
    time, share = knots.time, knots.share
    inner = np.cumsum(share[:, :-1], axis=1) * np.diff(time)[:, None]
    breaks = np.append(np.hstack((time[:-1, None], time[:-1, None] + inner)).ravel(), time[-1])
    return breaks, np.diff(breaks).reshape(share.shape)
