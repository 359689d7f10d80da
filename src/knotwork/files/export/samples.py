"""The sampled formats: CSV, JSON, NumPy's npz and Parquet, all of one `MotionTable`.

With `knots_only` the content is the points that define the motion exactly. In place of a motion
each takes points of it from `motion_points`, or a table from `motion_table`. Options and errors are
those of `motion_table`.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files.export.lossless import MotionPoints
from knotwork.files.export.packages import import_package
from knotwork.files.export.table import MotionTable, motion_table
from knotwork.files.storage import csv_text, json_text
from knotwork.joint_quantities import JOINT_QUANTITIES

JSON_FORMAT = "knotwork.samples"


def _table(motion: JointTrajectory | MotionPoints | MotionTable, **options: Any) -> MotionTable:
    if not isinstance(motion, MotionTable):
        return motion_table(motion, **options)
    if options:
        raise InputError("the table has its options already; give them to motion_table")
    return motion


def to_csv(motion: JointTrajectory | MotionPoints | MotionTable, **options: Any) -> str:
    """Write samples or knots as CSV with one header row, units in the names of the columns.

    Options and errors are those of `motion_table`.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> print(to_csv(lift, rate=2), end="")
    time_s,lift.position_rad,lift.velocity_rad_per_s,lift.acceleration_rad_per_s2,lift.jerk_rad_per_s3
    0,0,0,6,-12
    0.5,0.5,1.5,0,-12
    1,1,0,-6,-12
    """
    table = _table(motion, **options)
    return csv_text(table.columns(), table.labels)


def to_json(motion: JointTrajectory | MotionPoints | MotionTable, **options: Any) -> str:
    """Write samples or knots as JSON: `joint_names`, `units`, `time`, `positions`, and so on.

    Options and errors are those of `motion_table`.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> import json
    >>> json.loads(to_json(lift, rate=2))["positions"]
    [[0.0], [0.5], [1.0]]
    """
    table = _table(motion, **options)
    data: dict[str, Any] = {
        "format": JSON_FORMAT,
        "version": 1,
        "planner": table.trajectory.origin,
        "note": table.note,
        "joint_names": list(table.trajectory.joint_names),
        "units": {"time": "s", "joints": list(table.trajectory.joint_units)},
        "time": table.time.tolist(),
    }
    for quantity, values in table.joints.items():
        data[JOINT_QUANTITIES[quantity].plural] = values.tolist()
    for key, values in table.tool.items():
        data[key] = values.tolist()
    for key in ("events", "segments") if table.labels else ():
        data[key] = [item.to_dict() for item in getattr(table.trajectory, key)]
    return json_text(data)


def to_npz(motion: JointTrajectory | MotionPoints | MotionTable, **options: Any) -> bytes:
    """Write samples or knots as NumPy's npz, without pickles.

    `numpy.load(file)` gives `time` (s,), `position`, `velocity`, … (s, d), `joint_names` (d,) and
    `joint_units` (d,); with a robot also `tool_position` (s, 3), `tool_quaternion` (s, 4, scalar
    last), `tool_linear_velocity` and `tool_angular_velocity` (s, 3); with labels `segment` and
    `event` (s,).

    Options and errors are those of `motion_table`.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> import io
    >>> np.load(io.BytesIO(to_npz(lift, rate=2)))["position"].shape
    (3, 1)
    """
    table = _table(motion, **options)
    trajectory = table.trajectory
    labels = {
        "joint_names": np.array(trajectory.joint_names),
        "joint_units": np.array(trajectory.joint_units),
        "planner": np.array(trajectory.origin),
    }
    labels |= {key: np.array(values) for key, values in table.labels.items()}
    return npz_bytes({"time": table.time, **table.joints, **table.tool, **labels})


def npz_bytes(arrays: dict[str, Any]) -> bytes:
    """Write arrays as an npz file."""
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def to_parquet(motion: JointTrajectory | MotionPoints | MotionTable, **options: Any) -> bytes:
    """Write samples or knots as Parquet, with the columns of the CSV (needs `pyarrow`).

    Options and errors are those of `motion_table`.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> to_parquet(lift, rate=2)[:4]
    b'PAR1'
    """
    table = _table(motion, **options)
    how = "install it with pip install 'knotwork[parquet]'"
    arrow = import_package("pyarrow", "Parquet", how)
    parquet = import_package("pyarrow.parquet", "Parquet", how)
    columns = arrow.table({**table.columns(), **table.labels})
    about = {"planner": table.trajectory.origin, "note": table.note}
    columns = columns.replace_schema_metadata(about)
    sink = arrow.BufferOutputStream()
    parquet.write_table(columns, sink)
    return bytes(sink.getvalue().to_pybytes())
