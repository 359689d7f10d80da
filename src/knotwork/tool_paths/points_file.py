"""Points of a curve from a CSV file, with the line and column of whatever is wrong."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from knotwork.documents import read_text
from knotwork.errors import DocumentError, Problem, did_you_mean
from knotwork.tool_paths.curve import REPEATED
from knotwork.waypoints import FloatArray

POSITION = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
NORMAL = ("nx", "ny", "nz")

NORM = 1e-3
"""How far lengths of quaternions and normals may be from 1: values in files are often rounded."""


class PathPoints(NamedTuple):
    """The points of a file.

    Attributes:
        points: [m], shape (n, 3).
        quaternions: Rotations of the tool there (x, y, z, w), shape (n, 4), or `None`.
        normals: Of the surface, of about length one, shape (n, 3), or `None`.
    """

    points: FloatArray
    quaternions: FloatArray | None
    normals: FloatArray | None


def read_points(path: Path, length_unit: float) -> PathPoints:
    """Read points, and quaternions or normals if there are any.

    Args:
        path: The file.
        length_unit: What a length of 1 in the file is in metres.

    Raises:
        DocumentError: The file can't be read, a heading or a value is wrong, there are fewer than
            two points, or two neighbours are the same.
    """
    rows = _rows(path)
    if not rows:
        raise DocumentError(path, [Problem(None, "", "holds no rows")])
    line, cells = rows[0]
    names = _columns(path, line, [cell.strip() for cell in cells])
    values = _numbers(path, rows[1:], names)
    lines = [number for number, _ in rows[1:]]
    if len(values) < 2:
        message = f"has {'one point' if len(values) else 'no points'}"
        raise DocumentError(path, [Problem(None, "", message, "two or more")])
    points = length_unit * values[:, [names.index(name) for name in POSITION]]
    repeated = np.flatnonzero(np.linalg.norm(np.diff(points, axis=0), axis=1) <= REPEATED)
    if repeated.size:
        message = "is the same point as line"
        raise DocumentError(
            path,
            [Problem(lines[i + 1], "", f"{message} {lines[i]}", "leave one out") for i in repeated],
        )
    units: list[FloatArray | None] = []
    for what, columns in (("quaternion", QUATERNION), ("normal", NORMAL)):
        if columns[0] not in names:
            units.append(None)
            continue
        units.append(own := values[:, [names.index(name) for name in columns]])
        size = np.linalg.norm(own, axis=1)
        problems = [
            Problem(lines[i], ", ".join(columns), f"the {what} has length {size[i]:.6g}", "1")
            for i in np.flatnonzero(np.abs(size - 1.0) > NORM)
        ]
        if problems:
            raise DocumentError(path, problems)
    return PathPoints(points, *units)


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Rows that hold something, each with its line."""
    lines = io.StringIO(read_text(path))
    reader = csv.reader(lines)
    try:
        return [
            (reader.line_num, cells)
            for cells in reader
            if any(cell.strip() for cell in cells) and not cells[0].lstrip().startswith("#")
        ]
    except csv.Error as error:
        raise DocumentError(path, [Problem(None, "", f"can't be read: {error}")]) from error


def _columns(path: Path, line: int, names: list[str]) -> list[str]:
    """Check the headings.

    Raises:
        DocumentError: One is unknown, missing or there twice, or there are none.
    """
    accepted = "x, y, z and, for the rotation, qx, qy, qz, qw or the surface's normal nx, ny, nz"
    if all(_number(name) is not None for name in names):
        message = "has no headings above the numbers"
        raise DocumentError(path, [Problem(line, "", message, accepted)])
    for mark in (";", "\t"):
        if len(names) == 1 and mark in names[0]:
            message = f"columns are separated by {mark!r}"
            raise DocumentError(path, [Problem(line, "", message, "a comma")])
    known = (*POSITION, *QUATERNION, *NORMAL)
    problems = []
    for i, name in enumerate(names):
        where = f"column {i + 1}"
        if name not in known:
            hint = did_you_mean(name.lower(), known)
            problems.append(Problem(line, where, f"unknown heading {name!r}", hint))
        elif name in names[:i]:
            problems.append(
                Problem(line, where, f"{name!r} is already column {names.index(name) + 1}")
            )
    given = [columns for columns in (QUATERNION, NORMAL) if set(names) & set(columns)]
    if len(given) > 1:
        problems.append(Problem(line, "", "gives rotations and normals", "one of them"))
    needed = (*POSITION, *(name for columns in given[:1] for name in columns))
    missing = [name for name in needed if name not in names]
    if missing:
        problems.append(Problem(line, "", f"no column is named {', '.join(missing)}", accepted))
    if problems:
        raise DocumentError(path, problems)
    return names


def _numbers(path: Path, rows: list[tuple[int, list[str]]], names: list[str]) -> FloatArray:
    """Values of the rows, shape (n, columns).

    Raises:
        DocumentError: A row has another number of values, or one is no finite number.
    """
    problems = []
    values = np.zeros((len(rows), len(names)))
    for row, (line, cells) in enumerate(rows):
        if len(cells) != len(names):
            message = f"has {len(cells)} values"
            problems.append(Problem(line, "", message, f"{len(names)}, one a column"))
            continue
        for column, cell in enumerate(cells):
            value = _number(cell)
            if value is None or not math.isfinite(value):
                where = f"column {column + 1} ({names[column]})"
                problems.append(Problem(line, where, f"{cell.strip()!r}", "a finite number"))
            else:
                values[row, column] = value
    if problems:
        raise DocumentError(path, problems)
    return values


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None
