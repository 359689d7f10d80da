"""Containment of bodies in exact meshes, which Coal treats as surfaces."""

from __future__ import annotations

import itertools

import coal
import numpy as np

from knotwork.arrays import FloatArray
from knotwork.scene.solids import Placed, Solid


def is_one_inside_other(first: Placed, second: Placed) -> bool:
    """Whether one of two solids with separate surfaces is inside the other.

    Coal treats a mesh as a surface, so the distance from inside is positive. Every connected part
    of the inner solid is checked.
    """
    for outer, inner in ((first, second), (second, first)):
        if outer.solid.triangles is None or inner.solid.plane is not None:
            continue
        points = _sample_parts(inner.solid) @ inner.rotation.T + inner.origin
        points = (points - outer.origin) @ outer.rotation
        if any(_is_inside(outer.solid, point) for point in points):
            return True
    return False


def _is_inside(solid: Solid, point: FloatArray) -> bool:
    """Whether a point is inside an exact mesh, for either winding of its triangles.

    A part within another one of opposite winding is the wall of a cavity, which is outside. If
    parts overlap otherwise, the region enclosed by both is inside.
    """
    if solid.triangles is None or solid.parts is None:
        return False
    box = solid.geometry.aabb_local
    if (point < box.min_).any() or (point > box.max_).any():
        return False
    enclosing, total_winding = [], 0
    for part in range(solid.parts.max() + 1):
        triangles = solid.triangles[solid.parts == part]
        winding = round(winding_number(triangles, point))
        if winding:
            total_winding += winding
            corners = triangles.reshape(-1, 3)
            enclosing.append((corners.min(axis=0), corners.max(axis=0)))
    if total_winding or not enclosing:
        return total_winding != 0
    enclosing.sort(key=lambda box: -float(np.prod(box[1] - box[0])))
    nested = all(
        (outer[0] < inner[0]).all() and (inner[1] < outer[1]).all()
        for outer, inner in itertools.pairwise(enclosing)
    )
    return not nested


def _sample_parts(solid: Solid) -> FloatArray:
    """A point of each connected part of a solid, in its own axes [m], shape (m, 3)."""
    if solid.triangles is not None and solid.parts is not None:
        _, first = np.unique(solid.parts, return_index=True)
        return np.asarray(solid.triangles[first, 0])
    if solid.cells is not None:
        return solid.cells.point_of_each_part
    if isinstance(solid.geometry, coal.Convex):
        return np.array([solid.geometry.point(0)])
    return np.zeros((1, 3))  # the centre of the other solids


def winding_number(triangles: FloatArray, point: FloatArray) -> float:
    """Winding number of closed triangles, shape (n, 3, 3), about a point: ±1 inside, 0 outside.

    It is the sum of their solid angles (van Oosterom and Strackee, 1983) divided by 4π.
    """
    a, b, c = (triangles - point).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a))]
    denominator = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    return float(np.arctan2(volume, denominator).sum() / (2 * np.pi))
