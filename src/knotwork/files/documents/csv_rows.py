"""Rows of a CSV file, each with its line."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import DocumentError, Problem
from knotwork.files.documents.yaml_text import read_text

MAX_CSV_BYTES = 500_000_000
MAX_CSV_CELLS = 21_000_000
"""Maximum number of cells, more than the largest exported table has."""
MAX_CSV_COLUMNS = 10_000
"""Maximum number of columns."""

_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*)$")
_QUOTED = re.compile('"[^"]*"')
_FIRST_ROW = re.compile(r"^(?![^\S\n]*(?:#|$))", re.MULTILINE)
"""The start of the first line that is neither empty nor a comment."""
MAX_HEADING_LENGTH = 1_000_000
"""Maximum number of characters of the first row that are searched for the delimiter."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Cells of a CSV file and their lines.

    Attributes:
        path: The file.
        heading_line: Line number of the headings.
        headings: The headings.
        lines: Line number of each row below them.
        cells: Rows, each with as many cells as there are headings.
    """

    path: Path
    heading_line: int
    headings: list[str]
    lines: list[int]
    cells: list[list[str]]

    def error(
        self, line: int | None, index: int | None, message: str, accepted: str = ""
    ) -> DocumentError:
        """Make the error for a line, or for its cell in the column of an index."""
        field = "" if index is None else f"column {index + 1} ({self.headings[index].strip()})"
        return DocumentError(self.path, [Problem(line, field, message, accepted)])

    def heading_error(self, index: int | None, message: str, accepted: str = "") -> DocumentError:
        """Make the error for the headings, or for the one of an index."""
        return self.error(self.heading_line, index, message, accepted)

    def numbers(self, index: int, *, gaps: bool = False, finite: bool = False) -> FloatArray:
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
                    values[i] = parse_number(cells[index])
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
        for line_number, line in enumerate(io.StringIO(text), 1):
            comment = line.lstrip().startswith("#")
            if comment and not rows:
                comments.append((line_number, line.lstrip().lstrip("#")))
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
                accepted = f"at most {MAX_CSV_COLUMNS} columns and {MAX_CSV_CELLS} numbers"
                raise DocumentError(path, [Problem(reader.line_num, "", "is too large", accepted)])
    except csv.Error as error:
        problem = Problem(reader.line_num, "", f"is not valid CSV: {error}")
        raise DocumentError(path, [problem]) from error
    if not rows:
        raise DocumentError(path, [Problem(None, "", "has no rows")])
    if comments and all(map(is_number, rows[0][1])):
        # headings in a comment, as NumPy's savetxt writes them
        heading_line, comment = comments[-1]
        cells = next(_reader(iter([comment]), delimiter), [])
        if len(cells) == len(rows[0][1]):
            rows.insert(0, (heading_line, cells))
    (heading_line, headings), *body = rows
    for line_number, cells in body:
        if len(cells) != len(headings):
            problem = Problem(
                line_number, "", f"has {len(cells)} values", f"{len(headings)}, as in the headings"
            )
            raise DocumentError(path, [problem])
    return Rows(path, heading_line, headings, [line for line, _ in body], [row for _, row in body])


def _reader(lines: Iterator[str], delimiter: str):  # type: ignore[no-untyped-def]
    return csv.reader(lines, delimiter=delimiter, strict=True, skipinitialspace=delimiter == " ")


def _delimiter(text: str) -> str:
    """Find the character that separates the cells of the first row."""
    first = _FIRST_ROW.search(text)
    start = first.start() if first else 0
    row = _QUOTED.sub("", text[start : start + MAX_HEADING_LENGTH]).partition("\n")[0]
    # Spaces also separate the words of a heading: they count only without another delimiter.
    best = max((",", ";", "\t"), key=row.count)
    return " " if best not in row and " " in row else best


def parse_number(cell: str) -> float:
    """Parse a number. Unlike `float`, refuse `1_000` and digits of other scripts."""
    if "_" in cell or not cell.isascii():
        raise ValueError(cell)
    return float(cell)


def is_number(cell: str) -> bool:
    """Whether a cell is a number."""
    try:
        parse_number(cell)
    except ValueError:
        return False
    return True
