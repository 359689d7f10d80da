"""Mesh files read whole: COLLADA with pycollada, PLY with trimesh, STL and OBJ here.

A partly read file is an error, because the arm could hit a missing part. Only COLLADA files
are read with materials. Files are untrusted, so all readers are written in Python: Coal's reader,
in C++, crashes the process on broken files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.errors import InputError
from knotwork.scene.meshes.mesh_part import FARTHEST_POINT, MeshPart, check_triangles, read_bounded
from knotwork.scene.meshes.plain_formats import read_obj, read_ply, read_stl

MESH_SUFFIXES = (".dae", ".stl", ".obj", ".ply")


def read_mesh(path: Path) -> tuple[MeshPart, ...]:
    """Read a mesh file, in which at least one triangle must have an area.

    A COLLADA file with faulty materials is read without colours.

    >>> meshes = kw.load_robot("ur5").urdf.parents[1] / "meshes"
    >>> [(len(part.triangles), part.colour) for part in read_mesh(meshes / "ur5/visual/base.dae")]
    [(1795, (0.5248, 0.5248, 0.5248, 1.0)), (137, (0.064, 0.064, 0.064, 1.0))]

    Args:
        path: The file.

    Raises:
        InputError: The file can't be read whole, is too large, has no triangles
            with an area, or points that are not finite.
    """
    try:
        if path.suffix.lower() not in MESH_SUFFIXES:
            raise InputError(f"accepted are files {', '.join(MESH_SUFFIXES)}")
        data = read_bounded(path)
        parts = _read_parts(data, path)
        _check_parts(parts)
    except Exception as error:  # readers raise any error on unexpected content
        raise InputError(f"mesh {path} can't be read: {_explain(error)}") from error
    return parts


def read_corners(path: Path) -> FloatArray:
    """Read the corners of a mesh file's triangles [m], shape (n, 3), including repeated ones.

    >>> meshes = kw.load_robot("ur5").urdf.parents[1] / "meshes"
    >>> len(np.unique(read_corners(meshes / "ur5/collision/base.stl"), axis=0))
    283

    Raises:
        InputError: As for `read_mesh`.
    """
    parts = read_mesh(path)
    return np.concatenate([part.points[sort_distinct(part.triangles)] for part in parts])


def _explain(error: Exception) -> str:
    """Explain in one line, without content of the file, why it can't be read."""
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


def _check_parts(parts: tuple[MeshPart, ...]) -> None:
    """Check the requirements of all formats.

    Raises:
        InputError: The parts have no triangles, or a value is out of range.
    """
    if not any(len(part.triangles) for part in parts):
        raise InputError("it has no triangles")
    for part in parts:
        if any(a.ndim != 2 or a.shape[1] != 3 for a in (part.points, part.triangles)):
            raise InputError("it has points or triangles that are not three numbers each")
        if not (np.abs(part.points) <= FARTHEST_POINT).all():
            raise InputError(
                "it has points that are not finite or farther than "
                f"{FARTHEST_POINT:g} from the origin"
            )
        indices, n = part.triangles, len(part.points)
        if indices.size and (indices.min() < 0 or indices.max() >= n):
            raise InputError(f"it has an index that is not in 0 to {n - 1}")
    if not any(_has_area(part) for part in parts):
        raise InputError("none of its triangles has an area")


def _has_area(part: MeshPart) -> bool:
    a, b, c = np.moveaxis(part.points[part.triangles], 1, 0)
    return bool(np.cross(b - a, c - a).any())


def _read_parts(data: bytes, path: Path) -> tuple[MeshPart, ...]:
    kind = path.suffix.lower()[1:]
    if kind == "dae":
        from knotwork.scene.meshes.collada_file import read_collada

        return read_collada(data)
    read = {"stl": read_stl, "obj": read_obj, "ply": read_ply}[kind]
    part = read(data)
    check_triangles(len(part.triangles))
    return (part,)
