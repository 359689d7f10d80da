"""Distances between solids, by Coal."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import coal
import numpy as np

from knotwork.scene.bodies import Body, placed_solids
from knotwork.scene.containment import one_inside_the_other
from knotwork.scene.solids import Placed, Solid
from knotwork.waypoints import FloatArray

TOLERANCE = 1e-9
"""Of the search for the nearest points."""

ROUNDING = 1e-6
"""Largest error of distances [m]: from the search for the nearest points, which ended no
farther than 1.4e-7 from the truth in 120 000 random pairs, and from the rounding of corners and
placements."""

ON_SURFACE = 1e-7
"""A point this near to a mesh [m] is on it."""


def _settle_boxes() -> None:
    """Have Coal take all boxes as they are.

    The first direction in which a process looks for the corner of a box decides for good: one with
    a zero in it makes every box wider by 1e-10 of its size to one side (`static` in Coal 3.0).
    Distances would differ with what was measured before.
    """
    turned = coal.Transform3s()
    turned.setRotation(np.array([[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]]) / 3.0)
    turned.setTranslation(np.array([3.0, 0.0, 0.0]))
    pair = coal.Capsule(1.0, 1.0), coal.Transform3s(), coal.Box(1.0, 1.0, 1.0), turned
    coal.distance(*pair, coal.DistanceRequest(), coal.DistanceResult())


_settle_boxes()


class Nearest(NamedTuple):
    """The nearest points of two bodies; where they overlap, the points of deepest penetration.

    Attributes:
        distance: Between them [m]; minus the depth where they overlap.
        points: On the first and on the second [m], shape (2, 3).
        normal: Unit vector along which the first has to go to get away from the second, shape (3,).
    """

    distance: float
    points: FloatArray
    normal: FloatArray


class DistanceMeter:
    """Measures distances; it holds Coal's working memory, so each thread needs its own."""

    def __init__(self) -> None:
        self._request = coal.DistanceRequest()
        self._request.enable_signed_distance = True
        self._request.gjk_tolerance = TOLERANCE
        self._result, self._spot = coal.DistanceResult(), coal.DistanceResult()
        self._first, self._second = coal.Transform3s(), coal.Transform3s()
        self._here, self._point = coal.Transform3s(), coal.Sphere(0.0)

    def distance(self, first: Placed, second: Placed, most: float = math.inf) -> float:
        """Distance between two solids [m]; not above 0 where they overlap.

        Args:
            first: A solid.
            second: Another one.
            most: Nothing beyond this is of interest [m]: of meshes that are taken as they are, and
                of cells, that are farther apart, it is not less than this, and not more than the
                distance.
        """
        if _cells_second(first, second):
            first, second = second, first
        if first.solid.cells is not None and second.solid.shape.kind == "ellipsoid":
            first, second = _in_axes_of(second, first), Placed(second.solid, np.eye(3), np.zeros(3))
        self._first.setTransform(first.rotation, first.origin)
        self._second.setTransform(second.rotation, second.origin)
        a, b = first.solid, second.solid
        if a.around is not None or b.around is not None:
            # Triangles and cells are many. The hull is never farther away, and where it is nearest,
            # they themselves are not far.
            near = self._between(a.around or a.geometry, b.around or b.geometry)
            most = max(most, ROUNDING)  # Coal measures nothing where 0 is known already
            if near >= most:
                return near
            if near > ROUNDING:
                points = self._result.getNearestPoint1(), self._result.getNearestPoint2()
                off = self._off(a, self._first, points[0]) + self._off(b, self._second, points[1])
                if off <= ON_SURFACE:
                    return near
                most = min(most, near + off + ROUNDING)
            return self._between(a.geometry, b.geometry, most)
        return self._between(a.geometry, b.geometry)

    def _between(self, first: Any, second: Any, most: float = math.inf) -> float:
        """Coal's distance between two geometries [m], or `most` if that is less."""
        result = self._result
        result.clear()
        if most < math.inf:
            result.min_distance = most
        coal.distance(first, self._first, second, self._second, self._request, result)
        return float(result.min_distance)

    def _off(self, solid: Solid, placement: Any, point: Any) -> float:
        """How far a point is off a mesh as it is or off cells [m]; 0 for all that is convex."""
        if solid.around is None:
            return 0.0
        self._here.setTranslation(point)
        self._spot.clear()
        coal.distance(solid.geometry, placement, self._point, self._here, self._request, self._spot)
        return max(float(self._spot.min_distance), 0.0)

    @property
    def normal(self) -> FloatArray:
        """Unit vector from the second solid to the first, of the last distance, shape (3,)."""
        return -np.array(self._result.normal)

    def nearest(self, first: Placed, second: Placed) -> Nearest:
        """Nearest points of two solids, as `distance`."""
        if _cells_second(first, second):
            found = self.nearest(second, first)
            return Nearest(found.distance, found.points[::-1], -found.normal)
        distance = self.distance(first, second)
        points = np.array([self._result.getNearestPoint1(), self._result.getNearestPoint2()])
        normal = self.normal
        if first.solid.cells is not None and second.solid.shape.kind == "ellipsoid":
            points = points @ second.rotation.T + second.origin
            normal = second.rotation @ normal
        apart = points[0] - points[1]
        if distance > ROUNDING and np.linalg.norm(apart) > ROUNDING:
            normal = apart / np.linalg.norm(apart)
        return Nearest(distance, points, normal)


def _cells_second(first: Placed, second: Placed) -> bool:
    """Whether Coal would give the nearest points of two solids in the wrong order."""
    return second.solid.cells is not None and first.solid.cells is None


def _in_axes_of(other: Placed, one: Placed) -> Placed:
    """A solid in the axes of another: Coal's boxes around ellipsoids that turn are too small."""
    turn = other.rotation.T
    return Placed(one.solid, turn @ one.rotation, turn @ (one.origin - other.origin))


def nearest_of_bodies(
    meter: DistanceMeter,
    first: Body,
    second: Body,
    rotation: FloatArray,
    origin: FloatArray,
) -> Nearest:
    """Nearest points of two bodies.

    Args:
        meter: Measures.
        first: A body.
        second: Another one.
        rotation: Of all joints, shape (n + 1, 3, 3).
        origin: Of all joints [m], shape (n + 1, 3).
    """
    pairs = _pairs(first, second, rotation, origin)
    return min((meter.nearest(a, b) for a, b in pairs), key=lambda one: one.distance)


def nearer_than(
    meter: DistanceMeter,
    first: Body,
    second: Body,
    rotation: FloatArray,
    origin: FloatArray,
    margin: float,
) -> bool:
    """Whether two bodies are no farther apart than a margin, or one is inside the other.

    Args:
        meter: Measures.
        first: A body.
        second: Another one.
        rotation: Of all joints, shape (n + 1, 3, 3).
        origin: Of all joints [m], shape (n + 1, 3).
        margin: Clearance to keep [m].
    """
    return any(
        meter.distance(a, b, margin + ROUNDING) <= margin or one_inside_the_other(a, b)
        for a, b in _pairs(first, second, rotation, origin)
    )


def _pairs(
    first: Body, second: Body, rotation: FloatArray, origin: FloatArray
) -> Iterator[tuple[Placed, Placed]]:
    return itertools.product(
        placed_solids(first, rotation, origin), placed_solids(second, rotation, origin)
    )
