"""Trajectories of other tools as CSV: a heading for each column, a row for each time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import DocumentError, Problem
from knotwork.files.documents.csv_rows import Rows, is_number, read_rows
from knotwork.files.foreign.headings import Column, HeadingError, parse_heading
from knotwork.files.foreign.point_table import QUANTITIES, Joints, PointTable


def read_csv(path: Path, joints: Joints, start_time: float) -> PointTable:
    """Read a CSV file.

    Args:
        path: The file.
        joints: The known joints; the columns may have any order.
        start_time: Time that is added to times named `time_from_start`, and to sums of those named
            `time_step` [s].

    Raises:
        DocumentError: The file can't be read, has no headings, an unknown column, a
            joint missing or twice, a row of another length, or an invalid number.
    """
    rows = read_rows(path)
    if all(map(is_number, rows.headings)):
        accepted = f"a line above the numbers, with time and {', '.join(joints.names)}"
        raise rows.heading_error(None, "has no headings", accepted)
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
            time = _to_scenario_time(numbers, content.clock, start_time)
        else:
            values[content.quantity][:, content.joint] = numbers
    has = {quantity: np.full(count, quantity in first_column) for quantity in QUANTITIES}

    def error(row: int, quantity: str, message: str, accepted: str) -> DocumentError:
        line = rows.lines[row] if row < count else None
        return rows.error(line, first_column.get(quantity), message, accepted)

    return PointTable(joints, time, values, has, error)


def _to_scenario_time(time: FloatArray, clock: str, start_time: float) -> FloatArray:
    """Convert times of a column to times of the scenario [s]."""
    if clock == "absolute":
        return time
    return start_time + (np.cumsum(time) if clock == "step" else time)


def _columns(rows: Rows, joints: Joints) -> list[Column]:
    # line breaks of every kind are read as \n
    names = [re.sub("\r\n?", "\n", name) for name in joints.names]
    problems, columns, line = list[Problem](), list[Column](), rows.heading_line
    contents: set[tuple[str, int | None]] = set()
    for i, cell in enumerate(rows.headings):
        try:
            content = parse_heading(cell, names, joints.units)
        except HeadingError as error:
            problems.append(Problem(line, f"column {i + 1}", str(error), error.accepted))
            continue
        if content.quantity and (content.quantity, content.joint) in contents:
            quantity = content.quantity
            if content.joint is not None:
                quantity = f"the {quantity} of joint {joints.names[content.joint]!r}"
            message = f"{quantity} is given twice"
            problems.append(Problem(line, f"column {i + 1}", message))
        columns.append(content)
        contents.add((content.quantity, content.joint))
    if not problems:
        problems = [Problem(line, "", fault) for fault in _missing_columns(columns, joints.names)]
    if problems:
        raise DocumentError(rows.path, problems)
    return columns


def _missing_columns(columns: list[Column], joint_names: Sequence[str]) -> list[str]:
    """Describe missing columns: time and positions are required, rates for all joints or none."""
    faults: list[str] = []
    if not any(content.quantity == "time" for content in columns):
        faults.append("the time is missing; a column named time [s] must be given")
    for quantity in QUANTITIES:
        present = {content.joint for content in columns if content.quantity == quantity}
        missing = [name for i, name in enumerate(joint_names) if i not in present]
        if missing and (quantity == "position" or present):
            faults.append(f"the {quantity} of joint {', '.join(map(repr, missing))} is missing")
    return faults
