"""The sampled formats: CSV, JSON, NumPy's npz and Parquet, all of one `MotionTable`.

Each also takes `knots_only`, and then holds the points that carry the motion without loss. In place
of a motion each takes points of it as `carry` makes them, or a table made already.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import InputError
from knotwork.export.carrying import Points
from knotwork.export.packages import needed
from knotwork.export.table import MotionTable, motion_table
from knotwork.storage import to_csv as columns_to_csv
from knotwork.storage import to_json as json_text
from knotwork.trajectory import JointTrajectory

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from knotwork.exportable import TableOptions

JSON_FORMAT = "knotwork.samples"
_PLURALS = {
    "position": "positions",
    "velocity": "velocities",
    "acceleration": "accelerations",
    "jerk": "jerks",
}


def _table(
    motion: JointTrajectory | Points | MotionTable, **options: Unpack[TableOptions]
) -> MotionTable:
    if not isinstance(motion, MotionTable):
        return motion_table(motion, **options)
    if options:
        raise InputError("the table is made already; give its options to motion_table")
    return motion


def to_csv(motion: JointTrajectory | Points | MotionTable, **options: Unpack[TableOptions]) -> str:
    """Write samples or knots as CSV with one header row, units in the names of the columns.

    Options and errors are those of `knotwork.export.motion_table`.
    """
    return columns_to_csv(_table(motion, **options).columns())


def to_json(motion: JointTrajectory | Points | MotionTable, **options: Unpack[TableOptions]) -> str:
    """Write samples or knots as JSON: `joint_names`, `units`, `time`, `positions`, and so on.

    Options and errors are those of `knotwork.export.motion_table`.
    """
    table = _table(motion, **options)
    data: dict[str, Any] = {
        "format": JSON_FORMAT,
        "version": 1,
        "planner": table.planner,
        "note": table.note,
        "joint_names": list(table.joint_names),
        "units": {"time": "s", "joints": list(table.joint_units)},
        "time": table.time.tolist(),
    }
    for quantity, values in table.joints.items():
        data[_PLURALS[quantity]] = values.tolist()
    for key, values in table.tool.items():
        data[key] = values.tolist()
    return json_text(data)


def _arrays(table: MotionTable) -> dict[str, Any]:
    arrays: dict[str, Any] = {"time": table.time}
    arrays.update(table.joints)
    arrays.update(table.tool)
    arrays["joint_names"] = np.array(table.joint_names)
    arrays["joint_units"] = np.array(table.joint_units)
    arrays["planner"] = np.array(table.planner)
    return arrays


def to_npz(
    motion: JointTrajectory | Points | MotionTable, **options: Unpack[TableOptions]
) -> bytes:
    """Write samples or knots as NumPy's npz, without pickles.

    `numpy.load(file)` gives `time` (s,), `position`, `velocity`, … (s, d), `joint_names` (d,) and
    `joint_units` (d,); with a robot also `tool_position` (s, 3), `tool_quaternion` (s, 4, scalar
    last), `tool_linear_velocity` and `tool_angular_velocity` (s, 3).

    Options and errors are those of `knotwork.export.motion_table`.
    """
    table = _table(motion, **options)
    return npz_bytes(_arrays(table))


def npz_bytes(arrays: dict[str, Any]) -> bytes:
    """Write arrays as an npz file."""
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def to_parquet(
    motion: JointTrajectory | Points | MotionTable, **options: Unpack[TableOptions]
) -> bytes:
    """Write samples or knots as Parquet, its columns those of the CSV (needs `pyarrow`).

    Options and errors are those of `knotwork.export.motion_table`.
    """
    table = _table(motion, **options)
    how = "install it with pip install 'knotwork[parquet]'"
    arrow = needed("pyarrow", "Parquet", how)
    parquet = needed("pyarrow.parquet", "Parquet", how)
    columns = arrow.table(table.columns())
    about = {"planner": table.planner, "note": table.note}
    columns = columns.replace_schema_metadata(about)
    sink = arrow.BufferOutputStream()
    parquet.write_table(columns, sink)
    return bytes(sink.getvalue().to_pybytes())
