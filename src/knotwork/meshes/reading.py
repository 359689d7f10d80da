"""Reading mesh files: COLLADA with pycollada, all other formats with Coal or trimesh.

pycollada reads colours and images. Of other formats (STL, OBJ, PLY, glTF and more) only shapes are
read: by Coal, which comes with Pinocchio and is loaded already, or where a file has several
materials by trimesh, because Coal 3.0 mixes up their points. As in ROS, the unit of length of a
COLLADA file counts and its upward axis does not.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from knotwork.errors import InputError
from knotwork.waypoints import FloatArray

IndexArray = NDArray[np.int64]
Colour = tuple[float, float, float, float]

# What readers raise for files that are not as they must be.
_UNREADABLE = (
    *(OSError, ValueError, LookupError, AttributeError, TypeError, RuntimeError),
    *(ElementTree.ParseError, ImportError),  # trimesh needs other packages for some formats
)
# Elements of COLLADA that say what surfaces look like.
_LOOKS = ("library_images", "library_effects", "library_materials", "bind_material")


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles of one material.

    Attributes:
        points: [m], shape (n, 3).
        triangles: Indices of points, counter-clockwise seen from outside, shape (m, 3).
        normals: Directions, not always of length one, shape (k, 3); `None` if the file has none.
        corner_normals: Indices of normals, shape (m, 3), or `None`.
        uv: Place of each corner in the image, from the lower left, shape (m, 3, 2), or `None`.
        colour: Red, green, blue and opacity in 0 … 1; `None` if the file gives none.
        image: File of the image that colours it, or `None`.
    """

    points: FloatArray
    triangles: IndexArray
    normals: FloatArray | None = None
    corner_normals: IndexArray | None = None
    uv: FloatArray | None = None
    colour: Colour | None = None
    image: Path | None = None


def read_mesh(path: Path) -> tuple[MeshPart, ...]:
    """Read a mesh file; there is at least one part, and each has triangles.

    A COLLADA file whose materials have a fault is read without colours.

    >>> meshes = kw.load_robot("ur5").urdf.parents[1] / "meshes"
    >>> [(len(part.triangles), part.colour) for part in read_mesh(meshes / "ur5/visual/base.dae")]
    [(1795, (0.5248, 0.5248, 0.5248, 1.0)), (137, (0.064, 0.064, 0.064, 1.0))]

    Raises:
        InputError: The file can't be read, holds no triangles, or points that are not finite.
    """
    try:
        parts = _read_collada(path) if path.suffix.lower() == ".dae" else (_read_shape(path),)
        if not any(len(part.triangles) for part in parts):
            raise ValueError("it holds no triangles")
        if not all(np.isfinite(part.points).all() for part in parts):
            raise ValueError("it has points that are not finite")
    except _UNREADABLE as error:
        raise InputError(f"mesh {path} can't be read: {_reason(error)}") from error
    return parts


def _reason(error: Exception) -> str:
    """Why a file can't be read; Coal puts where its code stands around it."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if len(lines) > 1 and lines[-1].startswith("Hint:"):
        return lines[-2]
    return "; ".join(lines)


def _read_shape(path: Path) -> MeshPart:
    import coal

    mesh = coal.MeshLoader().load(str(path), np.ones(3))
    corners = (mesh.tri_indices(i) for i in range(mesh.num_tris))
    triangles = np.array([(one[0], one[1], one[2]) for one in corners], dtype=np.int64)
    points = np.array(mesh.vertices())
    if len(np.unique(triangles)) < len(points):  # those of the second material and on
        import trimesh

        whole = trimesh.load_scene(path, process=False).to_mesh()
        points, triangles = np.asarray(whole.vertices), np.asarray(whole.faces)
    return MeshPart(points, triangles)


def _read_collada(path: Path) -> tuple[MeshPart, ...]:
    import collada

    try:
        try:
            document = collada.Collada(str(path))
        except collada.common.DaeError:
            document = collada.Collada(_without_looks(path))
    except collada.common.DaeError as error:
        raise ValueError(str(error)) from error
    if document.scene is None:
        raise ValueError("it shows no scene")
    scale = document.assetInfo.unitmeter or 1.0
    unit = np.diag([scale, scale, scale, 1.0])
    return tuple(
        part
        for shape in document.scene.objects("geometry")
        for part in _shape_parts(shape, unit @ shape.matrix, path.parent)
    )


def _without_looks(path: Path) -> io.BytesIO:
    """Give a COLLADA document without its materials."""
    tree = ElementTree.parse(path)
    for element in list(tree.iter()):
        for child in list(element):
            if child.tag.rpartition("}")[2] in _LOOKS:
                element.remove(child)
    document = io.BytesIO()
    tree.write(document)
    document.seek(0)
    return document


def _shape_parts(shape: Any, placement: FloatArray, folder: Path) -> Iterator[MeshPart]:
    """Give the parts of a `collada.geometry.BoundGeometry` where its nodes place it."""
    import collada

    turn = placement[:3, :3]
    for primitive in shape.original.primitives:
        polygons = isinstance(primitive, collada.polylist.Polylist)
        faces = primitive.triangleset() if polygons else primitive
        if not isinstance(faces, collada.triangleset.TriangleSet) or not len(faces):
            continue
        # a placement that mirrors turns the triangles inside out
        order = slice(None, None, -1 if np.linalg.det(turn) < 0 else 1)
        normals = corner_normals = uv = None
        if faces.normal is not None:
            normals = faces.normal @ np.linalg.inv(turn)
            corner_normals = faces.normal_index[:, order].astype(np.int64)
        if faces.texcoordset:
            uv = faces.texcoordset[0][faces.texcoord_indexset[0]][:, order, :2]
        material = shape.materialnodebysymbol.get(primitive.material)
        colour, image = _look(material.target.effect.diffuse if material else None, folder)
        points = faces.vertex @ turn.T + placement[:3, 3]
        triangles = faces.vertex_index[:, order].astype(np.int64)
        yield MeshPart(points, triangles, normals, corner_normals, uv, colour, image)


def _look(diffuse: Any, folder: Path) -> tuple[Colour | None, Path | None]:
    """Colour, or file of the image, of a material's diffuse light."""
    if diffuse is None:
        return None, None
    if isinstance(diffuse, tuple):
        red, green, blue, opacity = (*diffuse, 1.0)[:4]
        return (red, green, blue, opacity), None
    address = diffuse.sampler.surface.image.path
    path = folder / unquote(address.strip().removeprefix("file://"))
    return None, path if path.is_file() else None
