"""How far convex solids reach along directions."""

from __future__ import annotations

import numpy as np

from knotwork.scene.solids import Solid
from knotwork.waypoints import FloatArray


def support(solid: Solid, directions: FloatArray) -> FloatArray:
    """Largest value of n·p over the points p of a convex solid [m], shape (m,).

    Args:
        solid: In its own axes.
        directions: Unit vectors n, shape (m, 3); of a half space, its normal.
    """
    kind, size = solid.shape.kind, solid.shape.size
    along, across = directions[:, 2], np.hypot(directions[:, 0], directions[:, 1])
    if kind == "box":
        return np.asarray(np.abs(directions) @ np.array(size) / 2)
    if kind == "sphere":
        return np.full(len(directions), size[0])
    if kind == "ellipsoid":
        return np.asarray(np.linalg.norm(directions * np.array(size), axis=1))
    if kind == "capsule":
        return np.asarray(size[0] + np.abs(along) * size[1] / 2)
    if kind == "cylinder":
        return np.asarray(size[0] * across + np.abs(along) * size[1] / 2)
    if kind == "cone":
        return np.asarray(np.maximum(along * size[1] / 2, size[0] * across - along * size[1] / 2))
    if kind == "half_space":
        return np.full(len(directions), size[3])
    return np.asarray((directions @ np.array(solid.geometry.points()).T).max(axis=1))
