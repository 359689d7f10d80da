"""Distances between solids, by Coal."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import coal
import numpy as np

from knotwork.scene.bodies import Body
from knotwork.scene.solids import Solid, winding_number
from knotwork.waypoints import FloatArray

TOLERANCE = 1e-8
"""Of the search for the nearest points."""

ROUNDING = 1e-6
"""Distances may be wrong by so much [m]: by the search for the nearest points, which ends some
1e-8 from the truth, and by the rounding of corners and placements."""


@dataclass(frozen=True, eq=False)
class Nearest:
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
        self._result = coal.DistanceResult()
        self._first, self._second = coal.Transform3s(), coal.Transform3s()

    def distance(
        self,
        first: Solid,
        rotation1: FloatArray,
        origin1: FloatArray,
        second: Solid,
        rotation2: FloatArray,
        origin2: FloatArray,
    ) -> float:
        """Distance between two solids [m]; not above 0 where they overlap.

        Args:
            first: A solid.
            rotation1: Of its own axes, shape (3, 3).
            origin1: Of its own axes [m], shape (3,).
            second: Another one.
            rotation2: Of its own axes.
            origin2: Of its own axes.
        """
        here, there, result = self._first, self._second, self._result
        here.setRotation(rotation1)
        here.setTranslation(origin1)
        there.setRotation(rotation2)
        there.setTranslation(origin2)
        result.clear()
        coal.distance(first.geometry, here, second.geometry, there, self._request, result)
        return float(result.min_distance)

    def nearest(
        self,
        first: Solid,
        rotation1: FloatArray,
        origin1: FloatArray,
        second: Solid,
        rotation2: FloatArray,
        origin2: FloatArray,
    ) -> Nearest:
        """Nearest points of two solids, as `distance`."""
        distance = self.distance(first, rotation1, origin1, second, rotation2, origin2)
        points = np.array([self._result.getNearestPoint1(), self._result.getNearestPoint2()])
        normal = -np.array(self._result.normal)
        apart = points[0] - points[1]
        if distance > ROUNDING and np.linalg.norm(apart) > ROUNDING:
            normal = apart / np.linalg.norm(apart)
        return Nearest(distance, points, normal)


def one_inside_the_other(
    first: Solid,
    rotation1: FloatArray,
    origin1: FloatArray,
    second: Solid,
    rotation2: FloatArray,
    origin2: FloatArray,
) -> bool:
    """Whether one of two solids whose surfaces do not meet is inside the other.

    Coal takes a mesh for its surface: the distance from inside it is positive. Every connected part
    of the inner one is looked at.
    """
    for outer, turn, shift, inner, turned, shifted in (
        (first, rotation1, origin1, second, rotation2, origin2),
        (second, rotation2, origin2, first, rotation1, origin1),
    ):
        if outer.triangles is None or inner.plane is not None:
            continue
        points = _points(inner) @ turned.T + shifted
        if any(_is_inside(outer, point) for point in (points - shift) @ turn):
            return True
    return False


def _is_inside(solid: Solid, point: FloatArray) -> bool:
    """Whether a point is inside a mesh that is taken as it is, whichever way its triangles wind.

    A part within another one that winds the other way is the wall of a cavity, which is outside.
    Where parts overlap otherwise, what two of them enclose is inside.
    """
    if solid.triangles is None or solid.parts is None:
        return False
    around, winds = [], 0
    for part in range(solid.parts.max() + 1):
        triangles = solid.triangles[solid.parts == part]
        winding = round(winding_number(triangles, point))
        if winding:
            winds += winding
            corners = triangles.reshape(-1, 3)
            around.append((corners.min(axis=0), corners.max(axis=0)))
    if winds or not around:
        return winds != 0
    around.sort(key=lambda box: -float(np.prod(box[1] - box[0])))
    nested = all(
        (outer[0] < inner[0]).all() and (inner[1] < outer[1]).all()
        for outer, inner in itertools.pairwise(around)
    )
    return not nested


def _points(solid: Solid) -> FloatArray:
    """A point of each connected part of a solid, in its own axes [m], shape (m, 3)."""
    if solid.triangles is not None and solid.parts is not None:
        _, first = np.unique(solid.parts, return_index=True)
        return np.asarray(solid.triangles[first, 0])
    if isinstance(solid.geometry, coal.Convex):
        return np.array([solid.geometry.point(0)])
    return np.zeros((1, 3))  # the middle of the other solids


def world_axes(
    solid: Solid, rotation: FloatArray, origin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rotation and origin of a solid's own axes, from those of the joint that carries it."""
    return rotation @ solid.rotation, rotation @ solid.translation + origin


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
    found = [
        meter.nearest(
            a,
            *world_axes(a, rotation[first.joint], origin[first.joint]),
            b,
            *world_axes(b, rotation[second.joint], origin[second.joint]),
        )
        for a in first.solids
        for b in second.solids
    ]
    return min(found, key=lambda one: one.distance)
