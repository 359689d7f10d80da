"""Division of the time of a motion: first intervals, and open intervals into three parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.curves.polynomial.distinct import distinct
from knotwork.verification.bounds.rate_bounds import Intervals
from knotwork.waypoints import FloatArray, IndexArray


class PairTests(NamedTuple):
    """m pairs of solids to test, each over an interval.

    Attributes:
        interval: Indices of the intervals, shape (m,).
        combo: Indices of the pairs of solids, shape (m,).
        distance: Distances of the solids at the middle [m], `nan` if not measured.
        normal: Unit vectors from the second to the first solid at the middle, shape (m, 3).
    """

    interval: IndexArray
    combo: IndexArray
    distance: FloatArray
    normal: FloatArray

    def where(self, chosen: NDArray[np.bool_]) -> PairTests:
        """Select pairs by a mask."""
        item = self.interval[chosen], self.combo[chosen]
        return PairTests(*item, self.distance[chosen], self.normal[chosen])


def first_intervals(x: FloatArray, count: int, *windows: FloatArray) -> Intervals:
    """Divide a motion into about `count` intervals, at its breaks and the ends of windows.

    Args:
        x: Breaks of the motion [s].
        count: Number of intervals if there were no breaks.
        windows: Ends of intervals in which bodies exist [s].
    """
    edges = distinct(x, *(ends[(ends > x[0]) & (ends < x[-1])] for ends in windows))
    span = np.diff(edges)
    piece = np.clip(np.searchsorted(x, edges[:-1] + span / 2) - 1, 0, len(x) - 2)
    parts = np.maximum(1, np.ceil(count * span / (x[-1] - x[0]))).astype(int)
    return Intervals(piece, edges[:-1] - x[piece], span).split(parts)


def divide_in_three(intervals: Intervals, tests: PairTests) -> tuple[Intervals, PairTests]:
    """Divide open intervals into three parts. The middle parts keep their distances."""
    indices, place = np.unique(tests.interval, return_inverse=True)
    interval = (3 * place[:, None] + np.arange(3)).ravel()
    distance, normal = np.full((len(place), 3), np.nan), np.zeros((len(place), 3, 3))
    distance[:, 1], normal[:, 1] = tests.distance, tests.normal
    combo = np.repeat(tests.combo, 3)
    return intervals[indices].split(3), PairTests(
        interval, combo, distance.ravel(), normal.reshape(-1, 3)
    )
