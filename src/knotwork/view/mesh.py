"""Triangle meshes with normals and colours."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, IndexArray
from knotwork.scene.meshes.mesh_part import Colour, MeshPart

GREY: Colour = (0.75, 0.75, 0.75, 1.0)
CREASE = np.radians(35.0)
"""Angle between faces below which they are shaded as one smooth surface [rad]."""
MERGED_DIGITS = 7
"""Decimals to which corners of faces [m] must agree to count as one point."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a normal at each corner.

    Attributes:
        vertices: Points [m], shape (n, 3).
        normals: Unit vectors, shape (n, 3).
        faces: Indices of vertices, counter-clockwise from outside, shape (m, 3).
        colours: Red, green and blue of each vertex in 0 … 1, shape (n, 3).
        opacity: From 0, invisible, to 1, opaque.
    """

    vertices: FloatArray
    normals: FloatArray
    faces: IndexArray
    colours: FloatArray
    opacity: float = 1.0

    def move(self, rotation: ArrayLike, translation: ArrayLike) -> Mesh:
        """Turn, then shift the mesh.

        Args:
            rotation: Matrix, shape (3, 3).
            translation: Translation [m], shape (3,).
        """
        turn = np.asarray(rotation, dtype=float)
        vertices = self.vertices @ turn.T + np.asarray(translation, dtype=float)
        return replace(self, vertices=vertices, normals=self.normals @ turn.T)

    def shift(self, translation: ArrayLike) -> Mesh:
        """Shift the mesh by a vector [m], shape (3,)."""
        return self.move(np.eye(3), translation)

    def place(self, pose: pin.SE3) -> Mesh:
        """Move the mesh by a pose."""
        return self.move(pose.rotation, pose.translation)

    def scale(self, scale: ArrayLike) -> Mesh:
        """Scale along the axes; factors of shape (3,) or one for all."""
        factors = np.broadcast_to(np.asarray(scale, dtype=float), (3,))
        normals = self.normals / np.where(factors == 0.0, 1.0, factors)
        faces = self.faces if np.prod(factors) > 0 else self.faces[:, ::-1]
        vertices = self.vertices * factors
        return replace(self, vertices=vertices, normals=normalise_rows(normals), faces=faces)

    def paint(self, colour: Sequence[float]) -> Mesh:
        """Paint the whole mesh in one colour: red, green, blue and perhaps opacity."""
        colours = np.tile(np.asarray(colour[:3], dtype=float), (len(self.vertices), 1))
        opacity = float(colour[3]) if len(colour) > 3 else 1.0
        return Mesh(self.vertices, self.normals, self.faces, colours, opacity)


def normalise_rows(vectors: FloatArray) -> FloatArray:
    """Scale vectors, shape (n, 3), to length one; zero vectors stay zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.array(vectors), where=length > 0))


def box_corners(points: FloatArray) -> FloatArray:
    """Corners of the axis-aligned bounding box of points, shape (n, 3); shape (8, 3)."""
    bounds = zip(points.min(axis=0), points.max(axis=0), strict=True)
    return np.array(np.meshgrid(*bounds)).reshape(3, -1).T


def merge_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """Put meshes into one; it is as opaque as the first."""
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate(
            [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]
        ),
        np.concatenate([mesh.colours for mesh in meshes]),
        meshes[0].opacity,
    )


def drawable(part: MeshPart, colour: Sequence[float] = GREY) -> Mesh:
    """Give a part of a mesh file normals, and a colour if it has none."""
    return from_triangles(part.points[part.triangles], part.colour or colour)


def from_triangles(corners: FloatArray, colour: Sequence[float]) -> Mesh:
    """Make a mesh from separate triangles, smooth where faces meet at a small angle.

    Faces without area are left out.

    Args:
        corners: Corners [m], shape (m, 3, 3).
        colour: Red, green, blue and opacity.
    """
    from trimesh import Trimesh, graph, grouping

    corners = np.asarray(corners, dtype=float)
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    keep = np.linalg.norm(areas, axis=1) > 0
    areas, points = areas[keep], corners[keep].reshape(-1, 3).round(MERGED_DIGITS)
    unique_rows: Callable[..., tuple[IndexArray, IndexArray]] = grouping.unique_rows
    first, index = unique_rows(points, digits=MERGED_DIGITS)
    joined = Trimesh(points[first], index.reshape(-1, 3), process=False)
    smooth = joined.face_adjacency[joined.face_adjacency_angles < CREASE]
    surface = graph.connected_component_labels(smooth, len(areas))  # type: ignore[no-untyped-call]
    first, index = unique_rows(np.stack([index, np.repeat(surface, 3)], axis=1))
    normals = np.zeros((len(first), 3))
    np.add.at(normals, index, np.repeat(areas, 3, axis=0))
    unpainted = np.zeros((len(first), 3))
    mesh = Mesh(points[first], normalise_rows(normals), index.reshape(-1, 3), unpainted)
    return mesh.paint(colour)
