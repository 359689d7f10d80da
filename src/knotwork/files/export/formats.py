"""The table of export formats, and motions written in them.

Writers of formats are loaded on demand.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from knotwork.curves.trajectory import exportable
from knotwork.errors import InputError, UnknownNameError
from knotwork.errors.old_names import renamed_option
from knotwork.files.export.labels import events_path, events_text
from knotwork.files.storage import write_file, write_files

if TYPE_CHECKING:
    from knotwork.curves.trajectory import JointTrajectory
    from knotwork.files.export.lossless import MotionPoints
    from knotwork.files.export.table import MotionTable


@dataclass(frozen=True)
class Format:
    """An export format.

    Attributes:
        name: Name.
        summary: Short description.
        suffix: Suffix of its files.
        module: Its module in `knotwork.files.export`.
        options: Names of the keyword arguments of its function.
        function: Function of the module that returns the text or bytes; by default `to_` plus the
            name.
        binary: Whether its files are binary.
        events: Whether it contains events; otherwise they are in a second file.
        tabular: Whether it is a table of samples or points.
        straight: Whether it has only positions, which receivers interpolate by straight lines.
    """

    name: str
    summary: str
    suffix: str
    module: str
    options: tuple[str, ...] = ()
    binary: bool = False
    events: bool = False
    tabular: bool = False
    straight: bool = False
    function: str = ""

    def takes_points(self, options: Mapping[str, Any]) -> bool:
        """Whether the format, with these options, has points within a tolerance of the motion."""
        return "tolerance" in self.options and (not self.tabular or bool(options.get("knots_only")))


_TABLE_OPTIONS = tuple(exportable.TableOptions.__annotations__)
_TABLE: dict[str, Any] = {"options": _TABLE_OPTIONS, "events": True, "tabular": True}
_MESSAGE_OPTIONS = tuple(exportable.MessageOptions.__annotations__)
_DRIVE_OPTIONS = tuple(exportable.DriveOptions.__annotations__)
_PROGRAM_OPTIONS = tuple(exportable.ProgramOptions.__annotations__)
_ROS2 = "YAML for ros2 topic pub, or with goal (--goal) for ros2 action send_goal"
_PVT = "position-velocity-time table for motion drives, as CSV"
_URSCRIPT = "program for a controller of Universal Robots"
_KRL = "program for a controller of KUKA: spline blocks"
_RAPID = "program for a controller of ABB"
_LS = "program for a controller of FANUC"
_J519 = "joint angles each 8 ms for FANUC's stream motion"
_FRANKA = "positions each 1 ms for Franka's control interface, within its limits"
_MUJOCO = "keyframes of MuJoCo: positions, velocities and controls of position actuators"
_PARQUET = "samples or knots as Parquet (needs pyarrow)"
_SCIPY = "c and x of a PPoly in an npz; trajectory.to_scipy() in Python"

_ALL_FORMATS = (
    Format("ros2", _ROS2, ".yaml", "ros2", _MESSAGE_OPTIONS),
    Format("pvt", _PVT, ".csv", "pvt", _DRIVE_OPTIONS),
    Format("urscript", _URSCRIPT, ".script", "urscript", _PROGRAM_OPTIONS, events=True),
    Format("krl", _KRL, ".src", "programs", _PROGRAM_OPTIONS, events=True, straight=True),
    Format("rapid", _RAPID, ".mod", "programs", _PROGRAM_OPTIONS, events=True, straight=True),
    Format("ls", _LS, ".ls", "programs", _PROGRAM_OPTIONS, events=True, straight=True),
    Format("rsi", "axis angles each 4 ms for KUKA's RSI", ".csv", "streams", straight=True),
    Format("egm", "joint angles each 4 ms for ABB's EGM", ".csv", "streams", straight=True),
    Format("j519", _J519, ".csv", "streams", ("robot",), straight=True),
    Format("franka", _FRANKA, ".csv", "franka", ("robot",), straight=True),
    Format("csv", "samples or knots as CSV", ".csv", "samples", **_TABLE),
    Format("json", "samples or knots as JSON", ".json", "samples", **_TABLE),
    Format("npz", "samples or knots for NumPy", ".npz", "samples", **_TABLE, binary=True),
    Format("parquet", _PARQUET, ".parquet", "samples", **_TABLE, binary=True),
    Format("mujoco", _MUJOCO, ".xml", "keyframes", ("rate", "lead")),
    Format("mat", "polynomials for MATLAB's ppval", ".mat", "polynomial_files", binary=True),
    Format("scipy", _SCIPY, ".npz", "polynomial_files", binary=True, function="to_scipy_npz"),
)

FORMATS: Mapping[str, Format] = MappingProxyType({item.name: item for item in _ALL_FORMATS})
"""All formats by name."""


def get_format(name: str) -> Format:
    """Return the format of a name.

    >>> file_format = get_format("pvt")
    >>> file_format.suffix, file_format.options
    ('.csv', ('degrees', 'scale', 'offset', 'incremental', 'tolerance'))

    Raises:
        UnknownNameError: The name is unknown.
    """
    if not isinstance(name, str) or name not in FORMATS:
        raise UnknownNameError("format", name, FORMATS)
    return FORMATS[name]


def checked_options(file_format: Format, options: Mapping[str, Any]) -> dict[str, Any]:
    """Check that a format accepts all options, and return them.

    >>> checked_options(get_format("csv"), {"rate": 50})
    {'rate': 50}

    Raises:
        InputError: An option would be ignored.
    """
    options = renamed_option(options, "fit", "tolerance")
    for name in options:
        if name not in file_format.options:
            takers = ", ".join(other.name for other in _ALL_FORMATS if name in other.options)
            advice = f"; formats that do: {takers}" if takers else ""
            raise InputError(f"format {file_format.name!r} takes no option {name!r}{advice}")
    return options


def content(
    motion: JointTrajectory | MotionPoints | MotionTable, name: str, **options: Any
) -> str | bytes:
    """Return the content of a file in a format.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> content(lift, "csv", rate=2).splitlines()[1]
    '0,0,0,6,-12'

    Args:
        motion: The motion. Formats of points also accept points from `motion_points`; tables also
            accept one from `motion_table`.
        name: Name of the format.
        options: Options of the format.

    Raises:
        UnknownNameError: The format is unknown.
        InputError: The format does not accept an option, or can't represent the motion.
    """
    file_format = get_format(name)
    function = file_format.function or f"to_{name}"
    make = resolve_name(f"{__package__}.{file_format.module}:{function}")
    text: str | bytes = make(motion, **checked_options(file_format, options))
    return text


def checked_target(path: Path | str, *, force: bool = False) -> Path:
    """Check that a file may be written, and return its resolved path.

    >>> checked_target("motion.csv").name
    'motion.csv'

    Args:
        path: Path of the file.
        force: Replace it if it exists.

    Raises:
        InputError: The file exists, or the path is not a file.
    """
    try:
        target = Path(path).resolve()
        exists, is_file = target.exists(), target.is_file()
    except (TypeError, OSError, RuntimeError, ValueError) as error:
        # not a path; a loop of links; a NUL in the name
        raise InputError(f"can't write to {path!r}: {error}; give the path of a file") from error
    if (exists and not is_file) or os.path.basename(path) in ("", ".", ".."):
        raise InputError(f"can't write to {path}: it is no regular file; give the path of a file")
    if exists and not force:
        raise InputError(
            f"{path} exists and is kept; give another path, or force=True (--force) to replace it"
        )
    return target


def save(
    trajectory: JointTrajectory, name: str, path: Path | str, *, force: bool = False, **options: Any
) -> Path:
    """Write a motion to a file in a format. If it fails, no file is written.

    If the format has no events, a second file has the events of the motion: next to
    `motion.yaml` it is `motion.events.json`.

    >>> import knotwork as kw
    >>> motion = kw.plan("paper_case").trajectory
    >>> save(motion, "pvt", "axis_table.csv", force=True, degrees=True).name
    'axis_table.csv'

    Args:
        trajectory: The motion.
        name: Name of the format.
        path: Path of the file; its folder is created if it does not exist.
        force: Replace the file if it exists.
        options: Options of the format.

    Returns:
        Path of the file.

    Raises:
        UnknownNameError: The format is unknown.
        InputError: The file exists or can't be written, or the format can't represent the motion.
    """
    checked_target(path, force=force)
    has_all_events = get_format(name).events or not trajectory.events
    side = None if has_all_events else events_text(trajectory)
    return write(path, content(trajectory, name, **options), force=force, side_content=side)


def write(
    path: Path | str, text: str | bytes, *, force: bool = False, side_content: str | None = None
) -> Path:
    """Write content to a file. If it fails, no file is written.

    >>> write("notes/motion.csv", "time,lift").read_text()
    'time,lift'

    Args:
        path: Path of the file; its folder is created if it does not exist.
        text: Content of the file.
        force: Replace the file if it exists.
        side_content: Content of the second file, which has the events; `None` without one.

    Raises:
        InputError: The file exists or can't be written.
    """
    target = checked_target(path, force=force)
    if side_content is None:
        return write_file(target, text)
    side = events_path(target)
    # the same motion in another format has the same second file
    is_same = side.is_file() and side.read_bytes() == side_content.encode()
    side = checked_target(side, force=force or is_same)
    return write_files(target.parent, {target.name: text, side.name: side_content})[0]
