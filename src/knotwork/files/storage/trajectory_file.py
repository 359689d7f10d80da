"""Stored trajectories, validated field by field."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import Event, JointTrajectory, Load, Segment
from knotwork.errors import DocumentError, InputError, Problem
from knotwork.files import documents
from knotwork.files.documents import Document, Finite, StrictModel, Text
from knotwork.files.storage.texts import KNOT_FIELDS, TRAJECTORY_FORMAT

KNOT_AGREEMENT = 1e-9
"""Tolerance of stored knots, relative to the largest value.

Knots and coefficients are written with all their digits.
"""
MAX_TRAJECTORY_BYTES = 500_000_000
"""Maximum size of a file; a hundred thousand waypoints of seven joints take half of it."""
MAX_STORED_VALUES = 25_000_000
"""Maximum number of values in a file."""

_Row = list[Finite]
_Table = list[_Row]


class _JointUnits(StrictModel):
    time: Literal["s"] = "s"
    joints: list[Literal["rad", "m"]]


class _KnotTable(StrictModel):
    time: _Row
    position: _Table
    velocity: _Table
    acceleration: _Table


class _TrajectoryFile(StrictModel):
    """A joint trajectory: piece k is Σᵢ coefficients[i][k] (t − breaks[k])^(degree−i)."""

    format: Annotated[str, Field(pattern=f"^{re.escape(TRAJECTORY_FORMAT)}$")]
    version: Literal[1]
    planner: str = ""
    joint_names: Annotated[list[Text], Field(min_length=1)]
    units: _JointUnits
    waypoint_times: _Row | None = None
    events: tuple[Event, ...] = ()
    loads: tuple[Load, ...] = ()
    segments: tuple[Segment, ...] = ()
    breaks: Annotated[_Row, Field(min_length=2)]
    coefficients: Annotated[list[_Table], Field(min_length=1)]
    knots: _KnotTable | None = None


def trajectory_from_dict(data: Document | Mapping[str, Any]) -> JointTrajectory:
    """Make a trajectory from plain data in the format of `trajectory_to_dict`.

    The coefficients define the curve; `knot_disagreement` reports knots that differ
    from it.

    >>> from knotwork.files import storage
    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> trajectory_from_dict(storage.trajectory_to_dict(lift)).position(0.5)
    array([0.5])

    Raises:
        DocumentError: A value is missing, unknown, not finite, of the wrong shape or out of
            order.
    """
    document = data if isinstance(data, Document) else Document(dict(data))
    if isinstance(document.data, dict) and "findings" in document.data:
        raise document.error(
            (), "is a report of a check, not a trajectory", "the trajectory.json next to it"
        )
    content = documents.validate(_TrajectoryFile, document)
    joint_count, pieces = len(content.joint_names), len(content.breaks) - 1
    coefficients = _array(document, ("coefficients",), content.coefficients, 3)
    if coefficients.shape[1:] != (pieces, joint_count):
        accepted = f"(degree + 1, {pieces} pieces, {joint_count} joints)"
        raise document.error(("coefficients",), f"has shape {coefficients.shape}", accepted)
    for i, (before, after) in enumerate(pairwise(content.breaks), 1):
        if after <= before:
            message = f"{after!r} is not greater than {before!r}, the previous one"
            raise document.error(("breaks", i), message)
    units, names = content.units.joints, content.joint_names
    if len(units) != joint_count:
        raise document.error(("units", "joints"), f"has {len(units)} entries", f"{joint_count}")
    for i, name in enumerate(names):
        if name in names[:i]:
            raise document.error(("joint_names", i), f"{name!r} is given twice", "each joint once")
    field = "coefficients"
    try:
        polynomial = PiecewisePolynomial(coefficients, content.breaks)
        field = "waypoint_times"
        times = None if content.waypoint_times is None else np.array(content.waypoint_times)
        return JointTrajectory(
            tuple(names),
            polynomial,
            joint_units=tuple(units),
            origin=content.planner,
            waypoint_times=times,
            events=content.events,
            loads=content.loads,
            segments=content.segments,
        )
    except InputError as error:
        raise document.error((field,), str(error)) from error


def _array(
    document: Document, location: documents.Location, values: Any, dimensions: int
) -> FloatArray:
    try:
        array = np.array(values, dtype=float)
    except ValueError as error:
        raise document.error(location, "has rows of different lengths") from error
    if array.ndim != dimensions:
        raise document.error(location, f"has {array.ndim} dimensions", f"{dimensions} dimensions")
    return array


def knot_disagreement(data: Document, trajectory: JointTrajectory) -> str | None:
    """Describe where the knots of a stored trajectory differ from its coefficients, if they do.

    >>> from knotwork.files import storage
    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> data = storage.trajectory_to_dict(lift)
    >>> data["knots"]["position"][1] = [2.0]
    >>> print(knot_disagreement(Document(data), lift))
    knots.position[1][0] is 2, but the coefficients make it 1; the coefficients are checked

    Raises:
        DocumentError: The knots have another shape than the trajectory.
    """
    stated = data.data.get("knots")
    if stated is None:
        return None
    knots = trajectory.knots
    for name in KNOT_FIELDS:
        actual = np.asarray(getattr(knots, name))
        values = _array(data, ("knots", name), stated[name], actual.ndim)
        if values.shape != actual.shape:
            raise data.error(("knots", name), f"has shape {values.shape}", f"{actual.shape}")
        scale = max(float(np.abs(actual).max()), np.finfo(float).tiny)
        error = np.abs(values - actual)
        if error.max() > KNOT_AGREEMENT * scale:
            index = np.unravel_index(int(error.argmax()), error.shape)
            at = documents.field_path(("knots", name, *(int(i) for i in index)))
            return (
                f"{at} is {values[index]:.9g}, but the coefficients make it {actual[index]:.9g}; "
                "the coefficients are checked"
            )
    return None


def read_trajectory_document(path: Path | str) -> Document:
    """Read the JSON of a stored trajectory.

    Numbers may be infinite or NaN. Later checks refuse them with their location.

    >>> characters = Path("motion.json").write_text('{"planner": "cubic"}')
    >>> read_trajectory_document("motion.json").data
    {'planner': 'cubic'}

    Raises:
        DocumentError: The file can't be read or is not JSON.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "trajectory.json"
    text = documents.read_text(path, max_bytes=MAX_TRAJECTORY_BYTES)
    if text.count(",") + text.count("[") > MAX_STORED_VALUES:
        raise DocumentError(path, [Problem(None, "", f"has more than {MAX_STORED_VALUES} values")])
    try:
        return Document(json.loads(text, object_pairs_hook=_mapping_of), file=path)
    except json.JSONDecodeError as error:
        problem = Problem(
            error.lineno, "", f"is not valid JSON: {error.msg} (column {error.colno})"
        )
    except RecursionError:
        problem = Problem(None, "", "is nested too deep")
    except ValueError as error:
        problem = Problem(None, "", f"is not valid JSON: {error}")
    raise DocumentError(path, [problem])


def _mapping_of(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make a mapping of keys and values; refuse a key given twice by a `ValueError`."""
    data = dict(pairs)
    if len(data) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"{twice} is given twice")
    return data


def load_trajectory(path: Path | str) -> JointTrajectory:
    """Read a stored trajectory: a file, or a folder with a `trajectory.json`.

    `changed_since_report` reports whether it belongs to the `report.json` in its folder.

    >>> import tempfile, knotwork as kw
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     paths = kw.plan("paper_case").save(folder)
    ...     load_trajectory(folder).joint_names
    ('joint_1',)

    Args:
        path: Path of the file or folder.

    Raises:
        DocumentError: The file can't be read, or is not a trajectory.
    """
    return trajectory_from_dict(read_trajectory_document(path))
