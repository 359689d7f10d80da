"""Convex hulls as Coal has them, however many corners they have and lie in one plane.

Coal takes no corner with more than 254 neighbours, as tips of cones have, and Qhull is slow where
very many points are in one plane. So a hull of many points, or with such a corner, is made a little
larger: each point is moved away from the middle, by a part of its distance that is different for
each and larger farther out. That bends flat faces, and each point is still in the hull, because
it lies between the middle and where it is moved to. Around a corner with too many neighbours a
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

LARGER = 1.1e-5
"""A hull is larger by no more than this part of the largest distance from its middle."""

FEW = 1000
"""So few points are left where they are, unless a corner has too many neighbours."""

LIFT = 1e-7
"""Points move outwards by at most this fraction of their distance from the middle."""

NOISE = 1e-2
"""Part of that in which points at one distance differ."""

UNEVEN = np.array([1.0, 0.7, 0.4])
"""Points go farther along the first axis than along the others: a circle is bent as well."""

CROWN = 1e-5
"""Distance of the points of a crown from their corner, in standard deviations of the outermost."""

SMALLER = 0.02
"""Crowns of points of crowns are smaller by this factor."""

MOST_NEIGHBOURS = 250
"""A corner with more gets a crown."""

SHARE = 100
"""Of the neighbours for each point of a crown."""

MOST_POINTS = 60
"""Of a crown: they are neighbours of one another."""

ROUNDS = 4
"""So often crowns are added at most."""

THIN = 1e-6
"""Points that are thinner than this part of their length are taken for a sheet."""

THICKNESS = 1e-4
"""A sheet is thickened by this to both sides [m]."""

_DIRECTIONS = np.array([w for w in itertools.product((-1, 0, 1), repeat=3) if any(w)])


def convex_hull(points: FloatArray) -> Any:
    """Convex hull of points [m], shape (n, 3), as Coal has it; larger by `LARGER` at most.

    Flat bodies are thickened by `THICKNESS` to both sides: a hull needs an inside.

    Raises:
        InputError: There is none.
    """
    points = points[np.lexsort(points.T)]
    points = points[np.append(True, np.any(points[1:] != points[:-1], axis=1))]
    points = _thickened(points)
    if len(points) <= FEW:
        try:
            return coal.ConvexBase.convexHull(_vectors(points), True, "Qt")
        except Exception:  # Boost.Python passes on whatever Coal throws
            pass  # a corner has too many neighbours
    return _bent(points)


def _thickened(points: FloatArray) -> FloatArray:
    """Points of a sheet, or of a wire, with some on both sides of it."""
    spread, axes = np.linalg.eigh(np.cov(points.T, bias=True))
    for axis in axes.T[spread <= (THIN**2) * max(spread[-1], THICKNESS**2)]:
        points = np.concatenate([points - THICKNESS * axis, points + THICKNESS * axis])
    return points


def _bent(points: FloatArray) -> Any:
    """Convex hull of points that are moved outwards, with crowns.

    Qhull works in axes in which the points are as wide as they are long, so that thin plates are
    bent as much as all else.
    """
    from scipy.spatial import ConvexHull, QhullError

    middle, there, back = _round_axes(points)
    at = (points - middle) @ there
    height = at**2 @ UNEVEN
    chance = np.random.default_rng(0).random(len(at))
    at = at * (1.0 + LIFT * (height / height.max() + NOISE * chance))[:, None]
    try:
        hull = ConvexHull(at, qhull_options="Qt Q12")
        for k in range(ROUNDS):
            crowded = np.flatnonzero(np.bincount(hull.simplices.ravel()) > MOST_NEIGHBOURS)
            if not len(crowded):
                break
            crowns = [_crown(hull, corner, CROWN * SMALLER**k) for corner in crowded.tolist()]
            at = np.concatenate([at[hull.vertices], *crowns])
            hull = ConvexHull(at, qhull_options="Qt Q12")
        index = np.zeros(len(at), dtype=int)
        index[hull.vertices] = np.arange(len(hull.vertices))
        triangles = coal.StdVec_Triangle()
        triangles.extend([coal.Triangle(*corners) for corners in _outward(hull, index).tolist()])
        return coal.Convex(_vectors(at[hull.vertices] @ back + middle), triangles)
    except (QhullError, RuntimeError) as error:
        raise InputError(f"the convex hull of {len(points)} points can't be made") from error


def _round_axes(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The middle of some outermost points, axes in which these are as wide as long, and back.

    Only outermost points count: those of a cone are nearly all at its base.
    """
    for _ in range(2):
        middle = points.mean(axis=0)
        spread, axes = np.linalg.eigh(np.cov(points.T, bias=True))
        there, back = axes / np.sqrt(spread), (axes * np.sqrt(spread)).T
        outermost = np.unique((points @ there @ _DIRECTIONS.T).argmax(axis=0))
        points = points[outermost]
    return middle, there, back


def _crown(hull: Any, corner: int, radius: float) -> FloatArray:
    """Points around a corner, each towards the outside of some of the facets there."""
    normals = hull.equations[(hull.simplices == corner).any(axis=1), :3]
    up = normals.mean(axis=0)
    across = np.linalg.svd(up[None])[2][1:]
    flat = normals @ across.T
    order = np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))
    count = min(MOST_POINTS, math.ceil(len(order) / SHARE))
    chosen = flat[order[np.arange(count) * len(order) // count]] @ across
    chosen /= np.linalg.norm(chosen, axis=1)[:, None]
    return np.asarray(hull.points[corner] + radius * chosen)


def _outward(hull: Any, index: Any) -> Any:
    """Corners of the hull's triangles, anticlockwise seen from outside, shape (n, 3)."""
    a, b, c = hull.points[hull.simplices.T]
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles = index[hull.simplices]
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles


def _vectors(points: FloatArray) -> Any:
    """Points as Coal takes them."""
    vectors = coal.StdVec_Vec3s()
    vectors.extend(list(points))
    return vectors
