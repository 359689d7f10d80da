"""Trajectories of other tools as CSV: a heading for each column, a row for each time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import DocumentError, Problem
from knotwork.files.documents.csv_rows import Rows, is_number, read_rows
from knotwork.files.foreign.header import Column, HeadingError, column
from knotwork.files.foreign.point_table import QUANTITIES, Joints, PointTable


def read_csv(path: Path, joints: Joints, start_time: float) -> PointTable:
    """Read a CSV file.

    Args:
        path: The file.
        joints: The known joints; the columns may have any order.
        start_time: Added to times named `time_from_start`, and to the sums of those named
            `time_step` [s].

    Raises:
        DocumentError: The file can't be read, has no headings, an unknown column, a
            joint missing or twice, a row of another length, or an invalid number.
    """
    rows = read_rows(path)
    if all(map(is_number, rows.headings)):
        accepted = f"a line above the numbers, with time and {', '.join(joints.names)}"
        raise rows.error(rows.head, None, "has no headings", accepted)
    columns = _columns(rows, joints)
    count = len(rows.lines)
    time = np.empty(count)
    values = {quantity: np.full((count, len(joints.names)), np.nan) for quantity in QUANTITIES}
    first_column: dict[str, int] = {}
    for i, content in enumerate(columns):
        if not content.quantity:
            continue
        numbers = rows.numbers(i, finite=True) * content.factor
        first_column.setdefault(content.quantity, i)
        if content.quantity == "time":
            time = _absolute(numbers, content.clock, start_time)
        else:
            values[content.quantity][:, content.joint] = numbers
    has = {quantity: np.full(count, quantity in first_column) for quantity in QUANTITIES}

    def error(row: int, quantity: str, message: str, accepted: str) -> DocumentError:
        line = rows.lines[row] if row < count else None
        return rows.error(line, first_column.get(quantity), message, accepted)

    return PointTable(joints, time, values, has, error)


def _absolute(time: FloatArray, clock: str, start_time: float) -> FloatArray:
    """Times of the scenario, from those of a column."""
    if clock == "absolute":
        return time
    return start_time + (np.cumsum(time) if clock == "step" else time)


def _columns(rows: Rows, joints: Joints) -> list[Column]:
    # line breaks of every kind are read as \n
    names = [re.sub("\r\n?", "\n", name) for name in joints.names]
    problems, columns = list[Problem](), list[Column]()
    contents: set[tuple[str, int | None]] = set()
    for i, cell in enumerate(rows.headings):
        try:
            content = column(cell, names, joints.units)
        except HeadingError as error:
            problems.append(Problem(rows.head, f"column {i + 1}", str(error), error.accepted))
            continue
        if content.quantity and (content.quantity, content.joint) in contents:
            quantity = content.quantity
            if content.joint is not None:
                quantity = f"the {quantity} of joint {joints.names[content.joint]!r}"
            message = f"{quantity} is given twice"
            problems.append(Problem(rows.head, f"column {i + 1}", message))
        columns.append(content)
        contents.add((content.quantity, content.joint))
    lacks = [Problem(rows.head, "", message) for message in _missing_columns(columns, joints.names)]
    if problems or lacks:
        raise DocumentError(rows.path, problems or lacks)
    return columns


def _missing_columns(columns: list[Column], joint_names: Sequence[str]) -> list[str]:
    """Faults of missing columns: time, positions of all joints, rates of all or none."""
    lacks: list[str] = []
    if not any(content.quantity == "time" for content in columns):
        lacks.append("the time is missing; a column named time [s] must be given")
    for quantity in QUANTITIES:
        having = {content.joint for content in columns if content.quantity == quantity}
        absent = [name for i, name in enumerate(joint_names) if i not in having]
        if absent and (quantity == "position" or having):
            lacks.append(f"the {quantity} of joint {', '.join(map(repr, absent))} is missing")
    return lacks
