"""Trajectories from files, stored by Knotwork or written by other tools."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydantic import Field

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import DocumentError, InputError, Problem
from knotwork.files import documents, storage
from knotwork.files.documents import Document, Finite, StrictModel, validate
from knotwork.files.documents.csv_rows import MAX_CSV_BYTES
from knotwork.files.foreign.csv_file import read_csv
from knotwork.files.foreign.mapping_file import read_mapping
from knotwork.files.foreign.point_table import Joints, to_trajectory
from knotwork.files.storage.texts import TRAJECTORY_FORMAT

TIME_RESOLUTION = 1.0000001e-9
"""Resolution of the times in a ROS 2 message [s], rounding included."""

CSV = (".csv", ".tsv", ".txt")
YAML = (".yaml", ".yml")
NUMPY = ".npz"
FOREIGN = ("csv", "points", "polynomials")
"""Kinds of files of other tools."""
POINTS = ("points", "trajectory", "joint_trajectory", "goal", "positions", "position", "q")
"""Keys of which one shows that data are points, unless one of `STORED` is there."""
STORED = ("coefficients", "breaks")
"""Keys of a stored trajectory."""


def read_trajectory(
    path: Path | str,
    joint_names: Sequence[str],
    joint_units: Sequence[str],
    *,
    span: tuple[float, float] = (0.0, 0.0),
    owner: str = "the scenario",
) -> tuple[JointTrajectory, list[str]]:
    r"""Read a trajectory of Knotwork or of another tool, recognised by name and content.

    The suffixes `.csv`, `.tsv` and `.txt` mean CSV, and `.npz` means arrays of NumPy. A file
    `.yaml` or `.yml` is a ROS 2 message or goal, or a piecewise polynomial of Drake. All other
    files are JSON: a stored trajectory or plain points.

    Args:
        path: The file, or a folder with a `trajectory.json`.
        joint_names: The required joints of another tool's file, in any order.
        joint_units: `"rad"` or `"m"` for each.
        span: Start and end of the task [s]. Times named `time_from_start` count from the
            start of the task. Those of a message are whole nanoseconds: a motion that ends less
            than one before the end of the task is continued to it.
        owner: Owner of the joints, for errors.

    Returns:
        The trajectory, and faults of the file for the report.

    Raises:
        DocumentError: The file can't be read or is not a trajectory. The message has the location.

    >>> characters = Path("motion.csv").write_text("time,lift\n0,0\n1,0.5\n")
    >>> trajectory, faults = read_trajectory("motion.csv", ["lift"], ["m"])
    >>> trajectory.position(0.5), faults
    (array([0.25]), [])
    """
    path, joints = Path(path), Joints(tuple(joint_names), tuple(joint_units), owner)
    if _suffix(path) in CSV:
        table = read_csv(path, joints, span[0])
        return to_trajectory(table, f"{path.name} (CSV)"), []
    document = _document(path)
    if _content(document) == "polynomials":
        return read_polynomials(document, joints), []
    kind = "ROS 2" if _suffix(path) in YAML else "NumPy" if _suffix(path) == NUMPY else "JSON"
    if kind == "JSON" and _content(document) != "points":
        stored = storage.trajectory_from_dict(document)
        fault = storage.knot_disagreement(document, stored)
        return stored, [] if fault is None else [fault]
    table = read_mapping(document, joints, span[0])
    trajectory = to_trajectory(table, f"{path.name} ({kind})")
    return _extend_to_end(trajectory, span[1]) if kind == "ROS 2" else trajectory, []


def is_trajectory(path: Path | str) -> bool:
    """Whether a path names a trajectory: by its suffix, or else by its content.

    >>> is_trajectory("motion.csv"), is_trajectory("motion.yaml")
    (True, False)
    """
    suffix, kind = _suffix(Path(path)), _kind(Path(path))
    if suffix in (".json", "folder"):
        return kind != "scenario"
    return kind in FOREIGN or (kind == "stored" and suffix not in YAML)


def is_foreign(path: Path | str) -> bool:
    """Whether a file has points of another tool, or samples; `False` if it can't be read.

    >>> path = storage.write_file("motion.csv", "time,lift")
    >>> is_foreign(path), is_foreign("missing.json")
    (True, False)
    """
    return _kind(Path(path)) in FOREIGN


def _kind(path: Path) -> str:
    """Kind of a file: `"csv"`, or that of its content; empty if it can't be read."""
    try:
        return "csv" if _suffix(path) in CSV else _content(_document(path))
    except DocumentError:
        return ""


