"""Trajectories of other tools as CSV: a heading for each column, a row for each time."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knotwork.documents import read_text
from knotwork.errors import DocumentError, Problem
from knotwork.foreign.header import (
    LABELS,
    Column,
    HeadingError,
    UnknownHeadingError,
    column,
    own_column,
    own_joint,
)
from knotwork.foreign.table import QUANTITIES, Joints, PointTable
from knotwork.waypoints import FloatArray

MOST_BYTES = 500_000_000
MOST_CELLS = 21_000_000
"""More than any table that is exported has."""
MOST_COLUMNS = 10_000

_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_QUOTED = re.compile('"[^"]*"')
_FIRST_ROW = re.compile(r"^(?![^\S\n]*(?:#|$))", re.MULTILINE)
"""The start of the first line that is no comment and not empty."""
LONGEST_HEAD = 1_000_000
"""Characters of the headings that are looked at for what divides them."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Cells of a CSV file, and where they stand.

    Attributes:
        path: The file.
        head: Line of the headings.
        headings: The headings.
        lines: Line of each row below them.
        cells: Rows of as many cells as there are headings.
    """

    path: Path
    head: int
    headings: list[str]
    lines: list[int]
    cells: list[list[str]]

    def error(
        self, line: int | None, index: int | None, message: str, accepted: str = ""
    ) -> DocumentError:
        """The error for a line, and a column of it by its index."""
        field = "" if index is None else f"column {index + 1} ({self.headings[index].strip()})"
        return DocumentError(self.path, [Problem(line, field, message, accepted)])

    def numbers(self, index: int, *, gaps: bool = False) -> FloatArray:
        """Numbers of a column, shape (n,).

        Args:
            index: Which one.
            gaps: Empty cells are NaN.

        Raises:
            DocumentError: A cell is no number.
        """
        values = np.full(len(self.cells), np.nan)
        for i, cells in enumerate(self.cells):
            try:
                if not gaps or cells[index].strip():
                    values[i] = number(cells[index])
            except ValueError:
                message = f"{cells[index]!r} is no number"
                raise self.error(self.lines[i], index, message) from None
        return values


def read_csv(path: Path, joints: Joints, start_time: float) -> PointTable:
    """Read a CSV file.

    Columns are divided by commas, semicolons, tabs or, where there are none of these, by spaces.
    Numbers may have decimal commas where commas divide nothing. Empty lines and lines that start
    with `#` are left out; headings may stand in such a line directly above the numbers.

    Args:
        path: The file.
        joints: The joints there are; the columns may have any order.
        start_time: Added to times named `time_from_start`, and to the sums of those named
            `time_step` [s].

    Raises:
        DocumentError: The file can't be read, has no headings, a column that is not understood, a
            joint missing or twice, a row of another length, or what is no number.
    """
    rows = read_rows(path)
    if all(map(_is_number, rows.headings)):
        accepted = f"a line above the numbers, with time and {', '.join(joints.names)}"
        raise rows.error(rows.head, None, "has no headings", accepted)
    columns = _columns(rows, joints)
    count = len(rows.lines)
    time = np.empty(count)
    values = {quantity: np.full((count, len(joints.names)), np.nan) for quantity in QUANTITIES}
    where: dict[tuple[str, int | None], int] = {}
    for i, content in enumerate(columns):
        if rows.headings[i] in LABELS and not content.quantity:
            continue
        numbers = rows.numbers(i) * content.factor
        where[content.quantity, content.joint] = i
        if content.quantity == "time":
            time = _absolute(numbers, content.clock, start_time)
        elif content.quantity:
            values[content.quantity][:, content.joint] = numbers
    has = {quantity: np.full(count, (quantity, 0) in where) for quantity in QUANTITIES}

    def place(row: int, quantity: str, joint: int | None) -> Callable[[str, str], DocumentError]:
        line = rows.lines[row] if row < count else None
        index = where.get((quantity, joint)) if quantity else None
        return lambda message, accepted: rows.error(line, index, message, accepted)

    return PointTable(joints, time, values, has, place)


def _absolute(time: FloatArray, clock: str, start_time: float) -> FloatArray:
    """Times as the scenario counts them, from those of a column."""
    if clock == "absolute":
        return time
    with np.errstate(all="ignore"):  # what is not finite is refused with its place
        return start_time + (np.cumsum(time) if clock == "step" else time)


def read_rows(path: Path) -> Rows:
    """Read the cells of a file.

    Where commas do not divide the cells, a number may have a decimal comma.

    Raises:
        DocumentError: The file can't be read, is not valid CSV, holds no rows, or one of another
            length than the headings.
    """
    text = read_text(path, most=MOST_BYTES)
    delimiter = _delimiter(text)
    lines = io.StringIO(text)
    above: tuple[int, str] | None = None
    found: list[tuple[int, list[str]]] = []
    at, room = 1, MOST_CELLS
    for line in lines:
        size = 1
        if line.lstrip().startswith("#"):
            above = above if found else (at, line)
        elif line.strip():
            cells, size = _cells(path, at, itertools.chain([line], lines), delimiter)
            if delimiter != ",":
                cells = [_DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
            found.append((at, cells))
            room -= len(cells)
            if len(cells) > MOST_COLUMNS or room < 0:
                most = f"at most {MOST_COLUMNS} columns and {MOST_CELLS} numbers are read"
                raise DocumentError(path, [Problem(at, "", "is too much", most)])
        at += size
    if not found:
        raise DocumentError(path, [Problem(None, "", "holds no rows")])
    if above and all(map(_is_number, found[0][1])):
        # headings in a comment, as NumPy's savetxt writes them
        cells, _ = _cells(path, above[0], iter([above[1].lstrip().lstrip("#")]), delimiter)
        if len(cells) == len(found[0][1]):
            found.insert(0, (above[0], cells))
    (head, headings), *body = found
    for line_number, cells in body:
        if len(cells) != len(headings):
            problem = Problem(
                line_number, "", f"has {len(cells)} values", f"{len(headings)}, as headings"
            )
            raise DocumentError(path, [problem])
    return Rows(path, head, headings, [line for line, _ in body], [cells for _, cells in body])


def _delimiter(text: str) -> str:
    """The character between the cells of the first row; those in quotes do not count."""
    first = _FIRST_ROW.search(text)
    start = first.start() if first else 0
    head = _QUOTED.sub("", text[start : start + LONGEST_HEAD]).partition("\n")[0]
    # spaces are between the words of a heading, too: they count where there is nothing else
    best = max((",", ";", "\t"), key=head.count)
    return " " if best not in head and " " in head else best


def _cells(path: Path, at: int, lines: Iterator[str], delimiter: str) -> tuple[list[str], int]:
    """Cells of the row that begins in line `at`, and how many lines it takes."""
    reader = csv.reader(lines, delimiter=delimiter, strict=True, skipinitialspace=delimiter == " ")
    try:
        return next(reader), reader.line_num
    except csv.Error as error:
        raise DocumentError(path, [Problem(at, "", f"is not valid CSV: {error}")]) from error


def number(cell: str) -> float:
    """A number as data have it; Python would read `1_000` and figures of every script, too."""
    if "_" in cell or not cell.isascii():
        raise ValueError(cell)
    return float(cell)


def _is_number(cell: str) -> bool:
    try:
        number(cell)
    except ValueError:
        return False
    return True


def _columns(rows: Rows, joints: Joints) -> list[Column]:
    # line breaks of every kind are read as \n
    names = [re.sub("\r\n?", "\n", name) for name in joints.names]
    read = own_column if any(own_joint(cell) in names for cell in rows.headings) else column
    unknown, problems, columns = 0, list[Problem](), list[Column]()
    taken: set[tuple[str, int | None]] = set()
    for i, cell in enumerate(rows.headings):
        try:
            content = read(cell, names, joints.units)
        except HeadingError as error:
            of = ""
            if isinstance(error, UnknownHeadingError):
                unknown, of = unknown + 1, f" of {joints.owner}"
            message = f"{error}{of}"
            problems.append(Problem(rows.head, f"column {i + 1}", message, error.accepted))
            continue
        if content.quantity and (content.quantity, content.joint) in taken:
            what = content.quantity
            if content.joint is not None:
                what = f"the {what} of joint {joints.names[content.joint]!r}"
            message = f"{what} is given twice"
            problems.append(Problem(rows.head, f"column {i + 1}", message))
        columns.append(content)
        taken.add((content.quantity, content.joint))
    if unknown > 1 and not any(content.quantity in QUANTITIES for content in columns):
        accepted = f"its joints are {', '.join(names)}"
        raise rows.error(rows.head, None, f"no column is a joint of {joints.owner}", accepted)
    lacks = [Problem(rows.head, "", message) for message in _missing(columns, joints.names)]
    if problems or lacks:
        raise DocumentError(rows.path, problems or lacks)
    return columns


def _missing(columns: list[Column], joint_names: Sequence[str]) -> list[str]:
    """Faults if a column is missing: time, positions of all joints, rates of all or none."""
    lacks: list[str] = []
    if not any(content.quantity == "time" for content in columns):
        lacks.append("the time is missing; a column named time [s] must be given")
    for quantity in QUANTITIES:
        having = {content.joint for content in columns if content.quantity == quantity}
        absent = [name for i, name in enumerate(joint_names) if i not in having]
        if absent and (quantity == "position" or having):
            lacks.append(f"the {quantity} of joint {', '.join(map(repr, absent))} is missing")
    return lacks
