"""Reading PLY by trimesh, with a check against the counts in its header."""

from __future__ import annotations

import io
import re

import numpy as np

from knotwork.errors import InputError
from knotwork.scene.meshes.mesh_part import IndexArray
from knotwork.scene.meshes.size_limits import require_whole
from knotwork.waypoints import FloatArray

_ELEMENT = re.compile(rb"^element +(\S+) +(\d+)((?:\s+(?:property|comment) .*)*)", re.MULTILINE)


def read_ply(data: bytes) -> tuple[FloatArray, IndexArray]:
    """Read the vertices and faces of a PLY file; polygons become triangles.

    Returns:
        Points, shape (n, 3), and triangles, shape (m, 3).

    Raises:
        InputError: The number of rows differs from the header, other elements have surfaces, or the
            file is binary and its faces have different numbers of corners. trimesh raises other
            errors for other faults.
    """
    from trimesh.exchange.ply import load_ply

    head, separator, body = data.partition(b"end_header")
    require_whole(bool(separator), "its header has no line 'end_header'")
    counts = {}
    for name, count, properties in _ELEMENT.findall(head):
        counts[name.decode(errors="replace")] = int(count)
        require_whole(
            name == b"face" or b"property list" not in properties or count == b"0",
            f"it has {int(count)} of {name.decode(errors='replace')!r} with lists of vertices, and "
            "only those of 'face' are read",
        )
    listed = ", ".join(f"{count} of {name!r}" for name, count in counts.items())
    lines = sum(1 for line in body.splitlines() if line.strip())
    require_whole(
        b"ascii" not in head or lines == sum(counts.values()),
        f"its header counts {listed}, a line each, and it has {lines} lines",
    )
    try:
        read = load_ply(io.BytesIO(data), fix_texture=False, skip_materials=True)
    except ValueError as error:
        raise InputError(
            f"it is not read whole: its header counts {listed}, and it is cut off, damaged, or "
            f"binary with faces of different numbers of corners ({error})"
        ) from error
    return _check_counts(read, counts)


def _check_counts(
    read: dict[str, FloatArray], counts: dict[str, int]
) -> tuple[FloatArray, IndexArray]:
    from trimesh.geometry import triangulate_quads

    points = np.asarray(read.get("vertices", np.zeros((0, 3))), dtype=float)
    faces = read.get("faces")
    triangles = np.zeros((0, 3), dtype=np.int64)
    if faces is not None and len(faces):
        triangles = np.asarray(triangulate_quads(faces), dtype=np.int64)
    wanted = counts.get("vertex", 0), counts.get("face", 0)
    if len(points) != wanted[0] or len(triangles) < wanted[1]:
        raise InputError(
            f"it is not read whole: it counts {wanted[0]} vertices and {wanted[1]} faces, and some "
            "are cut off, damaged, or have fewer than 3 corners"
        )
    return points, triangles
