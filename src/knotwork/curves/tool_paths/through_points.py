"""`ThroughPoints`: a smooth curve through many points, for example from CAD."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.curves.tool_paths.curve import SAME_POINT, geometry_error
from knotwork.curves.tool_paths.polynomial_curve import PolynomialCurve
from knotwork.errors import PathError


class ThroughPoints(PolynomialCurve):
    """Cubic spline through points, twice continuously differentiable, parametrised by arc length.

    It is a not-a-knot spline whose parameter is the distance along the chords.

    Args:
        points: The points [m], shape (n, 3), n >= 2.

    Attributes:
        points: The points.
        arc_lengths: Arc lengths at the points [m], shape (n,).

    Raises:
        ArrayError: Points are not finite or have a wrong shape.
        PathError: There are fewer than two points, two neighbours are the same, or the curve stops
            or turns back.

    >>> points = [[0, 0, 0], [0.1, 0, 0], [0.2, 0.05, 0], [0.3, 0.05, 0]]
    >>> kw.tool_paths.ThroughPoints(points).arc_lengths.round(6)
    array([0.      , 0.103013, 0.214897, 0.317909])
    """

    def __init__(self, points: ArrayLike) -> None:
        from scipy.interpolate import CubicSpline

        count = len(np.atleast_1d(np.asarray(points)))
        self.points = checked_array(points, (count, 3), "points")
        if count < 2:
            raise PathError(f"{count} points are given; a curve needs at least two")
        chords = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        if (chords <= SAME_POINT).any():
            raise geometry_error(
                "two neighbouring points are the same, {point}; leave one out",
                point=self.points[int((chords <= SAME_POINT).argmax())],
            )
        x = np.concatenate(([0.0], np.cumsum(chords)))
        c = CubicSpline(x, self.points).c
        powers = np.arange(len(c) - 1, -1, -1.0)[:, None, None]
        # The coefficients of SciPy are for the chord distance, these are for a unit parameter.
        super().__init__(c * np.diff(x)[:, None] ** powers)
        self.arc_lengths: FloatArray = self.piece_ends

    def chords_and_bulges(self) -> FloatArray:
        """Return lengths of chords and largest distances from them, which are sampled."""
        fractions = np.linspace(0.0, 1.0, 17)
        s = self.arc_lengths[:-1, None] + np.diff(self.arc_lengths)[:, None] * fractions
        offset = self.position(s.ravel()).reshape(*s.shape, 3) - self.points[:-1, None]
        chord = np.diff(self.points, axis=0)[:, None]
        squared = (chord**2).sum(axis=2)
        along = np.clip((offset * chord).sum(axis=2) / squared, 0.0, 1.0)
        distance = np.linalg.norm(offset - along[:, :, None] * chord, axis=2)
        return np.array([np.sqrt(squared[:, 0]), distance.max(axis=1)])
