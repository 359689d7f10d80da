"""A part of a mesh, and size limits of files, which bound time and memory."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from knotwork.arrays import FloatArray, IndexArray
from knotwork.errors import InputError

MAX_MESH_BYTES = 64_000_000
MAX_MESH_TRIANGLES = 1_000_000
"""Maximum number of triangles of a file, counted each time the file shows them."""
MAX_SHOWN_SHAPES = 5_000
"""Maximum number of shapes that a file shows, counted each time."""
FARTHEST_POINT = 1e9
"""Maximum distance of a point from the origin along each axis, in the file's unit."""

Colour = tuple[float, float, float, float]


class MeshPart(NamedTuple):
    """Triangles of one material.

    Attributes:
        points: Points [m], shape (n, 3).
        triangles: Indices of points, counter-clockwise seen from outside, shape (m, 3).
        colour: Red, green, blue and opacity in 0 … 1, or `None`.
    """

    points: FloatArray
    triangles: IndexArray
    colour: Colour | None = None


def read_bounded(path: Path) -> bytes:
    """Read a file of limited size.

    Raises:
        InputError: The file is too large, or not a regular file.
        OSError: The file can't be read.
    """
    if not path.is_file():
        raise InputError("it is not a regular file")
    if (size := path.stat().st_size) > MAX_MESH_BYTES:
        raise InputError(f"it has {size} bytes; at most {MAX_MESH_BYTES} are read")
    return path.read_bytes()


def check_triangles(count: int) -> None:
    """Refuse too many triangles.

    Raises:
        InputError: There are more than `MAX_MESH_TRIANGLES`.
    """
    if count > MAX_MESH_TRIANGLES:
        raise InputError(f"it has {count} triangles; at most {MAX_MESH_TRIANGLES} are read")


def require_whole(is_whole: bool, fault: str) -> None:
    """Refuse a file of which a part would not be read.

    Raises:
        InputError: `is_whole` is false.
    """
    if not is_whole:
        raise InputError(f"it is not read whole: {fault}")
