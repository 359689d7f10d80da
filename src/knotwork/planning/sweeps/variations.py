"""Axes of a grid of variations, from ranges, lists, random numbers and rows of a CSV file."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.errors import DocumentError, InputError, format_value
from knotwork.errors.arguments import require_count, require_flag
from knotwork.files.documents import parse
from knotwork.files.documents.csv_rows import read_rows
from knotwork.task.task_part import plain

ACCEPTED = "a range FROM:TO:COUNT, values separated by commas, or uniform(FROM, TO) with samples"
_NUMBER = r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*"
_RANGE = re.compile(f"{_NUMBER}:{_NUMBER}:{_NUMBER}")
_UNIFORM = re.compile(rf"\s*uniform\({_NUMBER},{_NUMBER}\)\s*")
MAX_STUDY_ROWS = 1_000_000
"""Maximum number of rows of a study."""


@dataclass(frozen=True)
class Axis:
    """Values that vary together.

    Attributes:
        paths: The varied fields.
        columns: Values of each path, all of one length.
    """

    paths: tuple[str, ...]
    columns: tuple[tuple[Any, ...], ...]

    def __len__(self) -> int:
        return len(self.columns[0])


@dataclass(frozen=True)
class _Uniform:
    low: float
    high: float

    def draw(self, count: int, seed: int, path: str) -> tuple[float, ...]:
        """Draw reproducible numbers; NumPy does not promise equal ones across versions."""
        generator = random.Random(f"{seed} {path}")
        return tuple(self.low + (self.high - self.low) * generator.random() for _ in range(count))


def make_axes(
    vary: Mapping[str, Any],
    *,
    rows: str | Path | None = None,
    together: bool = False,
    samples: int | None = None,
    seed: int = 0,
) -> tuple[Axis, ...]:
    """Make the axes whose product is the study; the last one varies fastest.

    Args:
        vary: Values by path: a list, an array, or text as on the command line.
        rows: A CSV file with paths as header; its rows are the first axis.
        together: Whether all values vary together, row by row, as one axis.
        samples: Number of random samples, which are the last axis.
        seed: Seed of the random numbers.

    Raises:
        InputError: An argument is wrong, or values are malformed, of different lengths, or missing.
    """
    require_flag(together, "together")
    require_count(seed, "seed")
    if samples is not None:
        require_count(samples, "samples", 1)
    if not isinstance(vary, Mapping) or not all(isinstance(path, str) for path in vary):
        raise InputError(
            f"vary is {format_value(vary)}; accepted: a mapping of paths to their values"
        )
    values_of = {path: _values(path, spec) for path, spec in vary.items()}
    axes: list[dict[str, Sequence[Any]]] = [_rows(Path(rows))] if rows is not None else []
    for path in axes[0] if axes else ():
        if path in values_of:
            raise InputError(f"{path} is varied twice: by {rows} and on its own; leave out one")
    uniform = {path: values for path, values in values_of.items() if isinstance(values, _Uniform)}
    axes += [
        {path: values} for path, values in values_of.items() if not isinstance(values, _Uniform)
    ]
    if samples is not None and not uniform:
        raise InputError("samples are given, but nothing is random; accepted: uniform(FROM, TO)")
    if samples is None and together and axes:
        samples = len(next(iter(axes[0].values())))
    if uniform:
        if samples is None:
            first = next(iter(uniform))
            raise InputError(f"{first} is random, and the number of samples is not given")
        axes.append({path: span.draw(samples, seed, path) for path, span in uniform.items()})
    if together and axes:
        axes = [{path: values for axis in axes for path, values in axis.items()}]
        counts = {path: len(values) for path, values in axes[0].items()}
        if len(set(counts.values())) > 1:
            listed = ", ".join(f"{path} has {count}" for path, count in counts.items())
            raise InputError(f"values that vary together must have one number of values; {listed}")
    return _checked_axes(axes)


def _checked_axes(axes: Sequence[Mapping[str, Sequence[Any]]]) -> tuple[Axis, ...]:
    """Make axes of their columns, none of them empty, and not too many rows."""
    if not axes:
        raise InputError(f"nothing is varied; accepted: a path and its values, {ACCEPTED}")
    for path, values in (item for axis in axes for item in axis.items()):
        if not values:
            raise InputError(f"{path} has no values; accepted: one or more")
    grid = tuple(Axis(tuple(axis), tuple(map(tuple, axis.values()))) for axis in axes)
    count = math.prod(map(len, grid))
    if count > MAX_STUDY_ROWS:
        raise InputError(f"the study has {count} rows; accepted: at most {MAX_STUDY_ROWS}")
    return grid


def _values(path: str, variation: Any) -> Sequence[Any] | _Uniform:
    if isinstance(variation, str):
        return parse_values(path, variation)
    if isinstance(variation, np.ndarray | Iterable) and not isinstance(variation, Mapping | bytes):
        listed = [plain(value) for value in variation]
        for value in listed:
            _check_finite(path, value)
        return listed
    raise InputError(
        f"{path} is varied over {format_value(variation)}; accepted: a list of values, {ACCEPTED}"
    )


def _check_finite(path: str, value: Any) -> None:
    for number in value if isinstance(value, list) else [value]:
        if isinstance(number, float) and not math.isfinite(number):
            raise InputError(f"{path} is varied over {number}; accepted: finite numbers")


def parse_values(path: str, text: str) -> Sequence[Any] | _Uniform:
    """Read values in the syntax of the command line.

    >>> parse_values("knots", "paper,balanced"), parse_values("rate", "100:200:3")
    (['paper', 'balanced'], [100.0, 150.0, 200.0])
    """
    if match := _RANGE.fullmatch(text):
        low, high, count = (float(number) for number in match.groups())
        if count != int(count) or not 1 <= count <= MAX_STUDY_ROWS or (count == 1 and low != high):
            raise InputError(
                f"{path}: the range {text} has the count {match[3].strip()}; accepted: a whole "
                f"number of at least 2, and at most {MAX_STUDY_ROWS}"
            )
        n = int(count)
        return [low + (high - low) * i / (n - 1) if n > 1 else low for i in range(n)]
    if match := _UNIFORM.fullmatch(text):
        return _Uniform(float(match[1]), float(match[2]))
    try:
        listed = parse(f"[{text}]").data
    except DocumentError as error:
        raise InputError(f"{path}: can't read the values {text!r}; accepted: {ACCEPTED}") from error
    texts = (value for value in listed if isinstance(value, str))
    if not listed or any(re.search(r"[:()]|^$", text) for text in texts):
        raise InputError(f"{path}: can't read the values {text!r}; accepted: {ACCEPTED}")
    for value in listed:
        _check_finite(path, value)
    return listed  # type: ignore[no-any-return]


def _rows(file: Path) -> dict[str, Sequence[Any]]:
    """Columns of a CSV file by the path in its header."""
    rows = read_rows(file, ",")
    header = [name.strip() for name in rows.headings]
    if not all(header) or len(set(header)) < len(header):
        accepted = "paths of values, each once, for example frames.block.position[0]"
        raise rows.heading_error(None, f"the header is {format_value(header)}", accepted)
    if not rows.lines:
        raise rows.error(None, None, "has no rows", "a header of paths, then a row per scenario")
    columns: dict[str, list[Any]] = {path: [] for path in header}
    for line, cells in zip(rows.lines, rows.cells, strict=True):
        for i, (path, cell) in enumerate(zip(header, cells, strict=True)):
            try:
                columns[path].append(parse(cell.strip()).data)
            except DocumentError as error:
                message = f"can't read {format_value(cell)}"
                raise rows.error(line, i, message, "values as in a scenario file") from error
            _check_finite(f"{file}: line {line}: {path}", columns[path][-1])
    return {path: tuple(values) for path, values in columns.items()}
