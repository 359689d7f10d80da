"""Reading mesh files: STL here, COLLADA with pycollada, OBJ, PLY, OFF and glTF with trimesh.

Of all formats but COLLADA only shapes are read. Files come from strangers, so both readers are
written in Python: Coal's reader, which is in C++, ends the process on broken files. STL, which most
collision shapes are, is read here because importing trimesh alone takes 0.4 s of processor time.
"""

from __future__ import annotations

import io
import json
import re
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.distinct import distinct
from knotwork.errors import InputError
from knotwork.meshes.bounds import (
    FARTHEST,
    MOST_NESTED,
    MOST_SHAPES,
    MOST_TRIANGLES,
    check_triangles,
    read_bounded,
)
from knotwork.meshes.part import MeshPart
from knotwork.waypoints import FloatArray

_VERTEX = rb"\s+vertex\s+([^\s]{1,32})\s+([^\s]{1,32})\s+([^\s]{1,32})"
_FACET = re.compile(rb"outer\s+loop" + 3 * _VERTEX + rb"\s+endloop", re.IGNORECASE)
# What else lines of OBJ say may divide them into many thousand shapes.
_OBJ_SHAPE = re.compile(rb"^[ \t]*(?:v|vn|vt|f)[ \t].*$", re.MULTILINE)

SUFFIXES = (".dae", ".stl", ".obj", ".ply", ".off", ".glb", ".gltf")


def read_mesh(path: Path, inside: Path | None = None) -> tuple[MeshPart, ...]:
    """Read a mesh file; there is at least one part with triangles, and not all are without area.

    A COLLADA file whose materials have a fault is read without colours.

    >>> meshes = kw.load_robot("ur5").urdf.parents[1] / "meshes"
    >>> [(len(part.triangles), part.colour) for part in read_mesh(meshes / "ur5/visual/base.dae")]
    [(1795, (0.5248, 0.5248, 0.5248, 1.0)), (137, (0.064, 0.064, 0.064, 1.0))]

    Args:
        path: The file.
        inside: Folder that the images of its materials must be in; by default that of the file.

    Raises:
        InputError: The file can't be read, is larger than what is read, holds no triangles with an
            area, or points that are not finite.
    """
    try:
        if path.suffix.lower() not in SUFFIXES:
            raise InputError(f"read are {', '.join(SUFFIXES)}")
        data = read_bounded(path)
        if path.suffix.lower() == ".dae":
            from knotwork.meshes.collada_file import read_collada

            parts = read_collada(data, path.parent, inside or path.parent)
        elif path.suffix.lower() == ".stl":
            parts = (_read_stl(data),)
        else:
            parts = (_read_shape(data, path.suffix.lower()[1:]),)
        _check(parts)
    except Exception as error:  # readers raise whatever comes of what they do not expect
        raise InputError(f"mesh {path} can't be read: {_reason(error)}") from error
    return parts


def read_points(path: Path) -> FloatArray:
    """Read the corners of a mesh file's triangles alone [m], shape (n, 3), as often as it has them.

    >>> meshes = kw.load_robot("ur5").urdf.parents[1] / "meshes"
    >>> len(np.unique(read_points(meshes / "ur5/collision/base.stl"), axis=0))
    283

    Raises:
        InputError: As for `read_mesh`.
    """
    parts = read_mesh(path)
    return np.concatenate([part.points[distinct(part.triangles)] for part in parts])


def _read_stl(data: bytes) -> MeshPart:
    """Read an STL file; one of another length than a binary file of its facets is text."""
    facets = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * facets:
        check_triangles(facets)
        rows = np.frombuffer(data[84:], [("v", "<f4", (4, 3)), ("attribute", "<u2")])
        with np.errstate(invalid="ignore"):
            points = rows["v"][:, 1:].reshape(-1, 3).astype(float)
    else:
        found = _FACET.findall(data)
        check_triangles(len(found))
        points = np.array(found, dtype="S32").astype(float).reshape(-1, 3)
    return MeshPart(points, np.arange(len(points)).reshape(-1, 3))


