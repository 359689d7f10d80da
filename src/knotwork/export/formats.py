"""Writing motions in the formats of the registry; each module is loaded when it is needed."""

from __future__ import annotations

import os
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from knotwork.errors import InputError
from knotwork.export.lossless import Points
from knotwork.export.registry import Format, checked_options, file_format, get_format
from knotwork.export.table import MotionTable
from knotwork.storage import write_file
from knotwork.trajectory import JointTrajectory


def export(motion: JointTrajectory | Points | MotionTable, name: str, **options: Any) -> Any:
    """Give a motion in a format: text, bytes or an object, as its `to_…` function does.

    >>> import knotwork as kw
    >>> motion = kw.plan("paper_case").trajectory
    >>> export(motion, "csv", rate=100).partition(",")[0]
    'time_s'

    Args:
        motion: The motion. Formats of points also take points as `motion_points` makes them, and
            tables a table as `motion_table` makes it.
        name: Name of the format.
        options: Options of the format.

    Raises:
        UnknownNameError: There is no such format.
        InputError: The format takes no such option, or can't hold the motion.
    """
    form = get_format(name)
    return _made(form, form.function, motion, options)


def content(
    motion: JointTrajectory | Points | MotionTable, name: str, **options: Any
) -> str | bytes:
    """Give the content of a file in a format, of what `export` takes.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> content(lift, "csv", rate=2).splitlines()[1]
    '0,0,0,6,-12'

    Raises:
        InputError: The format has no file, or as for `export`.
    """
    form = file_format(name)
    made: str | bytes = _made(form, form.file_function, motion, options)
    return made


def _made(form: Format, function: str, motion: Any, options: dict[str, Any]) -> Any:
    make = resolve_name(f"knotwork.export.{form.module}:{function}")
    return make(motion, **checked_options(form, options))


def checked_target(path: Path | str, *, force: bool = False) -> Path:
    """Return the file that a path means, links followed, if it may be written.

    >>> checked_target("motion.csv").name
    'motion.csv'

    Args:
        path: Path of the file.
        force: Replace it if it exists.

    Raises:
        InputError: It exists, or is no file.
    """
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise InputError(f"can't write to {path!r}: give the path of a file")
    if os.path.basename(path) in ("", ".", ".."):
        named = "names a folder" if os.fspath(path) else "is empty"
        raise InputError(f"can't write to {str(path)!r}: it {named}; give the path of a file")
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

    >>> import knotwork as kw
    >>> motion = kw.plan("paper_case").trajectory
    >>> save(motion, "pvt", "axis_table.csv", force=True, degrees=True).name
    'axis_table.csv'

    Args:
        trajectory: The motion.
        name: Name of the format.
        path: Path of the file; its folder is made if it does not exist.
        force: Replace the file if it exists.
        options: Options of the format.

    Returns:
        Path of the file.

    Raises:
        UnknownNameError: There is no such format.
        InputError: The file exists or can't be written, or the format can't hold the motion.
    """
    checked_target(path, force=force)
    return write(path, content(trajectory, name, **options), force=force)


def write(path: Path | str, made: str | bytes, *, force: bool = False) -> Path:
    """Write content to a file, whole or not at all.

    >>> write("notes/motion.csv", "time,lift").read_text()
    'time,lift'

    Args:
        path: Path of the file; its folder is made if it does not exist.
        made: What to write.
        force: Replace the file if it exists.

    Raises:
        InputError: The file exists or can't be written.
    """
    return write_file(checked_target(path, force=force), made)
