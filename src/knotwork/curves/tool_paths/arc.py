"""`Arc`: part of a circle, a full circle or several turns."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.curves.tool_paths.curve import (
    SAME_POINT,
    Curve,
    checked_curve_order,
    geometry_error,
    to_unit_vector,
)
from knotwork.errors import PathError
from knotwork.errors.arguments import require_count, require_number

PARALLEL_SINE = 1e-6
"""Sine of the angle below which two directions count as parallel."""

RIGHT_ANGLE_TOLERANCE = 1e-3
"""Tolerance of a normal's right angle [rad]."""

RADIUS_TOLERANCE = 1e-6
"""Tolerance of the difference of the radii at both ends, relative to the larger."""


class Arc(Curve):
    """A circular arc of any angle, also of more than one turn.

    `Arc.through` a point, `Arc.about` a centre, `Arc.of_radius`, or `Arc` with start, centre,
    normal and angle.

    Attributes:
        start, end: End points [m], shape (3,).
        centre: Centre of the circle [m], shape (3,).
        radius: Radius of the circle [m].
        normal: Unit vector about which the arc turns in the positive sense, shape (3,).
        angle: Angle of the arc, > 0 [rad].
    """

    def __init__(
        self, start: ArrayLike, centre: ArrayLike, normal: ArrayLike, angle: float
    ) -> None:
        self.start = checked_array(start, (3,), "start")
        self.centre = checked_array(centre, (3,), "centre")
        spoke = self.start - self.centre
        self.radius = float(np.linalg.norm(spoke))
        if self.radius <= SAME_POINT:
            raise geometry_error(
                "the arc's start {start} is its centre; they must differ", start=self.start
            )
        self._outward: FloatArray = spoke / self.radius
        self.normal = _unit_normal(normal, self._outward, "the radius at the start")
        self._forward: FloatArray = np.cross(self.normal, self._outward)
        self.angle = require_number(angle, "the arc's angle", "rad")
        if self.angle * self.radius <= SAME_POINT:
            raise PathError(
                f"the arc's angle is {angle!r} rad; it must be greater than 0 "
                "(reverse the normal for the other direction)"
            )
        self.length = self.radius * self.angle
        self.end: FloatArray = self.position(np.array([self.length]))[0]

    @classmethod
    def through(cls, start: ArrayLike, through: ArrayLike, end: ArrayLike) -> Arc:
        """Arc from start to end through a point between.

        Raises:
            ArrayError: A point is not three finite numbers.
            PathError: Two of the points are the same, or all three are on a line.

        >>> arc = kw.tool_paths.Arc.through([1, 0, 0], [0, 1, 0], [0, -1, 0])
        >>> round(arc.radius, 12), round(arc.angle / np.pi, 12)
        (1.0, 1.5)
        """
        a, b, c = _checked_points(start=start, through=through, end=end)
        if np.linalg.norm(c - a) <= SAME_POINT:
            raise geometry_error(
                "the arc starts and ends at {start}: one more point does not define the circle; "
                "give its centre and, as a full circle needs, its normal",
                start=a,
            )
        u, v = b - a, c - a
        normal = np.cross(u, v)
        if np.linalg.norm(normal) <= PARALLEL_SINE * np.linalg.norm(u) * np.linalg.norm(c - b):
            raise geometry_error(
                "{start}, {through} and {end} are on a line, and no arc goes through "
                "them; use a line, or move the point off the line",
                start=a,
                through=b,
                end=c,
            )
        return cls._from_spokes(a, a + _circumcentre(u, v, normal), c, normal)

    @classmethod
    def about(
        cls,
        start: ArrayLike,
        centre: ArrayLike,
        end: ArrayLike,
        normal: ArrayLike | None = None,
        turns: int = 0,
    ) -> Arc:
        """Arc from start to end about a centre.

        A centre with rounding errors is moved to be equally far from both ends.

        Args:
            start: Start point [m], shape (3,).
            centre: Centre of the circle [m], shape (3,).
            end: End point [m], shape (3,).
            normal: Axis about which the arc turns in the positive sense, by up to a full turn; by
                default the arc is the shorter one. A full circle (start and end the same) and half
                a circle need it.
            turns: Additional full turns.

        Raises:
            ArrayError: A point is not three finite numbers.
            PathError: The radii at both ends differ, the normal is missing or not perpendicular to
                the radius, or `turns` is negative.

        >>> circle = kw.tool_paths.Arc.about([1, 0, 0], [0, 0, 0], [1, 0, 0], normal=[0, 0, 1])
        >>> circle.angle / np.pi
        2.0
        """
        a, m, c = _checked_points(start=start, centre=centre, end=end)
        turns = require_count(turns, "turns", 0)
        from_a, from_c = a - m, c - m
        radii = float(np.linalg.norm(from_a)), float(np.linalg.norm(from_c))
        if abs(radii[0] - radii[1]) > RADIUS_TOLERANCE * max(radii) or min(radii) <= SAME_POINT:
            raise geometry_error(
                "the centre {centre} is {first} from the start and {last} "
                "from the end; both must be the radius, greater than 0, within "
                f"{RADIUS_TOLERANCE:g} of it",
                centre=m,
                first=radii[0],
                last=radii[1],
            )
        axis, chord = _axis_about(from_a, from_c, normal), c - a
        if np.linalg.norm(chord) > SAME_POINT:
            m = m + chord * ((0.5 * (a + c) - m) @ chord) / (chord @ chord)
            return cls._from_spokes(a, m, c, axis, turns)
        return cls(a, m, axis, 2.0 * math.pi * (1 + turns))

    @classmethod
    def of_radius(
        cls,
        start: ArrayLike,
        end: ArrayLike,
        radius: float,
        normal: ArrayLike,
        large: bool = False,
    ) -> Arc:
        """Arc from start to end that turns in the positive sense about a normal.

        Args:
            start: Start point [m], shape (3,).
            end: End point [m], shape (3,).
            radius: Radius [m].
            normal: Axis of the turn, perpendicular to the line from start to end.
            large: Whether the arc is the one of more than half a turn.

        Raises:
            ArrayError: A point is not three finite numbers.
            PathError: Both points are the same, the radius is too small for them, or the normal is
                not perpendicular to the line between them.
        """
        a, c = _checked_points(start=start, end=end)
        chord = c - a
        distance = float(np.linalg.norm(chord))
        if distance <= SAME_POINT:
            raise geometry_error(
                "the arc starts and ends at {start}: its radius does not define the circle; "
                "give its centre and normal",
                start=a,
            )
        r = require_number(radius, "radius", "m")
        if r < 0.5 * distance * (1.0 - RADIUS_TOLERANCE):
            raise geometry_error(
                "radius is {radius}, but start and end are {distance} apart; it must be at least "
                "{minimum}",
                radius=r,
                distance=distance,
                minimum=0.5 * distance,
            )
        axis = _unit_normal(normal, chord / distance, "the way from start to end")
        height = math.sqrt(max(r**2 - 0.25 * distance**2, 0.0)) * (-1.0 if large else 1.0)
        centre = 0.5 * (a + c) + height * np.cross(axis, chord / distance)
        return cls._from_spokes(a, centre, c, axis)

    @classmethod
    def _from_spokes(
        cls,
        start: FloatArray,
        centre: FloatArray,
        end: FloatArray,
        axis: FloatArray,
        turns: int = 0,
    ) -> Arc:
        """Arc between two different points of a circle, of up to a full turn plus `turns`."""
        circle = cls(start, centre, axis, 2.0 * math.pi)
        angle = float(circle._angle_of((end - centre)[None])[0]) % (2.0 * math.pi)
        return cls(start, centre, axis, angle + 2.0 * math.pi * turns)

    def _angle_of(self, spokes: FloatArray) -> FloatArray:
        """Angles from the start about the normal, in (-pi, pi], of vectors from the centre."""
        return np.asarray(np.arctan2(spokes @ self._forward, spokes @ self._outward))

    def position(self, s: ArrayLike, order: int = 0) -> FloatArray:
        """Points of the arc, or their derivatives: see `Curve.position`."""
        angle = np.asarray(s, dtype=float)[:, None] / self.radius
        if checked_curve_order(order) == 0:  # from the start, so that large radii lose no digits
            inward = -2.0 * self.radius * np.sin(0.5 * angle) ** 2
            onward = self.radius * np.sin(angle)
            return np.asarray(self.start + onward * self._forward + inward * self._outward)
        angle = angle + 0.5 * math.pi * order
        direction = np.cos(angle) * self._outward + np.sin(angle) * self._forward
        return np.asarray(direction * self.radius ** (1 - order))

    def nearest(self, points: ArrayLike, guess: ArrayLike) -> FloatArray:
        """Arc lengths of the nearest points; the guess chooses the turn."""
        angle = self._angle_of(np.asarray(points, dtype=float) - self.centre)
        turns = np.round((np.asarray(guess, dtype=float) / self.radius - angle) / (2.0 * math.pi))
        s = self.radius * (angle + 2.0 * math.pi * turns)
        return np.asarray(np.clip(s, 0.0, self.length))

    def curvature_bound(self, s0: ArrayLike, s1: ArrayLike) -> FloatArray:
        """One over the radius [1/m], shape (k,)."""
        return np.full(np.shape(s0), 1.0 / self.radius)