def _reason(error: Exception) -> str:
    """Why a file can't be read, in a line that is no part of the file's content."""
    if isinstance(error, RecursionError):
        return "it is nested too deep"
    if isinstance(error, MemoryError):
        return "it needs too much memory"
    text = "; ".join(line.strip() for line in str(error).splitlines() if line.strip())
    if len(text) > 200:
        text = f"{text[:197]}..."
    if isinstance(error, ValueError | OSError):
        return text
    return f"it is cut off or damaged ({type(error).__name__}: {text})"


def _check(parts: tuple[MeshPart, ...]) -> None:
    """Check what all formats must have.

    Raises:
        InputError: They hold no triangles, or something is out of range.
    """
    if not any(len(part.triangles) for part in parts):
        raise InputError("it holds no triangles")
    for part in parts:
        if not all(array.ndim == 2 and array.shape[1] == 3 for array in _rows(part)):
            raise InputError("it has points, normals or triangles that are not three numbers each")
        if not (np.abs(part.points) <= FARTHEST).all():
            raise InputError(
                f"it has points that are not finite or farther than {FARTHEST:g} from the origin"
            )
        pairs = ((part.triangles, part.points), (part.corner_normals, part.normals))
        for indices, values in pairs:
            if indices is None or values is None or not indices.size:
                continue
            if indices.min() < 0 or indices.max() >= len(values):
                raise InputError(f"it has an index that is not in 0 to {len(values) - 1}")
        for extra in (part.normals, part.uv):
            if extra is not None and not np.isfinite(extra).all():
                raise InputError("it has normals or places in images that are not finite")
    if not any(_has_area(part) for part in parts):
        raise InputError("none of its triangles has an area")


def _rows(part: MeshPart) -> list[np.ndarray[Any, Any]]:
    arrays = (part.points, part.triangles, part.normals, part.corner_normals)
    return [array for array in arrays if array is not None]


def _has_area(part: MeshPart) -> bool:
    a, b, c = np.moveaxis(part.points[part.triangles], 1, 0)
    return bool(np.cross(b - a, c - a).any())


def _read_shape(data: bytes, kind: str) -> MeshPart:
    """Read the shape of a file of any other format; no other file is opened for it."""
    import trimesh

    if kind in ("glb", "gltf"):
        _check_gltf(data, kind)
    options: dict[str, Any] = {}
    if kind == "obj":
        data = b"\n".join(_OBJ_SHAPE.findall(data.replace(b"\\\n", b" ")))
        data = data.decode("ascii", errors="backslashreplace").encode()  # numbers are ASCII
        options = {"skip_materials": True}
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **options)
    shown = [scene.geometry[name] for _, name in map(scene.graph.get, scene.graph.nodes_geometry)]
    shapes = [shape for shape in shown if isinstance(shape, trimesh.Trimesh)]
    check_triangles(sum(len(shape.faces) for shape in shapes))
    if not shapes:
        raise InputError("it holds no triangles")
    whole = scene.to_mesh()
    return MeshPart(
        np.asarray(whole.vertices, dtype=float), np.asarray(whole.faces, dtype=np.int64)
    )


def _check_gltf(data: bytes, kind: str) -> None:
    """Refuse glTF of few bytes that asks for much memory.

    Raises:
        InputError: It names more values than it holds, or its nodes form no tree.
        ValueError: It is no glTF.
    """
    text = data
    if kind == "glb":  # a header of 12 bytes, then the length and kind of the first chunk
        text = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    content: Any = json.loads(text)
    counts = [accessor.get("count", 0) for accessor in content.get("accessors", ())]
    if any(not isinstance(count, int) or count > 3 * MOST_TRIANGLES for count in counts):
        raise InputError(f"an accessor has more than {3 * MOST_TRIANGLES} values")
    nodes = content.get("nodes", [])
    carried = list(chain.from_iterable(node.get("children", ()) for node in nodes))
    if len(nodes) > MOST_SHAPES or len(set(carried)) < len(carried):
        raise InputError(f"it has more than {MOST_SHAPES} nodes, or one that is in two others")
    below = {i: node.get("children", ()) for i, node in enumerate(nodes)}
    level, depth = [i for i in below if i not in set(carried)], 0
    while level:
        level, depth = [one for i in level for one in below[i]], depth + 1
        if depth > MOST_NESTED:
            raise InputError(f"its nodes are in one another more than {MOST_NESTED} deep")
