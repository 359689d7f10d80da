"""Solids for distances with Coal, made from shapes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import coal
import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.errors import InputError
from knotwork.scene.cells import CUBE_CORNERS, Cells, read_cells
from knotwork.scene.hulls import make_convex_hull
from knotwork.scene.meshes.mesh_files import read_corners, read_mesh
from knotwork.task.scenario import PlacedShape

MAX_SIZE = 500.0
"""Size limit of a solid along its own axes [m].

Distances from solids up to this size have errors below 4e-7 m, from those of 1500 m up to 30 mm (in
10 000 random pairs of each two kinds).
"""


@dataclass(frozen=True, eq=False)
class Solid:
    """A shape as Coal geometry, placed in the axes of the joint that carries it.

    Attributes:
        shape: The shape.
        geometry: Coal's geometry.
        rotation: Rotation of its own axes in those of the joint, shape (3, 3).
        translation: Origin of its own axes in those of the joint [m], shape (3,).
        corners: Corners of a box around it in the axes of the joint [m], shape (8, 3); infinite for
            a half space.
        plane: Unit normal and offset of a half space in the joint's axes, shape (4,), or `None`.
        triangles: Triangles of an exact mesh in its own axes [m], shape (n, 3, 3), or `None`.
        parts: Index of the connected part of each of those triangles, shape (n,), or `None`.
        outer_hull: Convex hull of an exact mesh or of cells in Coal's type; `None` for a convex
            solid.
        cells: Cells of a point cloud, or `None`.
    """

    shape: PlacedShape
    geometry: Any
    rotation: FloatArray
    translation: FloatArray
    corners: FloatArray
    plane: FloatArray | None = None
    triangles: FloatArray | None = None
    parts: IndexArray | None = None
    outer_hull: Any = None
    cells: Cells | None = None

    @property
    def hull(self) -> FloatArray | None:
        """Triangles of the convex hull of a mesh, in its own axes [m], shape (m, 3, 3)."""
        if not isinstance(self.geometry, coal.Convex):
            return None
        faces = [self.geometry.polygons(i) for i in range(self.geometry.num_polygons)]
        index = np.array([[face[k] for k in range(3)] for face in faces])
        return np.asarray(np.array(self.geometry.points())[index])

    @property
    def radius(self) -> float:
        """Radius of the sphere through the corners of its box [m]."""
        return float(np.linalg.norm(self.corners[-1] - self.corners[0]) / 2)


class Placed(NamedTuple):
    """A solid and its placement.

    Attributes:
        solid: The solid.
        rotation: Rotation of its own axes, shape (3, 3).
        origin: Origin of its own axes [m], shape (3,).
    """

    solid: Solid
    rotation: FloatArray
    origin: FloatArray


_PRIMITIVE_SHAPES = {
    "box": coal.Box,
    "sphere": coal.Sphere,
    "cylinder": coal.Cylinder,
    "capsule": coal.Capsule,
    "cone": coal.Cone,
    "ellipsoid": coal.Ellipsoid,
}


def make_solid(shape: PlacedShape, axes: Any) -> Solid:
    """Make the solid of a shape.

    Args:
        shape: Its shape.
        axes: `pin.SE3` of the axes in which the shape is placed, in those of the joint.

    Raises:
        InputError: A file can't be read, an exact mesh is not watertight, points fill too many
            cells, or the solid is larger than `MAX_SIZE`.
    """
    placed = axes * shape.placement
    rotation, translation = np.array(placed.rotation), np.array(placed.translation)
    plane = triangles = parts = hull = cells = None
    if shape.path is not None:
        try:
            changed = shape.path.stat().st_mtime_ns
        except OSError as error:
            raise InputError(f"{shape.path} can't be read: {error.strerror}") from error
        if shape.kind == "points":
            cells = read_cells(shape.path, changed, shape.scale[0], shape.resolution, shape.units)
            geometry, hull = _make_octree(cells)
        elif shape.exact:
            geometry, triangles, parts, hull = _read_exact_mesh(shape.path, changed, shape.scale)
        else:
            geometry = _read_hull(shape.path, changed, shape.scale)
    elif shape.kind == "half_space":
        normal = rotation @ np.array(shape.size[:3])
        plane = np.array([*normal, shape.size[3] + normal @ translation])
        geometry = coal.Halfspace(np.array(shape.size[:3]), shape.size[3])
    else:
        geometry = _PRIMITIVE_SHAPES[shape.kind](*shape.size)
    corners = np.full((8, 3), np.inf)
    if plane is None:
        low, high = _find_box(geometry, cells)
        if (size := np.max(high - low)) > MAX_SIZE:
            raise InputError(
                f"is {size:.6g} m long, too long for exact distances; accepted: up to "
                f"{MAX_SIZE:g} m, or a half_space"
            )
        corners = (low + CUBE_CORNERS * (high - low)) @ rotation.T + translation
    return Solid(
        shape,
        geometry,
        rotation=rotation,
        translation=translation,
        corners=corners,
        plane=plane,
        triangles=triangles,
        parts=parts,
        outer_hull=hull,
        cells=cells,
    )


def _find_box(geometry: Any, cells: Cells | None) -> tuple[FloatArray, FloatArray]:
    """Find the lowest and the highest corner of the box around a geometry, in its axes [m]."""
    if cells is not None:  # Coal's box around them is rounded to a few 1e-8 of its size
        return cells.outermost.min(axis=0), cells.outermost.max(axis=0)
    geometry.computeLocalAABB()
    return np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)


def support_values(solid: Solid, directions: FloatArray) -> FloatArray:
    """Largest value of n·p over the points p of a convex solid [m], shape (m,).

    Args:
        solid: Solid in its own axes.
        directions: Unit vectors n, shape (m, 3); for a half space, its normal.
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


@lru_cache(maxsize=256)
def _read_hull(path: Path, changed: int, scale: tuple[float, float, float]) -> Any:
    """Make the convex hull of a mesh file; `changed`, its time of change, is a key of the cache."""
    return make_convex_hull(read_corners(path) * np.array(scale))


@lru_cache(maxsize=32)
def _make_octree(cells: Cells) -> tuple[Any, Any]:
    """Convert cells to Coal's type, and make their convex hull."""
    return cells.octree(), make_convex_hull(cells.outermost)


@lru_cache(maxsize=32)
def _read_exact_mesh(
    path: Path, changed: int, scale: tuple[float, float, float]
) -> tuple[Any, FloatArray, IndexArray, Any]:
    """Read an exact mesh: Coal's mesh, corners and part of each triangle, and the hull."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    parts = read_mesh(path)
    corners = np.concatenate([part.points[part.triangles] for part in parts]) * np.array(scale)
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward, count = np.unique(edges, axis=0, return_counts=True)
    backward = np.unique(edges[:, ::-1], axis=0)
    if (count > 1).any() or not np.array_equal(forward, backward):
        raise InputError(
            f"mesh {path} is not watertight, so it has no inside; close it, or leave out "
            "exact to use its convex hull"
        )
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(faces), len(points))
    mesh.addVertices(points)
    mesh.addTriangles(faces)
    mesh.endModel()
    joined = coo_array((np.ones(len(edges)), edges.T), shape=(len(points), len(points)))
    part = np.asarray(connected_components(joined, directed=False)[1], dtype=np.intp)
    return mesh, points[faces], part[faces[:, 0]], make_convex_hull(points)