def _checked_points(**points: ArrayLike) -> list[FloatArray]:
    return [checked_array(point, (3,), name) for name, point in points.items()]


def _circumcentre(u: FloatArray, v: FloatArray, normal: FloatArray) -> FloatArray:
    """Centre of the circle through 0, u and v, whose cross product is the normal."""
    spoke = np.cross((u @ u) * v - (v @ v) * u, normal)
    return np.asarray(spoke / (2.0 * (normal @ normal)))


def _unit_normal(normal: ArrayLike, direction: FloatArray, name: str) -> FloatArray:
    """Return the unit normal without its component along a direction.

    Raises:
        PathError: The component is larger than rounding.
    """
    axis = to_unit_vector(normal, "normal")
    along = float(axis @ direction)
    if abs(along) > RIGHT_ANGLE_TOLERANCE:
        raise PathError(
            f"the arc's normal makes an angle of {math.degrees(math.acos(abs(along))):.6g} deg "
            f"with {name}; it must be 90 deg within {math.degrees(RIGHT_ANGLE_TOLERANCE):.2g}"
        )
    return to_unit_vector(axis - along * direction, "normal")


def _axis_about(from_a: FloatArray, from_c: FloatArray, normal: ArrayLike | None) -> FloatArray:
    """Axis of an arc from the vectors from its centre to both ends, and its normal if given.

    Raises:
        PathError: The vectors define no plane and no normal is given, or the normal is not
            perpendicular to the radius at the end.
    """
    plane = np.cross(from_a, from_c)
    flat = np.linalg.norm(plane) <= PARALLEL_SINE * np.linalg.norm(from_a) * np.linalg.norm(from_c)
    if flat and normal is None:
        case = "a full circle" if from_a @ from_c > 0.0 else "half a circle"
        raise PathError(
            f"start, centre and end are on a line ({case}), so they define no plane; "
            "give the arc's normal"
        )
    if normal is None:
        return plane
    if flat:
        return np.asarray(normal, dtype=float)
    _unit_normal(normal, to_unit_vector(from_c, "end"), "the radius at the end")
    return np.asarray(plane * math.copysign(1.0, float(np.asarray(normal) @ plane)))
