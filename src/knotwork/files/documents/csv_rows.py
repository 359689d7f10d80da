"""Rows of a CSV file, each with its line."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knotwork.errors import DocumentError, Problem
from knotwork.files.documents.yaml_text import read_text

MAX_CSV_BYTES = 500_000_000
MAX_CSV_CELLS = 21_000_000
"""More than the largest exported table has."""
MAX_CSV_COLUMNS = 10_000

_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_QUOTED = re.compile('"[^"]*"')
_FIRST_ROW = re.compile(r"^(?![^\S\n]*(?:#|$))", re.MULTILINE)
"""The start of the first line that is neither empty nor a comment."""
LONGEST_HEAD = 1_000_000
"""Number of heading characters that are searched for the delimiter."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Cells of a CSV file and their lines.

    Attributes:
        path: The file.
        head: Line number of the headings.
        headings: The headings.
        lines: Line number of each row below them.
        cells: Rows, each with as many cells as there are headings.
    """

    path: Path
    head: int
    headings: list[str]
    lines: list[int]
    cells: list[list[str]]

    def error(
        self, line: int | None, index: int | None, message: str, accepted: str = ""
    ) -> DocumentError:
        """The error for a line, or for one column of it, by its index."""
        field = "" if index is None else f"column {index + 1} ({self.headings[index].strip()})"
        return DocumentError(self.path, [Problem(line, field, message, accepted)])

    def numbers(
        self, index: int, *, gaps: bool = False, finite: bool = False
    ) -> NDArray[np.float64]:
        """Numbers of a column, shape (n,).

        Args:
            index: Index of the column.
            gaps: Read empty cells as NaN.
            finite: Refuse infinite numbers and NaN.

        Raises:
            DocumentError: A cell is not a number.
        """
        values = np.full(len(self.cells), np.nan)
        for i, cells in enumerate(self.cells):
            try:
                if not gaps or cells[index].strip():
                    values[i] = number(cells[index])
            except ValueError:
                message = f"{cells[index].strip()!r} is not a number"
                raise self.error(self.lines[i], index, message) from None
        if finite and not np.isfinite(values).all():
            i = int(np.argmin(np.isfinite(values)))
            raise self.error(self.lines[i], index, f"is {values[i]}", "a finite number")
        return values


def read_rows(path: Path, delimiter: str = "") -> Rows:
    """Read the cells of a file.

    Columns are separated by commas, semicolons, tabs or, without any of these, by spaces.
    Numbers may have decimal commas unless commas separate columns. Empty lines and comments with
    `#` are skipped; headings may be in a comment directly above the numbers.

    Args:
        path: The file.
        delimiter: Column delimiter; by default the one of the first row.

    Raises:
        DocumentError: The file can't be read, is not valid CSV, has no rows, or a row of another
            length than the headings.
    """
    text = read_text(path, max_bytes=MAX_CSV_BYTES)
    delimiter = delimiter or _delimiter(text)
    comments: list[tuple[int, str]] = []

    def lines() -> Iterator[str]:
        for at, line in enumerate(io.StringIO(text), 1):
            comment = line.lstrip().startswith("#")
            if comment and not rows:
                comments.append((at, line.lstrip().lstrip("#")))
            yield "\n" if comment else line

    rows: list[tuple[int, list[str]]] = []
    remaining = MAX_CSV_CELLS
    reader = _reader(lines(), delimiter)
    try:
        for cells in reader:
            if not any(map(str.strip, cells)):
                continue
            if delimiter != ",":
                cells = [_DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
            rows.append((reader.line_num, cells))
            remaining -= len(cells)
            if len(cells) > MAX_CSV_COLUMNS or remaining < 0:
                most = f"at most {MAX_CSV_COLUMNS} columns and {MAX_CSV_CELLS} numbers are accepted"
                raise DocumentError(path, [Problem(reader.line_num, "", "is too large", most)])
    except csv.Error as error:
        problem = Problem(reader.line_num, "", f"is not valid CSV: {error}")
        raise DocumentError(path, [problem]) from error
    if not rows:
        raise DocumentError(path, [Problem(None, "", "has no rows")])
    if comments and all(map(is_number, rows[0][1])):
        # headings in a comment, as NumPy's savetxt writes them
        at, above = comments[-1]
        cells = next(_reader(iter([above]), delimiter), [])
        if len(cells) == len(rows[0][1]):
            rows.insert(0, (at, cells))
    (head, headings), *body = rows
    for line_number, cells in body:
        if len(cells) != len(headings):
            problem = Problem(
                line_number, "", f"has {len(cells)} values", f"{len(headings)}, as in the headings"
            )
            raise DocumentError(path, [problem])
    return Rows(path, head, headings, [line for line, _ in body], [cells for _, cells in body])


def _reader(lines: Iterator[str], delimiter: str):  # type: ignore[no-untyped-def]
    return csv.reader(lines, delimiter=delimiter, strict=True, skipinitialspace=delimiter == " ")


def _delimiter(text: str) -> str:
    """The character between the cells of the first row, outside quotes."""
    first = _FIRST_ROW.search(text)
    start = first.start() if first else 0
    head = _QUOTED.sub("", text[start : start + LONGEST_HEAD]).partition("\n")[0]
    # Spaces also separate the words of a heading: they count only without another delimiter.
    best = max((",", ";", "\t"), key=head.count)
    return " " if best not in head and " " in head else best


def number(cell: str) -> float:
    """A number in plain notation; Python would also read `1_000` and digits of every script."""
    if "_" in cell or not cell.isascii():
        raise ValueError(cell)
    return float(cell)


def is_number(cell: str) -> bool:
    """Whether a cell is a number."""
    try:
        number(cell)
    except ValueError:
        return False
    return True
