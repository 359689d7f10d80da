"""Reading text of polygons, OBJ and OFF: trimesh leaves out what it does not understand of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.errors import InputError, shown
from knotwork.scene.meshes.part import IndexArray
from knotwork.scene.meshes.size_limits import require_whole
from knotwork.waypoints import FloatArray

# Keywords of OBJ that say nothing of where surfaces are; lines and points have none.
_OBJ_LOOKS = (
    "l", "p",
    "vt", "vn", "vp", "g", "o", "s", "mg", "usemtl", "mtllib", "usemap", "maplib", "bevel",
    "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj",
)  # fmt: skip
_OFF_HEADS = ("OFF", "COFF", "NOFF", "CNOFF")


def fans(polygons: FloatArray | Sequence[Sequence[float] | FloatArray]) -> IndexArray:
    """Divide polygons into triangles at their first corners, and refuse those of fewer than three.

    Args:
        polygons: Indices of their corners; an array has a polygon in each row.

    Returns:
        Shape (n, 3).

    Raises:
        InputError: A polygon has fewer than three corners, or one is no integer.
    """
    lengths = np.array([len(one) for one in polygons], dtype=np.int64)
    if (lengths < 3).any():
        at = int(np.argmax(lengths < 3))
        raise InputError(f"face {at + 1} of {len(lengths)} has {lengths[at]} corners, fewer than 3")
    if isinstance(polygons, np.ndarray):
        flat = polygons.ravel()
    else:
        flat = np.concatenate([np.zeros(0), *map(np.asarray, polygons)])
    corners = flat.astype(np.int64)
    if (corners != flat).any():
        raise InputError("its faces have corners that are no integers")
    each = lengths - 2
    first = np.repeat(np.cumsum(lengths) - lengths, each)
    step = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each) + 1
    triangles: IndexArray = corners[np.stack([first, first + step, first + step + 1], axis=1)]
    return triangles


def read_obj(data: bytes) -> tuple[FloatArray, IndexArray]:
    """Read vertices and faces of an OBJ file, which says nowhere how many there are.

    Returns:
        Points, shape (n, 3), and triangles, shape (m, 3).

    Raises:
        InputError: It has surfaces that are no polygons, or a line that can't be read.
    """
    points: list[list[float]] = []
    faces: list[list[int]] = []
    text = data.replace(b"\\\r\n", b"  \n").replace(b"\\\n", b" ").decode("latin-1")
    for number, line in enumerate(text.split("\n"), 1):
        kind, *words = line.partition("#")[0].split() or ["g"]
        try:
            if kind == "v" and len(words) in (3, 4, 6, 7):
                points.append([float(word) for word in words[:3]])
            elif kind in ("f", "fo"):
                corners = [int(word.partition("/")[0]) for word in words]
                corners = [one - 1 if one >= 0 else one + len(points) for one in corners]
                if min(corners, default=0) < 0:
                    raise ValueError
                faces.append(corners)
            elif kind not in _OBJ_LOOKS:
                raise ValueError
        except ValueError as error:
            raise InputError(
                f"it is not read whole: line {number} is {shown(line.strip())}; read are v with 3, "
                "4, 6 or 7 numbers, and f with the numbers of vertices"
            ) from error
    return np.array(points, dtype=float).reshape(-1, 3), fans(faces)


def read_off(data: bytes) -> tuple[FloatArray, IndexArray]:
    """Read an OFF file.

    Returns:
        Points, shape (n, 3), and triangles, shape (m, 3).

    Raises:
        InputError: It has fewer or more vertices or faces than it counts, or none of its heads.
    """
    lines = [line.partition("#")[0].split() for line in data.decode("latin-1").splitlines()]
    lines = [words for words in lines if words]
    if not lines or lines[0][0] not in _OFF_HEADS:
        raise InputError(f"it begins with none of {', '.join(_OFF_HEADS)}")
    del lines[0][0]
    lines = lines if lines[0] else lines[1:]
    vertices, faces = (int(word) for word in lines[0][:2])
    rows = lines[1:]
    require_whole(
        min(vertices, faces) >= 0 and len(rows) == vertices + faces,
        f"it counts {vertices} vertices and {faces} faces, a line each, and has {len(rows)} lines",
    )
    points = np.array([[float(word) for word in row[:3]] for row in rows[:vertices]], dtype=float)
    corners = [[int(word) for word in row[: 1 + int(row[0])]] for row in rows[vertices:]]
    for i, row in enumerate(corners):
        has = f"face {i + 1} of {faces} is to have {row[0]} corners and has {len(row) - 1}"
        require_whole(len(row) == 1 + row[0], has)
    return points.reshape(-1, 3), fans([row[1:] for row in corners])
