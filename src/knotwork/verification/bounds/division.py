"""The division of a motion's time: first intervals, and those still open in three parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.polynomial.distinct import distinct
from knotwork.verification.bounds.polynomials import Intervals
from knotwork.waypoints import FloatArray, IndexArray


class Looks(NamedTuple):
    """Pairs of solids to be looked at, each over an interval; m of them.

    Attributes:
        interval: Which interval, shape (m,).
        combo: Which pair of solids, shape (m,).
        distance: Between the solids at its middle [m], `nan` where it has not been measured.
        normal: Unit vectors from the second to the first then, shape (m, 3).
    """

    interval: IndexArray
    combo: IndexArray
    distance: FloatArray
    normal: FloatArray

    def where(self, chosen: NDArray[np.bool_]) -> Looks:
        """Some of them."""
        item = self.interval[chosen], self.combo[chosen]
        return Looks(*item, self.distance[chosen], self.normal[chosen])


def first_intervals(x: FloatArray, windows: FloatArray, count: int) -> Intervals:
    """Divide a motion into about `count` intervals, at its breaks and where windows begin or end.

    Args:
        x: Breaks of the motion [s].
        windows: When pairs begin and end to be there [s], shape (k, 2).
        count: Number of intervals if there were no breaks.
    """
    edges = distinct(x, windows[(windows > x[0]) & (windows < x[-1])])
    span = np.diff(edges)
    parts = np.maximum(1, np.ceil(count * span / (x[-1] - x[0]))).astype(int)
    index = np.repeat(np.arange(len(span)), parts)
    step = np.arange(len(index)) - np.repeat(np.cumsum(parts) - parts, parts)
    start = edges[index] + span[index] * (step / parts[index])
    length = span[index] / parts[index]
    piece = np.clip(np.searchsorted(x, start + length / 2) - 1, 0, len(x) - 2)
    return Intervals(piece, start - x[piece], length)


def divided(intervals: Intervals, looks: Looks) -> tuple[Intervals, Looks]:
    """Intervals that are still open, each in three parts; the middle ones are measured."""
    used, place = np.unique(looks.interval, return_inverse=True)
    third = intervals.length[used] / 3
    start = intervals.start[used]
    parts = Intervals(
        np.repeat(intervals.piece[used], 3),
        (start[:, None] + third[:, None] * np.arange(3)).ravel(),
        np.repeat(third, 3),
    )
    interval = (3 * place[:, None] + np.arange(3)).ravel()
    distance, normal = np.full((len(place), 3), np.nan), np.zeros((len(place), 3, 3))
    distance[:, 1], normal[:, 1] = looks.distance, looks.normal
    combo = np.repeat(looks.combo, 3)
    return parts, Looks(interval, combo, distance.ravel(), normal.reshape(-1, 3))
