"""Time intervals of a motion, and bounds on derivatives of joint positions over them.

On an interval a polynomial is a mean of its Bernstein coefficients, so their maximum is a bound.
The coefficients are computed for every interval on its own, so that a shorter interval has a
tighter bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import perm
from typing import NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.critical_points import to_bernstein
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.polynomial.splitting import shift_origin
from knotwork.verification.bounds.link_motion import RATE_ORDERS

EVALUATION_ROUNDING = 2.0**-10
"""Increase of the bounds, relative to the degree times the sum of the magnitudes of all terms.

The rounding of Horner's scheme is 2⁻⁵² instead of 2⁻¹⁰ of that product, so it is at most 2⁻⁴² of
the bounds.
"""


@dataclass(frozen=True, eq=False)
class Intervals:
    """Time intervals, each within one piece of a curve.

    Attributes:
        piece: Index of the piece, shape (n,).
        start: Start of the interval since the start of the piece [s], shape (n,).
        duration: Duration of the interval [s], shape (n,).
    """

    piece: IndexArray
    start: FloatArray
    duration: FloatArray

    @property
    def middle(self) -> FloatArray:
        """Middle of the interval since the start of the piece [s], shape (n,)."""
        return np.asarray(self.start + self.duration / 2)

    def __getitem__(self, index: slice | IndexArray | BoolArray) -> Intervals:
        return Intervals(self.piece[index], self.start[index], self.duration[index])

    def split(self, parts: int | IndexArray) -> Intervals:
        """The intervals divided into equal parts.

        Args:
            parts: Number of parts, the same for all intervals, or of each, shape (n,).
        """
        counts = np.broadcast_to(parts, self.piece.shape)
        index, start = divide_intervals(self.start, self.duration, counts)
        return Intervals(self.piece[index], start, self.duration[index] / counts[index])


def divide_intervals(
    start: FloatArray, duration: FloatArray, counts: IndexArray
) -> tuple[IndexArray, FloatArray]:
    """Divide each of n intervals into equal parts.

    Args:
        start: Starts [s], shape (n,).
        duration: Durations [s], shape (n,).
        counts: Number of parts of each, shape (n,).

    Returns:
        For each part in order, the index of its interval, and its start [s].
    """
    index = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts, counts)
    return index, start[index] + duration[index] * (step / counts[index])


def first_intervals(x: FloatArray, count: int, *presence: FloatArray) -> Intervals:
    """Divide a motion into about `count` intervals, at its breaks and the ends of presence.

    Args:
        x: Breaks of the motion [s].
        count: Number of intervals of a motion without breaks.
        presence: Ends of the intervals in which bodies are there [s].
    """
    edges = sort_distinct(x, *(ends[(ends > x[0]) & (ends < x[-1])] for ends in presence))
    span = np.diff(edges)
    piece = np.clip(np.searchsorted(x, edges[:-1] + span / 2) - 1, 0, len(x) - 2)
    parts = np.maximum(1, np.ceil(count * span / (x[-1] - x[0]))).astype(int)
    return Intervals(piece, edges[:-1] - x[piece], span).split(parts)


class Rates(NamedTuple):
    """Bounds on the derivatives of joint positions, over n intervals.

    Attributes:
        bounds: Bounds of |q|, |q'|, … |q''''|, shape (5, d, n).
        size: Sum of the magnitudes of the terms of each position polynomial, to which rounding
            errors of the position are relative, shape (d, n).
    """

    bounds: FloatArray
    size: FloatArray


def joint_rates(curve: PiecewisePolynomial, intervals: Intervals) -> Rates:
    """Bound the derivatives of a curve, orders 0 … 4, on each interval.

    Args:
        curve: Joint positions, trailing shape (d,), of any degree.
        intervals: The intervals.
    """
    sizes = _term_sizes(curve)[:, intervals.piece]
    shifted = shift_origin(curve.c[:, intervals.piece], intervals.start[:, None])[::-1]
    degree = curve.degree
    powers = intervals.duration[:, None] ** np.arange(degree + 1)[:, None, None]
    bounds = np.zeros((RATE_ORDERS, *shifted.shape[1:]))
    for order in range(min(RATE_ORDERS, degree + 1)):
        terms = shifted[order:] * powers[: degree + 1 - order]
        values = _derived_bernstein(degree, order) @ terms.reshape(len(terms), -1)
        bounds[order] = np.abs(values, out=values).max(axis=0).reshape(shifted.shape[1:])
    bounds += (EVALUATION_ROUNDING * max(degree, 1)) * sizes
    return Rates(
        np.ascontiguousarray(bounds.swapaxes(1, 2)), np.ascontiguousarray(sizes[0].swapaxes(0, 1))
    )


@lru_cache(maxsize=64)
def _derived_bernstein(degree: int, order: int) -> FloatArray:
    """Matrix from coefficients of powers >= `order` to Bernstein coefficients of a derivative."""
    return to_bernstein(degree - order) * [perm(r, order) for r in range(order, degree + 1)]


def _term_sizes(curve: PiecewisePolynomial) -> FloatArray:
    """Sum of |term| at the end of each piece for the derivatives 0 … 4, shape (5, m, d)."""
    span = np.diff(curve.x)[:, None]
    c = np.abs(curve.c[::-1])
    sizes = np.zeros((RATE_ORDERS, *c.shape[1:]))
    for order in range(RATE_ORDERS):
        for r in range(len(c) - 1, order - 1, -1):
            sizes[order] = sizes[order] * span + perm(r, order) * c[r]
    return sizes
