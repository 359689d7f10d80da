"""`Line`: a straight line from one point to another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.curves.tool_paths.curve import (
    SAME_POINT,
    Curve,
    checked_curve_order,
    geometry_error,
)


class Line(Curve):
    """A straight line between two points.

    Attributes:
        start, end: End points [m], shape (3,).
        direction: Unit vector from start to end, shape (3,).

    Raises:
        ArrayError: A point is not three finite numbers.
        PathError: Both points are the same.

    >>> line = kw.tool_paths.Line([0, 0, 0], [0.3, 0, 0])
    >>> line.position([0.0, 0.1])
    array([[0. , 0. , 0. ],
           [0.1, 0. , 0. ]])
    """

    def __init__(self, start: ArrayLike, end: ArrayLike) -> None:
        self.start = checked_array(start, (3,), "start")
        self.end = checked_array(end, (3,), "end")
        chord = self.end - self.start
        self.length = float(np.linalg.norm(chord))
        if self.length <= SAME_POINT:
            raise geometry_error(
                "the line from {start} to {end} has no length; its ends must differ",
                start=self.start,
                end=self.end,
            )
        self.direction: FloatArray = chord / self.length

    def position(self, s: ArrayLike, order: int = 0) -> FloatArray:
        """Points of the line, or their derivatives: see `Curve.position`."""
        s = np.asarray(s, dtype=float)[:, None]
        if checked_curve_order(order) == 0:
            return np.asarray(self.start + s * self.direction)
        return np.broadcast_to(self.direction if order == 1 else np.zeros(3), (len(s), 3)).copy()

    def nearest(self, points: ArrayLike, guess: ArrayLike) -> FloatArray:
        """Arc lengths of the nearest points; the guess is not used."""
        along = (np.asarray(points, dtype=float) - self.start) @ self.direction
        return np.asarray(np.clip(along, 0.0, self.length))

    def curvature_bound(self, s0: ArrayLike, s1: ArrayLike) -> FloatArray:
        """Zero, shape (k,)."""
        return np.zeros(np.shape(s0))
