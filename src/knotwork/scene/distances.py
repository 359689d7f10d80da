"""Distances between solids, by Coal."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import coal
import numpy as np

from knotwork.arrays import FloatArray
from knotwork.scene.bodies import Body, place_solids
from knotwork.scene.containment import is_one_inside_other
from knotwork.scene.solids import Placed, Solid

NEAREST_POINT_TOLERANCE = 1e-9
"""Tolerance of the search for the nearest points."""

DISTANCE_ERROR = 1e-6
"""Largest error of distances [m]: 1.4e-7 or less from the search for the nearest points, in
120 000 random pairs, plus the rounding of corners and placements."""

SURFACE_TOLERANCE = 1e-7
"""Distance within which points are on a mesh [m]."""


def _settle_boxes() -> None:
    """Make Coal compute with exact boxes.

    The first support direction that a process evaluates for a box affects all later ones (`static`
    in Coal 3.0). If it contains a zero, every box is wider by 1e-10 of its size on one side.
    Distances would then depend on earlier ones.
    """
    turned = coal.Transform3s()
    turned.setRotation(np.array([[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]]) / 3.0)
    turned.setTranslation(np.array([3.0, 0.0, 0.0]))
    pair = coal.Capsule(1.0, 1.0), coal.Transform3s(), coal.Box(1.0, 1.0, 1.0), turned
    coal.distance(*pair, coal.DistanceRequest(), coal.DistanceResult())


_settle_boxes()  # before any other distance is computed


class Nearest(NamedTuple):
    """The nearest points of two bodies, or the points of deepest penetration.

    Attributes:
        distance: Distance [m], or minus the penetration depth.
        points: Points on the first and the second body [m], shape (2, 3).
        normal: Unit vector along which the first body moves away from the second, shape (3,).
    """

    distance: float
    points: FloatArray
    normal: FloatArray


class DistanceMeter:
    """Measures distances with Coal's working memory; each thread needs its own."""

    def __init__(self) -> None:
        self._request = coal.DistanceRequest()
        self._request.enable_signed_distance = True
        self._request.gjk_tolerance = NEAREST_POINT_TOLERANCE
        self._result, self._hull_result = coal.DistanceResult(), coal.DistanceResult()
        self._first, self._second = coal.Transform3s(), coal.Transform3s()
        self._point_placement, self._point = coal.Transform3s(), coal.Sphere(0.0)

    def distance(self, first: Placed, second: Placed, max_distance: float = math.inf) -> float:
        """Distance between two solids [m], at most 0 if they overlap.

        Args:
            first: A solid.
            second: Another one.
            max_distance: Upper bound of relevant distances [m]. For exact meshes and cells farther
                away, the result is between this bound and the distance.
        """
        if _must_be_swapped(first, second):
            first, second = second, first
        if first.solid.cells is not None and second.solid.shape.kind == "ellipsoid":
            first = _express_in_axes(second, first)
            second = Placed(second.solid, np.eye(3), np.zeros(3))
        self._first.setTransform(first.rotation, first.origin)
        self._second.setTransform(second.rotation, second.origin)
        a, b = first.solid, second.solid
        if a.outer_hull is not None or b.outer_hull is not None:
            # The hull has fewer faces than the mesh or cells, so it is measured first. It is never
            # farther away than they are.
            near = self._coal_distance(a.outer_hull or a.geometry, b.outer_hull or b.geometry)
            # Coal skips the measurement if 0 is known already.
            max_distance = max(max_distance, DISTANCE_ERROR)
            if near >= max_distance:
                return near
            if near > DISTANCE_ERROR:
                points = self._result.getNearestPoint1(), self._result.getNearestPoint2()
                inside = self._hull_distance(a, self._first, points[0])
                inside += self._hull_distance(b, self._second, points[1])
                if inside <= SURFACE_TOLERANCE:
                    return near
                max_distance = min(max_distance, near + inside + DISTANCE_ERROR)
            return self._coal_distance(a.geometry, b.geometry, max_distance)
        return self._coal_distance(a.geometry, b.geometry)

    def _coal_distance(self, first: Any, second: Any, max_distance: float = math.inf) -> float:
        """Coal's distance between two geometries [m], or `max_distance` if that is less."""
        result = self._result
        result.clear()
        if max_distance < math.inf:
            result.min_distance = max_distance
        coal.distance(first, self._first, second, self._second, self._request, result)
        return float(result.min_distance)

    def _hull_distance(self, solid: Solid, placement: Any, point: Any) -> float:
        """Distance of a point of the hull from the mesh or cells in it [m]; 0 without a hull."""
        if solid.outer_hull is None:
            return 0.0
        self._point_placement.setTranslation(point)
        self._hull_result.clear()
        second = self._point, self._point_placement
        coal.distance(solid.geometry, placement, *second, self._request, self._hull_result)
        return max(float(self._hull_result.min_distance), 0.0)

    def distance_and_normal(
        self, first: Placed, second: Placed, max_distance: float = math.inf
    ) -> tuple[float, FloatArray]:
        """As `distance`, with the unit vector from the second solid to the first, shape (3,).

        The vector is only for convex solids; others may be swapped, or in other axes.
        """
        distance = self.distance(first, second, max_distance)
        return distance, -self._result.normal

    def nearest(self, first: Placed, second: Placed) -> Nearest:
        """Nearest points of two solids; arguments as for `distance`."""
        if _must_be_swapped(first, second):
            swapped = self.nearest(second, first)
            return Nearest(swapped.distance, swapped.points[::-1], -swapped.normal)
        distance, normal = self.distance_and_normal(first, second)
        points = np.array([self._result.getNearestPoint1(), self._result.getNearestPoint2()])
        if first.solid.cells is not None and second.solid.shape.kind == "ellipsoid":
            points = points @ second.rotation.T + second.origin
            normal = second.rotation @ normal
        offset = points[0] - points[1]
        if distance > DISTANCE_ERROR and np.linalg.norm(offset) > DISTANCE_ERROR:
            normal = offset / np.linalg.norm(offset)
        return Nearest(distance, points, normal)


