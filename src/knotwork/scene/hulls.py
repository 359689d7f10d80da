"""Convex hulls for Coal, of any number of corners and of coplanar points.

Coal rejects corners with more than 254 neighbours, such as tips of cones, and Qhull is slow for
many coplanar points. So a hull of many points, or with such a corner, is made slightly larger:
each point is moved away from the centre, by a fraction of its distance that differs between
points and grows outwards. That bends flat faces, and each point is still in the hull, because
it lies between the centre and its new position. Around a corner with too many neighbours a
crown of points is added, which share them.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import coal
import numpy as np

from knotwork.errors import InputError
from knotwork.waypoints import FloatArray

MOST_GROWTH = 1.1e-5
"""Largest growth of a hull, as a fraction of the largest distance from its centre."""

UNMOVED_POINTS = 1000
"""Number of points up to which none is moved, unless a corner has too many neighbours."""

MOST_LIFT = 1e-7
"""Largest outward shift, as a fraction of the distance from the centre."""

LIFT_NOISE = 1e-2
"""Fraction of it by which points at the same distance differ."""

AXIS_LIFTS = np.array([1.0, 0.7, 0.4])
"""Extra shift along the first axis, so that a circle is bent as well."""

CROWN_RADIUS = 1e-5
"""Distance of the points of a crown from their corner, in standard deviations of the outermost."""

CROWN_SHRINK = 0.02
"""Ratio of the sizes of crowns around points of crowns."""

MOST_NEIGHBOURS = 250
"""Number of neighbours beyond which a corner gets a crown."""

NEIGHBOURS_PER_CROWN_POINT = 100
"""Number of neighbours for each point of a crown."""

MOST_CROWN_POINTS = 60
"""Largest number of points of a crown, which are neighbours of one another."""

CROWN_ROUNDS = 4
"""Largest number of rounds in which crowns are added."""

SHEET_RATIO = 1e-6
"""Ratio of thickness and length below which points count as a sheet."""

SHEET_THICKNESS = 1e-4
"""Thickness added to a sheet on both sides [m]."""

_DIRECTIONS = np.array([w for w in itertools.product((-1, 0, 1), repeat=3) if any(w)])


def convex_hull(points: FloatArray) -> Any:
    """Convex hull of points [m], shape (n, 3), for Coal; larger by `MOST_GROWTH` at most.

    Flat bodies are thickened by `SHEET_THICKNESS` to both sides: a hull needs an inside.

    Raises:
        InputError: The hull can't be made.
    """
    points = points[np.lexsort(points.T)]
    points = points[np.append(True, np.any(points[1:] != points[:-1], axis=1))]
    points = _thicken_sheet(points)
    if len(points) <= UNMOVED_POINTS:
        try:
            return coal.ConvexBase.convexHull(_vectors(points), True, "Qt")
        except Exception:  # Boost.Python forwards any exception of Coal
            pass  # a corner has too many neighbours
    return _bend_hull(points)


def _thicken_sheet(points: FloatArray) -> FloatArray:
    """Points of a sheet, or of a wire, with extra points on both sides."""
    spread, axes = np.linalg.eigh(np.cov(points.T, bias=True))
    for axis in axes.T[spread <= (SHEET_RATIO**2) * max(spread[-1], SHEET_THICKNESS**2)]:
        points = np.concatenate([points - SHEET_THICKNESS * axis, points + SHEET_THICKNESS * axis])
    return points


def _bend_hull(points: FloatArray) -> Any:
    """Convex hull of points moved outwards, with crowns.

    Qhull works in axes in which the points are as wide as they are long, so that thin plates are
    bent as much as other bodies.
    """
    from scipy.spatial import ConvexHull, QhullError

    middle, to_round, from_round = _round_axes(points)
    at = (points - middle) @ to_round
    height = at**2 @ AXIS_LIFTS
    chance = np.random.default_rng(0).random(len(at))
    at = at * (1.0 + MOST_LIFT * (height / height.max() + LIFT_NOISE * chance))[:, None]
    try:
        hull = ConvexHull(at, qhull_options="Qt Q12")
        for k in range(CROWN_ROUNDS):
            crowded = np.flatnonzero(np.bincount(hull.simplices.ravel()) > MOST_NEIGHBOURS)
            if not len(crowded):
                break
            crowns = [
                _crown_points(hull, corner, CROWN_RADIUS * CROWN_SHRINK**k)
                for corner in crowded.tolist()
            ]
            at = np.concatenate([at[hull.vertices], *crowns])
            hull = ConvexHull(at, qhull_options="Qt Q12")
        index = np.zeros(len(at), dtype=int)
        index[hull.vertices] = np.arange(len(hull.vertices))
        triangles = coal.StdVec_Triangle()
        triangles.extend([coal.Triangle(*corners) for corners in _outward(hull, index).tolist()])
        return coal.Convex(_vectors(at[hull.vertices] @ from_round + middle), triangles)
    except (QhullError, RuntimeError) as error:
        raise InputError(f"the convex hull of {len(points)} points can't be made") from error


def _round_axes(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centre of some outermost points, axes in which they are as wide as long, and the inverse.

    Only outermost points count: nearly all points of a cone are at its base.
    """
    for _ in range(2):
        middle = points.mean(axis=0)
        spread, axes = np.linalg.eigh(np.cov(points.T, bias=True))
        to_round, from_round = axes / np.sqrt(spread), (axes * np.sqrt(spread)).T
        outermost = np.unique((points @ to_round @ _DIRECTIONS.T).argmax(axis=0))
        points = points[outermost]
    return middle, to_round, from_round


def _crown_points(hull: Any, corner: int, radius: float) -> FloatArray:
    """Points around a corner, each outside some of the facets there."""
    normals = hull.equations[(hull.simplices == corner).any(axis=1), :3]
    up = normals.mean(axis=0)
    across = np.linalg.svd(up[None])[2][1:]
    flat = normals @ across.T
    order = np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))
    count = min(MOST_CROWN_POINTS, math.ceil(len(order) / NEIGHBOURS_PER_CROWN_POINT))
    chosen = flat[order[np.arange(count) * len(order) // count]] @ across
    chosen /= np.linalg.norm(chosen, axis=1)[:, None]
    return np.asarray(hull.points[corner] + radius * chosen)


def _outward(hull: Any, index: Any) -> Any:
    """Corners of the hull's triangles, counter-clockwise from outside, shape (n, 3)."""
    a, b, c = hull.points[hull.simplices.T]
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles = index[hull.simplices]
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles


def _vectors(points: FloatArray) -> Any:
    """Points in Coal's type."""
    vectors = coal.StdVec_Vec3s()
    vectors.extend(list(points))
    return vectors
