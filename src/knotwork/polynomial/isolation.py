"""Where polynomials of high degree may be larger or smaller than values already known.

A polynomial lies between the least and the greatest of its Bernstein coefficients, and has at most
as many extrema as these change direction (variation diminishing). So an interval is done if its
coefficients stay within what is known or never change direction; it holds one extremum if they
change once; else it is halved by de Casteljau's scheme. Most pieces are done at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.waypoints import FloatArray

HALVINGS = 50
"""Intervals this often halved are as short as floats resolve times."""

CROWDED = 32
"""With more intervals than this for each polynomial, what is left is rounding: the margin within
which values count as known grows to what that can make."""

EPSILON = float(np.finfo(float).eps)


@lru_cache(maxsize=64)
def to_bernstein(degree: int) -> FloatArray:
    """Matrix that turns coefficients, lowest power first, into Bernstein coefficients on [0, 1]."""
    return np.array(
        [[comb(i, j) / comb(degree, j) for j in range(degree + 1)] for i in range(degree + 1)]
    )


@lru_cache(maxsize=64)
def _halves(degree: int) -> tuple[FloatArray, FloatArray]:
    """Matrices to the Bernstein coefficients of the two halves of an interval."""
    left = np.array([[comb(i, j) / 2.0**i for j in range(degree + 1)] for i in range(degree + 1)])
    return left, left[::-1, ::-1].copy()


class Brackets(NamedTuple):
    """Points of the unit interval, and stretches of it that hold one extremum each.

    Attributes:
        column: Which polynomial each stretch is of, shape (r,).
        low, high: Its ends, shape (r,).
        rising: Whether the slope rises through zero: a minimum, shape (r,).
        points: Pairs of a column and a point, the middles of intervals that were halved.
    """

    column: NDArray[np.intp]
    low: FloatArray
    high: FloatArray
    rising: NDArray[np.bool_]
    points: tuple[NDArray[np.intp], FloatArray]


@dataclass(frozen=True, eq=False)
class _Intervals:
    b: FloatArray  # Bernstein coefficients, shape (k+1, n)
    column: NDArray[np.intp]
    low: FloatArray

    def __getitem__(self, index: NDArray[np.bool_]) -> _Intervals:
        return _Intervals(self.b[:, index], self.column[index], self.low[index])


def isolate(
    c: FloatArray, group: NDArray[np.intp], least: FloatArray, greatest: FloatArray
) -> Brackets:
    """Isolate the extrema that may lie beyond known values.

    Args:
        c: Coefficients in the unit variable, shape (k+1, n), highest power first.
        group: Which of the known values each polynomial is compared with, shape (n,).
        least: Values known to be taken, the ends of the polynomials among them, by group.
        greatest: The same for the greatest ones.
    """
    degree = len(c) - 1
    noise = EPSILON * np.abs(c).sum(axis=0)
    least, greatest = least.copy(), greatest.copy()
    columns = np.arange(c.shape[1])
    work = _Intervals(to_bernstein(degree) @ c[::-1], columns, np.zeros(columns.size))
    width, found, middles = 1.0, [], []
    for _ in range(HALVINGS):
        crowded = work.column.size > CROWDED + CROWDED * columns.size
        margin = (8.0 * (degree + 1) if crowded else 2.0) * noise[work.column]
        high, low = greatest[group[work.column]], least[group[work.column]]
        work = work[(work.b.max(axis=0) > high + margin) | (work.b.min(axis=0) < low - margin)]
        changes, falls_first = _turns(np.diff(work.b, axis=0))
        one = work[changes == 1]
        found.append((one.column, one.low, np.full(one.low.size, width), falls_first[changes == 1]))
        work = work[changes > 1]
        if not work.column.size:
            break
        width *= 0.5
        left, right = (half @ work.b for half in _halves(degree))
        middle, at = right[0], group[work.column]
        np.maximum.at(greatest, at, middle)
        np.minimum.at(least, at, middle)
        middles.append((work.column, work.low + width))
        work = _Intervals(
            np.concatenate((left, right), axis=1),
            np.concatenate((work.column, work.column)),
            np.concatenate((work.low, work.low + width)),
        )
    column, low, widths, rising = (np.concatenate(parts) for parts in zip(*found, strict=True))
    middles.append((columns[:0], np.zeros(0)))
    points = tuple(np.concatenate(parts) for parts in zip(*middles, strict=True))
    return Brackets(column, low, low + widths, rising, (points[0], points[1]))


def _turns(steps: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """How often steps change their sign along the first axis, and whether the first one falls."""
    sign = np.sign(steps)
    last = np.where(sign != 0.0, np.arange(len(sign))[:, None], 0)
    sign = np.take_along_axis(sign, np.maximum.accumulate(last, axis=0), axis=0)
    first = np.take_along_axis(sign, (sign != 0.0).argmax(axis=0)[None], axis=0)[0]
    return (sign[1:] * sign[:-1] < 0.0).sum(axis=0), first < 0.0
