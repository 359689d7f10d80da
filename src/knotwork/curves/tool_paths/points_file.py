"""Points of a curve from a CSV file; errors have line and column."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths.curve import SAME_POINT
from knotwork.errors import DocumentError, Problem, suggest_name
from knotwork.files.documents.csv_rows import Rows, is_number, read_rows

POSITION_COLUMNS = ("x", "y", "z")
QUATERNION_COLUMNS = ("qx", "qy", "qz", "qw")
NORMAL_COLUMNS = ("nx", "ny", "nz")

UNIT_TOLERANCE = 1e-3
"""Tolerance of the lengths of quaternions and normals, because values in files are often
rounded.
"""


class PathPoints(NamedTuple):
    """The points of a file.

    Attributes:
        points: Points [m], shape (n, 3).
        rotations: Rotations of the tool, shape (n, 3, 3), or `None`.
        normals: Surface normals of unit length, shape (n, 3), or `None`.
    """

    points: FloatArray
    rotations: FloatArray | None
    normals: FloatArray | None


def read_points(path: Path | str, length_unit: float = 1.0) -> PathPoints:
    r"""Read points, and quaternions or normals if there are any.

    >>> characters = Path("seam.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n50,0,0,0,0,1\n")
    >>> kw.tool_paths.read_points("seam.csv", length_unit=0.001).points
    array([[0.  , 0.  , 0.  ],
           [0.05, 0.  , 0.  ]])

    Args:
        path: The file.
        length_unit: Unit of length in the file [m].

    Raises:
        DocumentError: The file can't be read, a heading or a value is wrong, there are fewer than
            two points, or two neighbours are the same.
    """
    path = Path(path)
    rows = read_rows(path)
    names, lines = _names(rows), rows.lines
    values = np.column_stack([rows.numbers(i, finite=True) for i in range(len(names))])
    if len(values) < 2:
        message = f"has {'one point' if len(values) else 'no points'}"
        raise DocumentError(path, [Problem(None, "", message, "two or more")])
    points = length_unit * values[:, [names.index(name) for name in POSITION_COLUMNS]]
    repeated = np.flatnonzero(np.linalg.norm(np.diff(points, axis=0), axis=1) <= SAME_POINT)
    if repeated.size:
        message = "is the same point as line"
        raise DocumentError(
            path,
            [Problem(lines[i + 1], "", f"{message} {lines[i]}", "another point") for i in repeated],
        )
    rotations = normals = None
    if QUATERNION_COLUMNS[0] in names:
        from scipy.spatial.transform import Rotation

        quaternions = _unit_vectors(rows, names, values, QUATERNION_COLUMNS, "quaternion")
        rotations = Rotation.from_quat(quaternions).as_matrix()
    if NORMAL_COLUMNS[0] in names:
        normals = _unit_vectors(rows, names, values, NORMAL_COLUMNS, "normal")
    return PathPoints(points, rotations, normals)


def _unit_vectors(
    rows: Rows, names: list[str], values: FloatArray, columns: tuple[str, ...], quantity: str
) -> FloatArray:
    """Vectors of some columns, of unit length.

    Raises:
        DocumentError: The length of a vector is not 1 within `UNIT_TOLERANCE`.
    """
    vectors = values[:, [names.index(name) for name in columns]]
    size = np.linalg.norm(vectors, axis=1)
    problems = [
        Problem(rows.lines[i], ", ".join(columns), f"the {quantity} has length {size[i]:.6g}", "1")
        for i in np.flatnonzero(np.abs(size - 1.0) > UNIT_TOLERANCE)
    ]
    if problems:
        raise DocumentError(rows.path, problems)
    return np.asarray(vectors / size[:, None])


def _names(rows: Rows) -> list[str]:
    """Check the headings.

    Raises:
        DocumentError: A heading is unknown, missing or repeated, or there are none.
    """
    names = [cell.strip() for cell in rows.headings]
    accepted = "x, y, z and, for the rotation, qx, qy, qz, qw or the surface's normal nx, ny, nz"
    if all(map(is_number, names)):
        raise rows.heading_error(None, "has no headings above the numbers", accepted)
    allowed = (*POSITION_COLUMNS, *QUATERNION_COLUMNS, *NORMAL_COLUMNS)
    for i, name in enumerate(names):
        if name not in allowed:
            hint = suggest_name(name.lower(), allowed)
            raise rows.heading_error(i, f"unknown heading {name!r}; {hint}")
        if name in names[:i]:
            raise rows.heading_error(i, f"is column {names.index(name) + 1}, too")
    groups = [
        columns for columns in (QUATERNION_COLUMNS, NORMAL_COLUMNS) if set(names) & set(columns)
    ]
    if len(groups) > 1:
        raise rows.heading_error(None, "gives rotations and normals", "one of them")
    needed = (*POSITION_COLUMNS, *(name for columns in groups for name in columns))
    missing = [name for name in needed if name not in names]
    if missing:
        raise rows.heading_error(None, f"no column is named {', '.join(missing)}", accepted)
    return names
