"""Trajectories, tables and reports as text."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory

PRODUCT = "knotwork"
TRAJECTORY_FORMAT = f"{PRODUCT}.trajectory"
"""Name of the format in stored files, which a new name of the package would not change."""
KNOT_FIELDS = ("time", "position", "velocity", "acceleration")
_NUMBERS = re.compile(r"\[\n\s*-?\d[-+\d.eE,\s]*\]")


def trajectory_to_dict(trajectory: JointTrajectory) -> dict[str, Any]:
    """Convert a trajectory to plain data, ready for JSON, in SI with its units named.

    `planner` is the origin. `coefficients` have SciPy's `PPoly` order and the shape (degree + 1,
    pieces, joints). A curve of cubics also states its `knots`, which define all of it.

    >>> data = trajectory_to_dict(kw.plan("paper_case").trajectory)
    >>> data["version"], data["planner"], data["units"]["time"]
    (1, 'modified-hermite', 's')
    """
    data: dict[str, Any] = {
        "format": TRAJECTORY_FORMAT,
        "version": 1,
        "planner": trajectory.origin,
        "joint_names": list(trajectory.joint_names),
        "units": {"time": "s", "joints": list(trajectory.joint_units)},
    }
    if trajectory.waypoint_times is not None:
        data["waypoint_times"] = np.asarray(trajectory.waypoint_times).tolist()
    for key in ("events", "loads", "segments"):
        if parts := getattr(trajectory, key):
            data[key] = [part.to_dict() for part in parts]
    data["breaks"] = trajectory.breaks.tolist()
    data["coefficients"] = trajectory.polynomial.c.tolist()
    if len(trajectory.polynomial.c) == 4:
        knots = trajectory.knots
        data["knots"] = {name: getattr(knots, name).tolist() for name in KNOT_FIELDS}
    return data


def csv_text(
    columns: Mapping[str, FloatArray], labels: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> str:
    """Write columns of numbers, then columns of text, as CSV with one header row.

    >>> print(csv_text({"time": np.array([0, 1]), "lift": np.array([0, 0.5])}), end="")
    time,lift
    0,0
    1,0.5
    """
    text = io.StringIO()
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.17g", delimiter=",")
    head = ",".join(map(_quoted, [*columns, *labels])) + "\n"
    if not labels:
        return head + text.getvalue()
    rows = zip(text.getvalue().splitlines(), *labels.values(), strict=True)
    return head + "".join(",".join([row, *map(_quoted, texts)]) + "\n" for row, *texts in rows)


def rows_to_csv(names: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    r"""Write rows of any values as CSV with a header row; missing values are empty.

    >>> from knotwork.files import storage
    >>> storage.rows_to_csv(["planner", "jump"], [{"planner": "cubic"}])
    'planner,jump\ncubic,\n'
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _quoted(cell: str) -> str:
    """A cell of CSV, in quotes where required."""
    return '"' + cell.replace('"', '""') + '"' if set(cell) & set(',;"\t\r\n#') else cell


def json_text(data: Mapping[str, Any]) -> str:
    """Write plain data as JSON text, each row of numbers on one line for readability.

    >>> print(json_text({"lift": [0.0, 0.5]}), end="")
    {
     "lift": [ 0.0, 0.5 ]
    }
    """
    text = json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)
    return _NUMBERS.sub(lambda row: " ".join(row.group().split()), text) + "\n"
