"""Reading of robot logs from CSV: samples of joint positions, and their resolution."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.files.documents.csv_rows import Rows, read_rows
from knotwork.files.foreign.headings import HeadingError
from knotwork.verification.recording.columns import LogColumns, PositionColumn, log_columns

MIN_SAMPLES = 16
"""Minimum number of samples for an estimate of the noise."""

EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Sizes above which times without a unit are ns, µs and ms since 1970, with their factors to s."""

MAX_RADIANS = 4.0 * np.pi * 1.001
"""Joint position [rad] above which values are probably in degrees: two whole turns."""

_DIGITS = re.compile(r"[+-]?\d*\.?(?P<decimals>\d*)(?:[eE](?P<power>[+-]?\d+))?")


@dataclass(frozen=True, eq=False)
class Recording:
    """Recorded samples of joints, in SI.

    Attributes:
        joint_names: Names, length d.
        joint_units: `"rad"` or `"m"` for each.
        time: Times since the first sample [s], shape (n,), increasing.
        position: Joint positions [rad or m], shape (n, d).
        resolution: Size of the last digit of each joint's positions [rad or m], shape (d,).
        origin: Time of the first sample by the log's own clock [s].
        source: Name of the file.
        notes: Omissions and corrections, in words.
    """

    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    time: FloatArray
    position: FloatArray
    resolution: FloatArray
    origin: float
    source: str
    notes: tuple[str, ...]

    @property
    def period(self) -> float:
        """Usual time between two samples [s]."""
        return float(np.median(np.diff(self.time)))


def read_log(
    path: Path | str,
    joint_names: Sequence[str],
    joint_units: Sequence[str],
    *,
    topic: str | None = None,
    degrees: bool = False,
) -> Recording:
    r"""Read the log of a robot from CSV.

    Accepted are headings of PlotJuggler (`__time`, `/joint_states/elbow_joint/position`), of
    flattened ROS messages (`header.stamp.sec`, `header.stamp.nanosec`, `name[0]`, `position[0]`;
    `%time`, `field.position0`), of Universal Robots' RTDE (`timestamp`, `actual_q_0`), and those of
    `knotwork check`. Columns are separated by commas, semicolons, tabs or spaces; with semicolons
    and tabs, numbers may have decimal commas. Other columns are skipped, and so are rows without a
    position of each joint. Rows are sorted by time. For rows at the same time the mean is used.

    >>> lines = [f"{i / 100},{i / 50 - 0.09 * (i % 2) * 1e-3:.4f}" for i in range(20)]
    >>> characters = Path("log.csv").write_text("\n".join(["__time,/arm/lift/position", *lines]))
    >>> log = read_log("log.csv", ["lift"], ["m"])
    >>> log.position.shape, log.resolution
    ((20, 1), array([0.0001]))

    Args:
        path: The file.
        joint_names: The required joints, in any order.
        joint_units: `"rad"` or `"m"` for each.
        topic: The topic to read; required if several have positions of all joints.
        degrees: Whether positions of rad joints without a unit in their headings are in degrees.

    Raises:
        DocumentError: The file can't be read, lacks the time or a joint, has fewer than 16 samples
            or an invalid number; the message names the line or column.
    """
    rows = read_rows(Path(path))
    if not rows.lines:
        raise rows.error(None, None, "has no rows of samples")
    try:
        columns = log_columns(
            rows.headings, rows.cells[0], joint_names, joint_units, topic=topic, degrees=degrees
        )
    except HeadingError as error:
        raise rows.heading_error(None, str(error), error.accepted) from error
    return _to_recording(rows, columns, joint_names, joint_units)


def _to_recording(
    rows: Rows, columns: LogColumns, names: Sequence[str], units: Sequence[str]
) -> Recording:
    position, resolution = _values(rows, columns.positions)
    clock = np.column_stack([_numbers(rows, index) for index, _ in columns.clock])
    complete = np.isfinite(position).all(axis=1) & np.isfinite(clock).all(axis=1)
    notes = []
    if not complete.all():
        notes.append(f"rows without the time or a joint's position: {(~complete).sum()}")
    if complete.sum() < MIN_SAMPLES:
        message = f"has {int(complete.sum())} rows with the time and a position of every joint"
        raise rows.error(None, None, message, f"at least {MIN_SAMPLES}")
    position = position[complete]
    _refuse_degrees(rows, columns, position, names, units)
    since, origin = _seconds(clock[complete], [factor for _, factor in columns.clock])
    time, order = np.unique(since, return_inverse=True)
    if late := np.count_nonzero(np.diff(since) < 0.0):
        notes.append(f"rows not in order of time: {late}")
    if time.size < since.size:
        notes.append(f"rows at the time of another row: {since.size - time.size}")
    if time.size < MIN_SAMPLES:
        message = f"has samples at {time.size} times"
        raise rows.error(None, None, message, f"at least {MIN_SAMPLES}")
    means = np.zeros((time.size, len(names)))
    np.add.at(means, order, position)
    means /= np.bincount(order)[:, None]
    return Recording(
        tuple(names), tuple(units), time - time[0], means, resolution, origin,
        rows.path.name, tuple(notes),
    )  # fmt: skip


def _numbers(rows: Rows, index: int) -> FloatArray:
    """Numbers of a column, NaN for missing ones."""
    values = rows.numbers(index, gaps=True)
    values[~np.isfinite(values)] = np.nan
    return values


def _values(rows: Rows, columns: Sequence[PositionColumn]) -> tuple[FloatArray, FloatArray]:
    """Numbers of columns in SI, NaN for missing ones, and the size of each column's last digit."""
    factors = np.array([column.factor for column in columns])
    values = np.column_stack([_numbers(rows, column.index) for column in columns])
    last = []
    for column in columns:
        numbers = (_DIGITS.fullmatch(cells[column.index].strip()) for cells in rows.cells)
        digits = (
            len(number["decimals"]) - int(number["power"] or 0)
            for number in numbers
            if number and number[0]
        )
        last.append(max(digits, default=-17))
    return values * factors, 10.0 ** -np.array(last, dtype=float) * factors


def _seconds(clock: FloatArray, factors: Sequence[float]) -> tuple[FloatArray, float]:
    """Times since the first row [s], and the time of the first row by the log's clock [s]."""
    largest = float(np.abs(clock[:, 0]).max())
    guessed = next((factor for size, factor in EPOCHS if largest > size), 1.0)
    sizes = [factor or guessed for factor in factors]
    since = sum((clock[:, i] - clock[0, i]) * size for i, size in enumerate(sizes))
    origin = sum(float(clock[0, i]) * size for i, size in enumerate(sizes))
    return np.asarray(since), float(origin)


def _refuse_degrees(
    rows: Rows,
    columns: LogColumns,
    position: FloatArray,
    names: Sequence[str],
    units: Sequence[str],
) -> None:
    for j, column in enumerate(columns.positions):
        largest = float(np.abs(position[:, j]).max())
        is_plain = units[j] == "rad" and column.factor == 1.0 and not column.unit_given
        if is_plain and largest > MAX_RADIANS:
            raise rows.heading_error(
                column.index,
                f"joint {names[j]!r} reaches {largest:.6g} rad, more than two whole turns",
                "degrees with their unit, as [deg] in the heading or as the unit of the log; if "
                "they are radians, [rad] in the heading",
            )
