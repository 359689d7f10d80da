"""Readers of point clouds: CSV files with headings, and PLY."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.files.documents.csv_rows import read_rows
from knotwork.scene.meshes.mesh_part import FARTHEST_POINT, read_bounded
from knotwork.scene.meshes.plain_formats import read_ply

COORDINATES = ("x", "y", "z")


def read_cloud(path: Path) -> FloatArray:
    """Read the points of a CSV or PLY file in its own unit, shape (n, 3).

    The first line of a CSV file names its columns, among them x, y and z; others are not read.

    Raises:
        InputError: The file can't be read, has no points, one that is not finite, or triangles.
    """
    readers = {".csv": _read_csv, ".ply": _read_ply}
    try:
        read = readers.get(path.suffix.lower())
        if read is None:
            raise InputError(f"accepted are files {' and '.join(readers)}")
        points = read(path)
        if not len(points):
            raise InputError("it has no points")
        wrong = np.flatnonzero(~(np.abs(points) <= FARTHEST_POINT).all(axis=1))
        if wrong.size:
            raise InputError(
                f"point {wrong[0] + 1} of {len(points)} is {points[wrong[0]].tolist()}, not finite "
                f"or farther than {FARTHEST_POINT:g} from the origin"
            )
    except (InputError, OSError) as error:
        raise InputError(f"point cloud {path} can't be read: {error}") from error
    return points


def _read_csv(path: Path) -> FloatArray:
    rows = read_rows(path)
    names = [name.strip().lower() for name in rows.headings]
    missing = [name for name in COORDINATES if names.count(name) != 1]
    if missing:
        raise InputError(
            f"its first line names no column {', '.join(missing)}; expected are headings x,y,z "
            "above the numbers"
        )
    return np.column_stack([rows.numbers(names.index(name)) for name in COORDINATES])


def _read_ply(path: Path) -> FloatArray:
    try:
        part = read_ply(read_bounded(path))
    except InputError:
        raise
    except Exception as error:  # trimesh raises any exception on unexpected content
        raise InputError(f"it is not a PLY file, cut off or damaged ({error})") from error
    if len(part.triangles):
        raise InputError(
            "it holds triangles, and between their corners there would be gaps; give it as a mesh"
        )
    return part.points
