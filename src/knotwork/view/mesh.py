"""Triangle meshes with normals, colours and images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from knotwork.meshes.part import Colour, IndexArray, MeshPart
from knotwork.waypoints import FloatArray

_Number = TypeVar("_Number", bound=np.generic)

GREY: Colour = (0.75, 0.75, 0.75, 1.0)
WHITE: Colour = (1.0, 1.0, 1.0, 1.0)
# A file whose corners have more normals of their own than this shades its faces flat, so that
# rounded parts look faceted: its normals are not used.
MOST_CORNERS = 0.6
# Faces that meet at less than this are shaded as one smooth surface.
CREASE = np.cos(np.radians(35.0))
MOST_AROUND = 64
"""Faces around a point of which a mean is made: a file may have all of its faces around one."""
MOST_PAIRS = 1_000_000
"""Of faces around a point that are looked at together."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a normal at each corner.

    Attributes:
        vertices: [m], shape (n, 3).
        normals: Unit vectors, shape (n, 3).
        faces: Indices of vertices, counter-clockwise from outside, shape (m, 3).
        colours: Red, green and blue of each vertex in 0 … 1, shape (n, 3).
        opacity: From 0, not seen, to 1, opaque.
        coloured: Whether its colours are given, or a warning names their fault; else it is grey.
        uv: Place in its image of each vertex, from the lower left corner, shape (n, 2), or `None`.
        image: File of the image that gives it its colours, or `None`.
    """

    vertices: FloatArray
    normals: FloatArray
    faces: IndexArray
    colours: FloatArray
    opacity: float = 1.0
    coloured: bool = True
    uv: FloatArray | None = None
    image: Path | None = None

    def moved(self, rotation: ArrayLike, translation: ArrayLike) -> Mesh:
        """Turn, then shift the mesh.

        Args:
            rotation: Matrix, shape (3, 3).
            translation: [m], shape (3,).
        """
        turn = np.asarray(rotation, dtype=float)
        vertices = self.vertices @ turn.T + np.asarray(translation, dtype=float)
        return replace(self, vertices=vertices, normals=self.normals @ turn.T)

    def placed(self, pose: pin.SE3) -> Mesh:
        """Move the mesh by a pose."""
        return self.moved(pose.rotation, pose.translation)

    def scaled(self, scale: ArrayLike) -> Mesh:
        """Scale along the axes; factors of shape (3,) or one for all."""
        factors = np.broadcast_to(np.asarray(scale, dtype=float), (3,))
        normals = self.normals / np.where(factors == 0.0, 1.0, factors)
        faces = self.faces if np.prod(factors) > 0 else self.faces[:, ::-1]
        vertices = self.vertices * factors
        return replace(self, vertices=vertices, normals=normalised(normals), faces=faces)

    def painted(self, colour: Sequence[float]) -> Mesh:
        """Give all of it one colour, red, green, blue and opacity."""
        colours = np.tile(np.asarray(colour[:3], dtype=float), (len(self.vertices), 1))
        opacity = float(colour[3]) if len(colour) > 3 else 1.0
        return Mesh(self.vertices, self.normals, self.faces, colours, opacity)


def normalised(vectors: FloatArray) -> FloatArray:
    """Scale vectors, shape (n, 3), to length one; those of no length stay as they are."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.array(vectors), where=length > 0))


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """Put meshes into one, without their images; it is as opaque as the first."""
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


def drawable(part: MeshPart) -> Mesh:
    """Give a part of a mesh file normals, and grey where it has no colour."""
    corners = part.points[part.triangles]
    if part.image is not None and part.uv is not None:
        return replace(from_triangles(corners, WHITE, part.uv), image=part.image)
    mesh = _with_own_normals(part) or from_triangles(corners, part.colour or GREY)
    return replace(mesh, coloured=part.colour is not None or bool(part.fault))


def _with_own_normals(part: MeshPart) -> Mesh | None:
    """Use a file's own normals, if there are some and they are not those of single faces."""
    if part.normals is None or part.corner_normals is None or len(part.normals) < 2:
        return None
    pairs = part.triangles * len(part.normals) + part.corner_normals
    vertices, faces = np.unique(pairs, return_inverse=True)
    if len(vertices) > MOST_CORNERS * pairs.size:
        return None
    point, normal = np.divmod(vertices, len(part.normals))
    mesh = Mesh(
        part.points[point],
        normalised(part.normals[normal]),
        faces.reshape(-1, 3),
        np.zeros((len(vertices), 3)),
    )
    return mesh.painted(part.colour or GREY)


