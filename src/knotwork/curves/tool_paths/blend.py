"""`Blend`: a rounded corner between two lines, with continuous curvature."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.curves.tool_paths.curve import SAME_POINT, geometry_error
from knotwork.curves.tool_paths.polynomial_curve import PolynomialCurve
from knotwork.errors.arguments import require_number

CONTROL_SPACING = 0.44, 0.75
"""Distances of the second and third control point from the first, relative to the blend distance
and to the root of cos(θ/2), θ the turning angle. They give the lowest peak of the derivative of the
curvature, with a peak curvature of about 4/3 of that of the arc between the same points.
"""

REVERSAL_ANGLE = 1e-3
"""Minimum angle between a corner that can be rounded and a reversal [rad]."""


class Blend(PolynomialCurve):
    """Rounded corner between two lines: a quintic Bézier curve.

    The curve begins on the first line and ends on the second one, at the same distance from the
    corner. At both ends three control points are on the line, so the curvature is zero.

    Args:
        before: A point on the first line [m], shape (3,).
        corner: The corner [m], shape (3,).
        after: A point on the second line [m], shape (3,).
        distance: Distance of both ends of the blend from the corner [m].

    Attributes:
        corner, distance: The arguments.
        start, end: End points [m], shape (3,).
        angle: Turning angle of the direction [rad].
        deviation: Distance of the curve from the corner [m].

    Raises:
        ArrayError: A point is not three finite numbers.
        PathError: The distance is not positive or longer than a line, two points are the same, or
            the second line reverses along the first.

    >>> blend = kw.tool_paths.Blend([0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], distance=0.02)
    >>> blend.start, blend.end, round(blend.deviation, 6)
    (array([0.08, 0.  , 0.  ]), array([0.1 , 0.02, 0.  ]), 0.006933)
    """

    def __init__(
        self, before: ArrayLike, corner: ArrayLike, after: ArrayLike, distance: float
    ) -> None:
        self.corner = checked_array(corner, (3,), "corner")
        self.distance = require_number(distance, "blend distance", "m")
        if self.distance <= SAME_POINT:
            raise geometry_error(
                "blend distance is {distance}; it must be greater than {minimum}",
                distance=self.distance,
                minimum=SAME_POINT,
            )
        u = _find_direction(self.corner, before, "before", self.distance)
        v = _find_direction(self.corner, after, "after", self.distance)
        self.angle = math.atan2(float(np.linalg.norm(np.cross(u, v))), -float(u @ v))
        if math.pi - self.angle < REVERSAL_ANGLE:
            raise geometry_error(
                "the path turns back at the corner {corner}, by "
                f"{math.degrees(self.angle):.6g} deg; a blend can't round this: stop there",
                corner=self.corner,
            )
        root = math.sqrt(math.cos(0.5 * self.angle))
        parts = self.distance * (1.0 - np.array([0.0, *CONTROL_SPACING]) * root)
        points = self.corner + np.vstack((np.outer(parts, u), np.outer(parts[::-1], v)))
        self.start, self.end = points[0], points[-1]
        super().__init__(_power_coefficients(points)[:, None, :])
        middle = self.position([0.5 * self.length])[0]
        self.deviation = float(np.linalg.norm(middle - self.corner))


def _find_direction(corner: FloatArray, point: ArrayLike, name: str, distance: float) -> FloatArray:
    """Find the direction from the corner to a point on one of the lines.

    Raises:
        PathError: The point is nearer than the blend distance.
    """
    chord = checked_array(point, (3,), name) - corner
    length = float(np.linalg.norm(chord))
    if distance > length * (1.0 + 1e-9):
        raise geometry_error(
            f"blend distance is {{distance}}, but the line {name} the corner {{corner}} is "
            "{length} long; at most that is accepted",
            distance=distance,
            corner=corner,
            length=length,
        )
    return np.asarray(chord / length)


def _power_coefficients(points: FloatArray) -> FloatArray:
    """Coefficients, highest power first, of a Bézier curve: c_j = C(n, j) Δ^j P0."""
    n = len(points) - 1
    rows = [math.comb(n, j) * np.diff(points, j, axis=0)[0] for j in range(n + 1)]
    return np.array(rows[::-1])
