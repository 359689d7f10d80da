"""Trajectories, samples and reports to files; each file is written whole or not at all."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.trajectory import JointTrajectory

FORMAT = "knotwork.trajectory"
KNOT_FIELDS = ("time", "position", "velocity", "acceleration")
# More numbers than this in a table, some 400 MB of text, are a mistake in the rate rather than a
# file anybody reads.
MOST_VALUES = 20_000_000

_NUMBERS = re.compile(r"\[\n\s*-?\d[-+\d.eE,\s]*\]")


def trajectory_to_dict(trajectory: JointTrajectory) -> dict[str, Any]:
    """Give a trajectory as plain data, ready for JSON, in SI with its units named.

    `coefficients` have SciPy's `PPoly` order and the shape (degree + 1, pieces, joints). A curve
    of cubics also states its `knots`, which carry all of it.
    """
    data: dict[str, Any] = {
        "format": FORMAT,
        "version": 1,
        "planner": trajectory.planner,
        "joint_names": list(trajectory.joint_names),
        "units": {"time": "s", "joints": list(trajectory.joint_units)},
    }
    if trajectory.waypoint_times is not None:
        data["waypoint_times"] = np.asarray(trajectory.waypoint_times).tolist()
    data["breaks"] = trajectory.breaks.tolist()
    data["coefficients"] = trajectory.polynomial.c.tolist()
    if len(trajectory.polynomial.c) == 4:
        knots = trajectory.knots
        data["knots"] = {name: getattr(knots, name).tolist() for name in KNOT_FIELDS}
    return data


def refuse_too_many(trajectory: JointTrajectory, rate: float, columns: int) -> None:
    """Refuse a table of more than 20 million numbers before any of it is made.

    Args:
        trajectory: What is sampled.
        rate: Samples per second [Hz].
        columns: Numbers a sample.

    Raises:
        InputError: It would have more.
    """
    rows = MOST_VALUES // columns
    samples = rate * trajectory.duration
    if samples > rows - 2:  # the start counts, too, and perhaps a shorter step
        accepted = 0.999 * rows / trajectory.duration
        raise InputError(
            f"rate {rate:.9g} Hz over {trajectory.duration:.9g} s makes {samples:.3g} samples of "
            f"{columns} numbers, more than the {MOST_VALUES} that a table may have; a rate up to "
            f"{accepted:.4g} Hz is accepted"
        )


def samples_to_csv(trajectory: JointTrajectory, rate: float) -> str:
    """Write samples of position, velocity, acceleration and jerk as CSV with a header.

    Args:
        trajectory: The curve.
        rate: Samples per second [Hz]; the last sample is at the end whatever the rate.

    Raises:
        InputError: The rate makes more than 20 million numbers.
    """
    refuse_too_many(trajectory, rate, 1 + 4 * len(trajectory.joint_names))
    samples = trajectory.sample(rate)
    header = ["time_s"]
    columns = [samples.time[:, np.newaxis]]
    for quantity, power in (
        ("position", ""),
        ("velocity", "_per_s"),
        ("acceleration", "_per_s2"),
        ("jerk", "_per_s3"),
    ):
        columns.append(getattr(samples, quantity))
        header += [
            f"{name}.{quantity}_{unit}{power}"
            for name, unit in zip(trajectory.joint_names, trajectory.joint_units, strict=True)
        ]
    text = io.StringIO()
    np.savetxt(
        text, np.hstack(columns), fmt="%.17g", delimiter=",", header=",".join(header), comments=""
    )
    return text.getvalue()


def write_files(folder: Path | str, contents: Mapping[str, str | bytes]) -> list[Path]:
    """Write files into a folder, all of them or none; existing ones are replaced.

    Args:
        folder: Made if it does not exist.
        contents: Text, written in UTF-8, or bytes by file name.

    Returns:
        Paths of the files.

    Raises:
        InputError: The folder can't be made or written to.
    """
    folder = Path(folder)
    written: list[tuple[Path, Path]] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in contents.items():
            handle, temporary = tempfile.mkstemp(dir=folder, prefix=f".{name}.")
            written.append((Path(temporary), folder / name))
            with os.fdopen(handle, "wb") as file:
                file.write(content if isinstance(content, bytes) else content.encode())
            Path(temporary).chmod(_mode(folder / name))
        _replace_all(written)
    except (OSError, ValueError) as error:  # ValueError: a name or text that no file can have
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"can't write to {folder}: {reason}; give a folder that can be made and written to"
        ) from error
    finally:
        for temporary_path, _ in written:
            temporary_path.unlink(missing_ok=True)
    return [path for _, path in written]


def _replace_all(files: list[tuple[Path, Path]]) -> None:
    """Move new files into their places; if one can't be, put back what was there before.

    Raises:
        OSError: A file could not be moved.
    """
    done: list[tuple[Path, Path | None]] = []
    try:
        for new, path in files:
            old = new.with_name(f"{new.name}.old") if path.exists() else None
            done.append((path, old))
            if old is not None:
                shutil.copy2(path, old)
            os.replace(new, path)
    except OSError:
        for (new, path), (_, old) in zip(files, done, strict=False):
            moved = not new.exists()
            if moved and old is not None:
                os.replace(old, path)
            elif moved:
                path.unlink()
        raise
    finally:
        for _, old in done:
            if old is not None:
                old.unlink(missing_ok=True)


def _mode(path: Path) -> int:
    """Permissions of a file that is replaced, or those that a new one gets."""
    try:
        return path.stat().st_mode & 0o777
    except OSError:
        return 0o666 & ~_umask()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def to_json(data: Mapping[str, Any]) -> str:
    """Write plain data as JSON text, rows of numbers on a line each so that it can be read."""
    text = json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)
    return _NUMBERS.sub(lambda row: " ".join(row.group().split()), text) + "\n"