def from_triangles(
    corners: FloatArray, colour: Sequence[float], uv: FloatArray | None = None
) -> Mesh:
    """Make a mesh from loose triangles, smooth where faces meet at a small angle.

    Faces without area are left out.

    Args:
        corners: [m], shape (m, 3, 3).
        colour: Red, green, blue and opacity.
        uv: Place in an image of each corner, shape (m, 3, 2).
    """
    corners = np.asarray(corners, dtype=float)
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    keep = np.linalg.norm(areas, axis=1) > 0
    corners, areas = corners[keep], areas[keep]
    points, index = unique_rows(corners.reshape(-1, 3).round(7))
    normals = np.round(127 * _creased(areas, index, len(points)))
    columns = [index[:, np.newaxis], normals]
    if uv is not None:
        columns.append(uv[keep].reshape(-1, 2))
    unique, inverse = unique_rows(np.hstack(columns))
    mesh = Mesh(
        points[unique[:, 0].astype(np.int64)],
        normalised(unique[:, 1:4]),
        inverse.reshape(-1, 3),
        np.zeros((len(unique), 3)),
    ).painted(colour)
    return mesh if uv is None else replace(mesh, uv=unique[:, 4:])


def _creased(areas: FloatArray, index: IndexArray, points: int) -> FloatArray:
    """Normal at each corner of each face: the mean of the faces around that are nearly level.

    Where very many faces share a point, each keeps its own.
    """
    faces = np.repeat(np.arange(len(areas)), 3)
    order = np.argsort(index, kind="stable")
    counts = np.bincount(index, minlength=points)
    starts = np.cumsum(counts) - counts
    unit = normalised(areas)
    normals = unit[faces]
    corners = np.flatnonzero(counts[index] <= MOST_AROUND)
    parts = -(-int(counts[index[corners]].sum()) // MOST_PAIRS)
    for some in np.array_split(corners, max(1, parts)):
        # Each corner with each face that shares its point.
        repeats = counts[index[some]]
        corner = np.repeat(some, repeats)
        first = np.cumsum(repeats) - repeats
        within = np.arange(len(corner)) - np.repeat(first, repeats)
        neighbour = faces[order[starts[index[corner]] + within]]
        level = np.einsum("ij,ij->i", unit[faces[corner]], unit[neighbour]) > CREASE
        near = np.where(level[:, np.newaxis], areas[neighbour], 0.0)
        if len(some):
            normals[some] = normalised(np.add.reduceat(near, first))
    return normals


def unique_rows(rows: NDArray[_Number]) -> tuple[NDArray[_Number], IndexArray]:
    """Find the distinct rows, sorted, and which of them each row is; faster than `np.unique`.

    >>> unique_rows(np.array([[2, 1], [0, 3], [2, 1]]))
    (array([[0, 3],
           [2, 1]]), array([1, 0, 1]))
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    inverse = np.empty(len(rows), dtype=np.int64)
    inverse[order] = np.cumsum(new) - 1
    return ordered[new], inverse


def coarse(mesh: Mesh, cell: float) -> Mesh:
    """Merge the vertices within each cell of a grid: fewer triangles for a faint copy.

    Args:
        mesh: What to make coarser.
        cell: Width of the cells [m].
    """
    keys = np.round(mesh.vertices / cell).astype(np.int64)
    _, inverse = unique_rows(keys)
    faces = inverse[mesh.faces]
    faces = faces[(faces != np.roll(faces, -1, axis=1)).all(axis=1)]
    # each face once, from its least vertex on; its other side is another face
    first = faces.argmin(axis=1)[:, np.newaxis]
    faces, _ = unique_rows(np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1))
    count = np.bincount(inverse)[:, np.newaxis]

    def mean(values: FloatArray) -> FloatArray:
        total = np.zeros((len(count), 3))
        np.add.at(total, inverse, values)
        return np.asarray(total / count)

    normals = normalised(mean(mesh.normals))
    return Mesh(mean(mesh.vertices), normals, faces, mean(mesh.colours), mesh.opacity)
