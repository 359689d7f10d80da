"""Bounds on the size of a mesh file, so that no file takes minutes or gigabytes."""

from __future__ import annotations

from pathlib import Path

from knotwork.errors import InputError

MOST_BYTES = 64_000_000
MOST_TRIANGLES = 1_000_000
"""Of one file, each as often as the file shows it."""
MOST_ELEMENTS = 100_000
"""XML elements of a COLLADA file; its numbers stand in few of them."""
MOST_SHAPES = 5_000
"""Shapes that a file shows, each as often as it does."""
MOST_NESTED = 100
"""Nodes in one another."""
FARTHEST = 1e9
"""Of a point from the origin, along each axis, in the file's unit."""


def read_bounded(path: Path) -> bytes:
    """Read a file that is not too large.

    Raises:
        InputError: It is larger, or no regular file.
        OSError: It can't be read.
    """
    if not path.is_file():
        raise InputError("it is not a regular file")
    if (size := path.stat().st_size) > MOST_BYTES:
        raise InputError(f"it has {size} bytes; at most {MOST_BYTES} are read")
    return path.read_bytes()


def check_triangles(count: int) -> None:
    """Refuse more triangles than are read.

    Raises:
        InputError: There are more.
    """
    if count > MOST_TRIANGLES:
        raise InputError(f"it has {count} triangles; at most {MOST_TRIANGLES} are read")


def require_whole(whole: bool, fault: str) -> None:
    """Refuse a file that would be read in part.

    Raises:
        InputError: It would be.
    """
    if not whole:
        raise InputError(f"it is not read whole: {fault}")
