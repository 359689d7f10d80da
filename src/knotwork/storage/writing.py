"""Trajectories, tables and reports to files; each file is written whole or not at all."""

from __future__ import annotations

import io
import json
import os
import re
import secrets
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

FORMAT = "knotwork.trajectory"
KNOT_FIELDS = ("time", "position", "velocity", "acceleration")
_NUMBERS = re.compile(r"\[\n\s*-?\d[-+\d.eE,\s]*\]")


def trajectory_to_dict(trajectory: JointTrajectory) -> dict[str, Any]:
    """Give a trajectory as plain data, ready for JSON, in SI with its units named.

    `coefficients` have SciPy's `PPoly` order and the shape (degree + 1, pieces, joints). A curve
    of cubics also states its `knots`, which define all of it.

    >>> data = trajectory_to_dict(kw.plan("paper_case").trajectory)
    >>> data["format"], data["planner"], data["units"]["time"]
    ('knotwork.trajectory', 'modified-hermite', 's')
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


def to_csv(columns: Mapping[str, FloatArray]) -> str:
    """Write columns of numbers, each of shape (n,), as CSV with one header row."""
    text = io.StringIO()
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.17g", delimiter=",")
    return ",".join(map(_quoted, columns)) + "\n" + text.getvalue()


def _quoted(cell: str) -> str:
    """A cell of CSV, in quotes where it has to be."""
    return '"' + cell.replace('"', '""') + '"' if set(cell) & set(',;"\t\r\n#') else cell


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
    try:
        return _write({folder / name: content for name, content in contents.items()})
    except (OSError, ValueError) as error:  # ValueError: a name or text that no file can have
        raise InputError(
            f"can't write to {folder}: {_reason(error)}; give a folder that can be made and "
            "written to"
        ) from error


def write_file(path: Path | str, content: str | bytes, *, what: str = "") -> Path:
    """Write one file, whole or not at all; an existing one is replaced.

    Args:
        path: Path of the file; its folder is made if it does not exist.
        content: Text, written in UTF-8, or bytes.
        what: What it holds, for the error, such as `"a picture"`.

    Raises:
        InputError: It can't be written.
    """
    try:
        return _write({Path(path): content})[0]
    except (OSError, ValueError) as error:
        raise InputError(
            f"can't write {what + ' ' if what else ''}to {path}: {_reason(error)}; give a file in "
            "a folder that can be made and written to"
        ) from error


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


def _write(contents: Mapping[Path, str | bytes]) -> list[Path]:
    """Write files, all of them or none.

    Raises:
        OSError: One could not be written.
        ValueError: A name or text that no file can have.
    """
    written: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
            with temporary.open("xb") as file:
                written.append((temporary, path))
                if path.exists():
                    shutil.copymode(path, temporary)
                file.write(content if isinstance(content, bytes) else content.encode())
        _replace_all(written)
    finally:
        for temporary_path, _ in written:
            temporary_path.unlink(missing_ok=True)
    return list(contents)


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


def to_json(data: Mapping[str, Any]) -> str:
    """Write plain data as JSON text, rows of numbers on a line each so that it can be read."""
    text = json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)
    return _NUMBERS.sub(lambda row: " ".join(row.group().split()), text) + "\n"