def _must_be_swapped(first: Placed, second: Placed) -> bool:
    """Whether only the second solid has cells; Coal would then confuse the nearest points."""
    return second.solid.cells is not None and first.solid.cells is None


def _express_in_axes(frame: Placed, solid: Placed) -> Placed:
    """Express a solid in the axes of another; Coal's bounds of rotated ellipsoids are too small."""
    to_frame = frame.rotation.T
    origin = to_frame @ (solid.origin - frame.origin)
    return Placed(solid.solid, to_frame @ solid.rotation, origin)


def find_nearest_points(
    first: Body, second: Body, rotation: FloatArray, origin: FloatArray
) -> Nearest:
    """Find the nearest points of two bodies.

    Args:
        first: A body.
        second: Another one.
        rotation: Rotations of all joints, shape (n + 1, 3, 3).
        origin: Origins of all joints [m], shape (n + 1, 3).
    """
    meter = DistanceMeter()
    pairs = _pair_solids(first, second, rotation, origin)
    return min((meter.nearest(a, b) for a, b in pairs), key=lambda nearest: nearest.distance)


def are_nearer_than(
    first: Body, second: Body, rotation: FloatArray, origin: FloatArray, required_clearance: float
) -> bool:
    """Whether two bodies are nearer than a clearance, or one is inside the other.

    Args:
        first: A body.
        second: Another one.
        rotation: Rotations of all joints, shape (n + 1, 3, 3).
        origin: Origins of all joints [m], shape (n + 1, 3).
        required_clearance: Required clearance [m].
    """
    meter = DistanceMeter()
    return any(
        meter.distance(a, b, required_clearance + DISTANCE_ERROR) <= required_clearance
        or is_one_inside_other(a, b)
        for a, b in _pair_solids(first, second, rotation, origin)
    )


def _pair_solids(
    first: Body, second: Body, rotation: FloatArray, origin: FloatArray
) -> Iterator[tuple[Placed, Placed]]:
    return itertools.product(
        place_solids(first, rotation, origin), place_solids(second, rotation, origin)
    )
