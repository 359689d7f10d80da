"""Reading OBJ here, because trimesh ignores content that it does not understand."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from knotwork.errors import InputError, shown
from knotwork.scene.meshes.mesh_part import IndexArray
from knotwork.waypoints import FloatArray

# Keywords of OBJ that do not define surfaces; lines and points have none.
_OBJ_LOOKS = (
    "l", "p",
    "vt", "vn", "vp", "g", "o", "s", "mg", "usemtl", "mtllib", "usemap", "maplib", "bevel",
    "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj",
)  # fmt: skip


def _fans(polygons: Sequence[Sequence[int]]) -> IndexArray:
    """Split polygons into triangles at their first corners, shape (n, 3).

    Raises:
        InputError: A polygon has fewer than three corners.
    """
    for i, corners in enumerate(polygons, 1):
        if len(corners) < 3:
            has = f"face {i} of {len(polygons)} has {len(corners)} corners, fewer than 3"
            raise InputError(has)
    fans = [(polygon[0], *pair) for polygon in polygons for pair in pairwise(polygon[1:])]
    return np.array(fans, dtype=np.int64).reshape(-1, 3)


def read_obj(data: bytes) -> tuple[FloatArray, IndexArray]:
    """Read vertices and faces of an OBJ file, which does not state their number.

    Returns:
        Points, shape (n, 3), and triangles, shape (m, 3).

    Raises:
        InputError: The file has surfaces that are not polygons, or a line that can't be read.
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
                corners = [
                    number - 1 if number >= 0 else number + len(points) for number in corners
                ]
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
    return np.array(points, dtype=float).reshape(-1, 3), _fans(faces)
