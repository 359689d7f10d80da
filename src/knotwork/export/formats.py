"""The formats by name; each module is loaded when its format is first asked for."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from knotwork.errors import InputError, UnknownNameError
from knotwork.storage import write_files
from knotwork.trajectory import JointTrajectory


@dataclass(frozen=True)
class Format:
    """One format in words.

    Attributes:
        name: Its name.
        summary: What it is.
        suffix: What its files end in.
        binary: Its files are no text.
        options: Names of the keyword arguments that its exporter takes.
        module: Module of `knotwork.export` that writes it.
        function: What gives it in Python: text, bytes or an object.
        file_function: What gives the content of a file; empty if it has no file.
    """

    name: str
    summary: str
    suffix: str
    binary: bool
    options: tuple[str, ...]
    module: str
    function: str
    file_function: str


_TABLE = ("rate", "knots_only", "accelerations", "fit", "robot")

_ALL = (
    Format(
        "ros2",
        "YAML of a trajectory_msgs/JointTrajectory or, with --goal, a FollowJointTrajectory goal",
        ".yaml",
        False,
        ("goal", "accelerations", "fit"),
        "ros2",
        "to_ros2",
        "to_ros2",
    ),
    Format(
        "pvt",
        "position-velocity-time table for motion drives, as CSV",
        ".csv",
        False,
        ("degrees", "scale", "offset", "incremental", "fit"),
        "pvt",
        "to_pvt",
        "to_pvt",
    ),
    Format("csv", "samples or knots as CSV", ".csv", False, _TABLE, "samples", "to_csv", "to_csv"),
    Format(
        "json", "samples or knots as JSON", ".json", False, _TABLE, "samples", "to_json", "to_json"
    ),
    Format(
        "npz", "samples or knots for NumPy", ".npz", True, _TABLE, "samples", "to_npz", "to_npz"
    ),
    Format(
        "parquet",
        "samples or knots as Parquet (needs pyarrow)",
        ".parquet",
        True,
        _TABLE,
        "samples",
        "to_parquet",
        "to_parquet",
    ),
    Format("mat", "polynomials for MATLAB's ppval", ".mat", True, (), "mat", "to_mat", "to_mat"),
    Format(
        "scipy",
        "PPoly of SciPy; as a file, its arrays c and x in an npz",
        ".npz",
        True,
        (),
        "scipy_ppoly",
        "to_scipy",
        "to_scipy_npz",
    ),
    Format(
        "drake",
        "PiecewisePolynomial of Drake; in Python only",
        "",
        True,
        (),
        "drake",
        "to_drake",
        "",
    ),
)

FORMATS: Mapping[str, Format] = MappingProxyType({form.name: form for form in _ALL})
"""All formats in words, by name."""


def get_format(name: str) -> Format:
    """Return the format of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in FORMATS:
        raise UnknownNameError("format", name, FORMATS)
    return FORMATS[name]


def checked_options(form: Format, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options if the format takes all of them.

    Raises:
        InputError: One would be ignored.
    """
    for name in options:
        if name not in form.options:
            takers = [other.name for other in _ALL if name in other.options]
            raise InputError(
                f"format {form.name!r} takes no option {name!r}"
                + (f"; formats that do: {', '.join(takers)}" if takers else "")
            )
    return dict(options)


def export(trajectory: JointTrajectory, name: str, **options: Any) -> Any:
    """Give a motion in a format: text, bytes or an object, as its `to_…` function does.

    Raises:
        UnknownNameError: There is no such format.
        InputError: The format takes no such option, or can't carry the motion.
    """
    form = get_format(name)
    return _function(form, form.function)(trajectory, **checked_options(form, options))


def content(trajectory: JointTrajectory, name: str, **options: Any) -> str | bytes:
    """Give the content of a file in a format.

    Raises:
        UnknownNameError: There is no such format.
        InputError: It has no file, takes no such option, or can't carry the motion.
    """
    form = get_format(name)
    if not form.file_function:
        raise InputError(
            f"format {form.name!r} is an object in memory and has no file of its own; make it in "
            f"Python with trajectory.{form.function}()"
        )
    made = _function(form, form.file_function)(trajectory, **checked_options(form, options))
    return made if isinstance(made, bytes) else str(made)


def _function(form: Format, function: str) -> Any:
    return getattr(importlib.import_module(f"knotwork.export.{form.module}"), function)


def checked_target(path: Path | str, *, force: bool = False) -> Path:
    """Return the file that a path means, links followed, if it may be written.

    Args:
        path: Of the file.
        force: Replace it if it exists.

    Raises:
        InputError: It exists, or is no file.
    """
    try:
        target = Path(path).resolve()
        exists, regular = target.exists(), target.is_file()
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links; a NUL in the name
        raise InputError(f"can't write to {str(path)!r}: {error}") from error
    if exists and not regular:
        kind = "a folder" if target.is_dir() else "no regular file"
        raise InputError(f"can't write to {path}: it is {kind}; give the path of a file")
    if exists and not force:
        raise InputError(
            f"{path} exists and is kept; give another path, or replace it with --force (in Python "
            "force=True)"
        )
    return target


def save(
    trajectory: JointTrajectory,
    name: str,
    path: Path | str,
    *,
    force: bool = False,
    **options: Any,
) -> Path:
    """Write a motion to a file in a format, whole or not at all.

    Args:
        trajectory: The motion.
        name: Of the format.
        path: Of the file; its folder is made if it does not exist.
        force: Replace the file if it exists.
        options: Those of the format.

    Returns:
        Path of the file.

    Raises:
        UnknownNameError: There is no such format.
        InputError: The file exists or can't be written, or the format can't carry the motion.
    """
    checked_target(path, force=force)
    return write(path, content(trajectory, name, **options), force=force)


def write(path: Path | str, made: str | bytes, *, force: bool = False) -> Path:
    """Write content to a file, whole or not at all.

    Args:
        path: Of the file; its folder is made if it does not exist.
        made: What to write.
        force: Replace the file if it exists.

    Raises:
        InputError: The file exists or can't be written.
    """
    target = checked_target(path, force=force)
    (written,) = write_files(target.parent, {target.name: made})
    return written
