"""Trajectories of other tools as CSV: a heading for each column, a row for each time."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from knotwork.documents import read_text
from knotwork.errors import DocumentError, Problem
from knotwork.foreign.header import (
    Column,
    HeadingError,
    UnknownHeadingError,
    column,
    own_column,
    own_joint,
)
from knotwork.foreign.table import QUANTITIES, Place, PointTable
from knotwork.waypoints import FloatArray

DELIMITERS = (",", ";", "\t")
MOST_BYTES = 500_000_000
MOST_CELLS = 21_000_000
"""More than any table that is exported has."""
MOST_COLUMNS = 10_000

_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_QUOTED = re.compile('"[^"]*"')


def read_csv(
    path: Path,
    joint_names: Sequence[str],
    joint_units: Sequence[str],
    *,
    start_time: float = 0.0,
    owner: str = "the scenario",
) -> PointTable:
    """Read a CSV file.

    Columns are divided by commas, semicolons, tabs or, where there are none of these, by spaces.
    Numbers may have decimal commas where commas divide nothing. Empty lines and lines that start
    with `#` are left out; headings may stand in such a line directly above the numbers.

    Args:
        path: The file.
        joint_names: The joints there are; the columns may have any order.
        joint_units: `"rad"` or `"m"` for each.
        start_time: Added to times named `time_from_start`, and to the sums of those named
            `time_step` [s].
        owner: What the joints are of, for errors.

    Raises:
        DocumentError: The file can't be read, has no headings, a column that is not understood, a
            joint missing or twice, a row of another length, or what is no number.
    """
    rows = read_rows(path)
    if not rows:
        raise DocumentError(path, [Problem(None, "", "holds no rows")])
    head, cells = rows[0]
    if all(_is_number(cell) for cell in cells):
        accepted = f"a line above the numbers, with time and {', '.join(joint_names)}"
        raise DocumentError(path, [Problem(head, "", "has no headings", accepted)])
    columns = _columns(path, head, cells, joint_names, joint_units, owner)
    lines, numbers = _numbers(path, rows[1:], cells)
    time = np.empty(len(lines))
    values = {quantity: np.full((len(lines), len(joint_names)), np.nan) for quantity in QUANTITIES}
    where: dict[tuple[str, int | None], int] = {}
    for i, content in enumerate(columns):
        if content.quantity == "time":
            time = _absolute(numbers[:, i] * content.factor, content.clock, start_time)
        elif content.quantity:
            values[content.quantity][:, content.joint] = numbers[:, i] * content.factor
        else:
            continue
        where[content.quantity, content.joint] = i
    has = {quantity: np.full(len(lines), (quantity, 0) in where) for quantity in QUANTITIES}
    place = _places(path, lines, cells, where)
    return PointTable(tuple(joint_names), tuple(joint_units), time, values, has, place)


def _places(
    path: Path,
    lines: Sequence[int],
    cells: Sequence[str],
    where: Mapping[tuple[str, int | None], int],
) -> Place:
    def place(row: int, quantity: str, joint: int | None) -> Callable[[str, str], DocumentError]:
        line = lines[row] if row < len(lines) else None
        index = where.get((quantity, joint))
        field = "" if index is None else f"column {index + 1} ({cells[index].strip()})"
        return lambda message, accepted: DocumentError(
            path, [Problem(line, field, message, accepted)]
        )

    return place


def _absolute(time: FloatArray, clock: str, start_time: float) -> FloatArray:
    """Times as the scenario counts them, from those of a column."""
    if clock == "absolute":
        return time
    with np.errstate(all="ignore"):  # what is not finite is refused with its place
        return start_time + (np.cumsum(time) if clock == "step" else time)


def read_rows(path: Path) -> list[tuple[int, list[str]]]:
    """Rows of cells with the lines they begin in, the headings first.

    Where commas do not divide the cells, a number may have a decimal comma.

    Raises:
        DocumentError: The file can't be read or is not valid CSV.
    """
    text = read_text(path, most=MOST_BYTES)
    delimiter = _delimiter(text)
    lines = io.StringIO(text)
    above: tuple[int, str] | None = None
    rows: list[tuple[int, list[str]]] = []
    at, room = 1, MOST_CELLS
    for line in lines:
        size = 1
        if line.lstrip().startswith("#"):
            above = above if rows else (at, line)
        elif line.strip():
            cells, size = _cells(path, at, itertools.chain([line], lines), delimiter)
            if delimiter != ",":
                cells = [_DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
            rows.append((at, cells))
            room -= len(cells)
            if len(cells) > MOST_COLUMNS or room < 0:
                most = f"at most {MOST_COLUMNS} columns and {MOST_CELLS} numbers are read"
                raise DocumentError(path, [Problem(at, "", "is too much", most)])
        at += size
    if rows and above and all(_is_number(cell) for cell in rows[0][1]):
        # headings in a comment, as NumPy's savetxt writes them
        i, line = above
        cells, _ = _cells(path, i, iter([line.lstrip().lstrip("#")]), delimiter)
        if len(cells) == len(rows[0][1]):
            return [(i, cells), *rows]
    return rows


def _delimiter(text: str) -> str:
    """The character between the cells of the first row; those in quotes do not count."""
    head = _QUOTED.sub("", _first_row(text))
    # spaces are between the words of a heading, too: they count where there is nothing else
    return max(
        (*DELIMITERS, " "), key=lambda one: (head.count(one) > 0, one != " ", head.count(one))
    )


def _first_row(text: str) -> str:
    """The row below comments and empty lines; line breaks in quotes are part of it."""
    row: list[str] = []
    quotes = 0
    for line in io.StringIO(text):
        if row or (line.strip() and not line.lstrip().startswith("#")):
            row.append(line)
            quotes += line.count('"')
            if quotes % 2 == 0:
                break
    return "".join(row)


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


def _columns(
    path: Path,
    line: int,
    cells: list[str],
    joint_names: Sequence[str],
    joint_units: Sequence[str],
    owner: str,
) -> list[Column]:
    unknown = 0
    problems: list[Problem] = []
    columns: list[Column] = []
    taken: set[tuple[str, int | None]] = set()
    # line breaks of every kind are read as \n
    names = [re.sub("\r\n?", "\n", name) for name in joint_names]
    ours = any(own_joint(cell) in names for cell in cells)
    read = own_column if ours else column
    for i, cell in enumerate(cells):
        try:
            content = read(cell, names, joint_units)
        except HeadingError as error:
            message = str(error)
            if isinstance(error, UnknownHeadingError):
                unknown += 1
                message += f" of {owner}"
            problems.append(Problem(line, f"column {i + 1}", message, error.accepted))
            continue
        if content.quantity and (content.quantity, content.joint) in taken:
            what = content.quantity
            if content.joint is not None:
                what = f"the {what} of joint {joint_names[content.joint]!r}"
            problems.append(Problem(line, f"column {i + 1}", f"{what} is given twice"))
        columns.append(content)
        taken.add((content.quantity, content.joint))
    if unknown > 1 and not any(content.quantity in QUANTITIES for content in columns):
        accepted = f"its joints are {', '.join(names)}"
        raise DocumentError(path, [Problem(line, "", f"no column is a joint of {owner}", accepted)])
    if problems:
        raise DocumentError(path, problems)
    missing = _missing(columns, joint_names)
    if missing:
        raise DocumentError(path, [Problem(line, "", message) for message in missing])
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


def _numbers(
    path: Path, rows: list[tuple[int, list[str]]], head: list[str]
) -> tuple[list[int], FloatArray]:
    """Lines of the rows, and their numbers of shape (n, number of columns)."""
    values = np.empty((len(rows), len(head)))
    for row, (line, cells) in enumerate(rows):
        if len(cells) != len(head):
            message = f"has {len(cells)} values"
            raise DocumentError(path, [Problem(line, "", message, f"{len(head)}, as headings")])
        try:
            values[row] = [number(cell) for cell in cells]
        except ValueError:
            at = next(i for i, cell in enumerate(cells) if not _is_number(cell))
            field = f"column {at + 1} ({head[at].strip()})"
            problem = Problem(line, field, f"{cells[at]!r} is no number")
            raise DocumentError(path, [problem]) from None
    return [line for line, _ in rows], values