def _content(document: Document) -> str:
    """Kind of data: a `"stored"` trajectory, a `"scenario"`, `"points"` or `"polynomials"`."""
    data = document.data if isinstance(document.data, dict) else {}
    if data.get("format") == TRAJECTORY_FORMAT:
        return "stored"
    if "polynomials" in data and "breaks" in data:
        return "polynomials"
    if "waypoints" in data and "format" not in data:
        return "scenario"
    points = any(key in data for key in POINTS) and not any(key in data for key in STORED)
    return "points" if points else ""


def _suffix(path: Path) -> str:
    return "folder" if path.is_dir() else path.suffix.lower()


def _document(path: Path) -> Document:
    """Plain data from YAML, JSON or arrays of NumPy."""
    if _suffix(path) == NUMPY:
        return _arrays(path)
    if _suffix(path) not in YAML:
        try:
            return storage.read_trajectory_document(path)
        except DocumentError:
            if _suffix(path) in ("folder", ".json", "") or not path.is_file():
                raise
            kinds = f"accepted: {', '.join(('.json', *CSV, *YAML))}, or JSON of any name"
            raise DocumentError(path, [Problem(None, "", f"not a trajectory; {kinds}")]) from None
    # `ros2 topic echo` ends a message with `---`
    return documents.parse(documents.read_text(path).rstrip().removesuffix("\n---"), path)


def _arrays(path: Path) -> Document:
    """The arrays of an npz as lists; no objects are loaded."""
    try:
        with np.load(path, allow_pickle=False) as file:
            sizes = sum(entry.file_size for entry in file.zip.infolist())
            if sizes > MAX_CSV_BYTES:
                problem = Problem(None, "", f"has {sizes} bytes", f"at most {MAX_CSV_BYTES}")
                raise DocumentError(path, [problem])
            return Document({name: file[name].tolist() for name in file.files}, file=path)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, AttributeError) as error:
        raise DocumentError(path, [Problem(None, "", "is not an npz of NumPy arrays")]) from error


def _extend_to_end(trajectory: JointTrajectory, end: float) -> JointTrajectory:
    if not 0.0 < end - trajectory.end_time <= TIME_RESOLUTION:
        return trajectory
    breaks = np.append(trajectory.breaks[:-1], end)
    return replace(trajectory, polynomial=PiecewisePolynomial(trajectory.polynomial.c, breaks))


class _Polynomials(StrictModel):
    """Fields of `drake::trajectories::PiecewisePolynomial`, and optional joint names."""

    breaks: list[Finite] = Field(min_length=2)
    polynomials: list[list[list[list[Finite]]]]
    joint_names: list[str] | None = None


def read_polynomials(document: Document, joints: Joints) -> JointTrajectory:
    """Read a piecewise polynomial of Drake: one column of polynomials per segment.

    Args:
        document: `breaks`, and `polynomials` by segment, row and column, coefficients from the
            lowest power, in the time since the segment's break. Rows are in the order of
            `joint_names` if given, else in that of the joints.
        joints: The known joints.

    Raises:
        DocumentError: The shape or the joints differ, or the breaks do not increase.
    """
    polynomials = validate(_Polynomials, document)
    names = list(joints.names) if polynomials.joint_names is None else polynomials.joint_names
    if sorted(names) != sorted(joints.names):
        accepted = f"each of {', '.join(joints.names)} once, in any order"
        raise document.error(("joint_names",), f"differs from that of {joints.owner}", accepted)
    segments, size = polynomials.polynomials, len(joints.names)
    if len(segments) != len(polynomials.breaks) - 1:
        fault = f"has {len(segments)} segments"
        raise document.error(
            ("polynomials",), fault, f"{len(polynomials.breaks) - 1}, between breaks"
        )
    degree = max((len(c) for segment in segments for row in segment for c in row), default=0)
    coefficients = np.zeros((max(degree, 1), len(segments), size))
    columns = [joints.names.index(name) for name in names]
    for i, segment in enumerate(segments):
        if len(segment) != size or any(len(row) != 1 for row in segment):
            shape = f"{len(segment)} rows of {sorted({len(row) for row in segment})} columns"
            accepted = f"{size} rows, one for each joint of {joints.owner}, of one column"
            raise document.error(("polynomials", i), f"has {shape}", accepted)
        for j, (row,) in enumerate(segment):
            coefficients[coefficients.shape[0] - len(row) :, i, columns[j]] = row[::-1]
    try:
        curve = PiecewisePolynomial(coefficients, np.array(polynomials.breaks))
    except InputError as error:
        raise document.error(("breaks",), str(error)) from error
    order = "" if polynomials.joint_names else ", rows in the order of the joints"
    file = document.file.name if document.file is not None else ""
    description = f"{len(segments)} polynomials of degree {len(coefficients) - 1}{order}"
    origin = f"{file} (Drake), {description}"
    return JointTrajectory(joints.names, curve, joint_units=joints.units, origin=origin)
