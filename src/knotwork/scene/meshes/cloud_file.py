"""Reading the points of a cloud: CSV with headings, and PLY."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from knotwork.errors import InputError
from knotwork.scene.meshes.ply_file import read_ply
from knotwork.scene.meshes.size_limits import FARTHEST, read_bounded
from knotwork.waypoints import FloatArray

AXES = ("x", "y", "z")


def read_cloud(path: Path) -> FloatArray:
    """Read the points of a CSV or PLY file as it has them, shape (n, 3).

    The first line of a CSV file names its columns, among them x, y and z; others are not read.

    Raises:
        InputError: The file can't be read, holds no points, one that is not finite, or triangles.
    """
    readers = {".csv": _read_csv, ".ply": _read_ply}
    try:
        read = readers.get(path.suffix.lower())
        if read is None:
            raise InputError(f"read are {' and '.join(readers)}")
        points = read(read_bounded(path))
        if not len(points):
            raise InputError("it holds no points")
        wrong = np.flatnonzero(~(np.abs(points) <= FARTHEST).all(axis=1))
        if wrong.size:
            raise InputError(
                f"point {wrong[0] + 1} of {len(points)} is {points[wrong[0]].tolist()}, not finite "
                f"or farther than {FARTHEST:g} from the origin"
            )
    except (InputError, OSError) as error:
        raise InputError(f"point cloud {path} can't be read: {error}") from error
    return points


def _read_csv(data: bytes) -> FloatArray:
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"it is not UTF-8 text (byte {error.start})") from error
    rows = [(i, line) for i, line in enumerate(lines, 1) if line.strip()]
    names = [name.strip().lower() for name in rows.pop(0)[1].split(",")] if rows else []
    missing = [name for name in AXES if names.count(name) != 1]
    if missing and names:
        raise InputError(
            f"its first line names no column {', '.join(missing)}; expected are headings x,y,z "
            "above the numbers, separated by commas"
        )
    if not rows:
        return np.zeros((0, 3))
    columns = [names.index(name) for name in AXES]
    text = "\n".join(line for _, line in rows)
    try:
        return np.loadtxt(io.StringIO(text), delimiter=",", usecols=columns, ndmin=2, comments=None)
    except ValueError as error:
        wrong = next((line for line in rows if not _is_row(line[1], columns)), rows[0])
        raise InputError(
            f"line {wrong[0]}: {wrong[1][:80]!r} has no numbers for x, y and z"
        ) from error


def _is_row(line: str, columns: list[int]) -> bool:
    cells = line.split(",")
    try:
        return bool([float(cells[column]) for column in columns])
    except (IndexError, ValueError):
        return False


def _read_ply(data: bytes) -> FloatArray:
    try:
        points, triangles = read_ply(data)
    except InputError:
        raise
    except Exception as error:  # trimesh raises whatever comes of what it does not expect
        raise InputError(f"it is no PLY, cut off or damaged ({error})") from error
    if len(triangles):
        raise InputError(
            "it holds triangles, and between their corners there would be gaps; give it as a mesh"
        )
    return points
