"""Trajectories of other tools as mappings: ROS 2's JointTrajectory, and plain JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import AliasChoices, BeforeValidator, Field

from knotwork.errors import DocumentError
from knotwork.files.documents import (
    Document,
    Finite,
    Location,
    Positive,
    StrictModel,
    Text,
    validate,
)
from knotwork.files.documents.values import Forms
from knotwork.files.foreign.headings import is_si
from knotwork.files.foreign.point_table import QUANTITIES, Joints, PointTable

QUANTITY_KEYS: dict[str, tuple[str, ...]] = {
    "time": ("time_from_start", "time", "times", "t"),
    "position": ("positions", "position", "q"),
    "velocity": ("velocities", "velocity", "qd"),
    "acceleration": ("accelerations", "acceleration", "qdd"),
}
"""Keys under which a mapping may give each quantity."""

NANOSECONDS_PER_SECOND = 1_000_000_000
MAX_SECONDS = 2**32

WRAPPERS = ("goal", "trajectory", "joint_trajectory")
"""Keys around the points in an action goal, and in MoveIt's messages."""

_NAME_KEYS = ("joint_names", "joints", "names", "name")
_OTHER_MOTIONS = ("multi_dof_trajectory", "multi_dof_joint_trajectory")
_UNUSED = (
    *("header", "format", "version", "planner", "note", "units", "description"),
    *("effort", "efforts", "jerk", "jerks", *_OTHER_MOTIONS),
    *("path_tolerance", "goal_tolerance", "goal_time_tolerance"),
    *("component_path_tolerance", "component_goal_tolerance"),
    # MoveIt's messages around a trajectory
    *("model_id", "trajectory_start", "group_name", "planning_time", "error_code"),
    "controller_names",
    # cuRobo's JointState
    *("knot", "knot_dt", "control_space", "aux_data", "device_cfg", "tensor_args"),
    *("tool_position", "tool_quaternion", "tool_linear_velocity", "tool_angular_velocity"),
)


class _Duration(StrictModel):
    """A duration of ROS."""

    sec: Annotated[int, Field(strict=True, ge=-MAX_SECONDS, le=MAX_SECONDS)] = Field(
        default=0, validation_alias=AliasChoices("sec", "secs")
    )
    nanosec: Annotated[int, Field(strict=True, ge=0, lt=NANOSECONDS_PER_SECOND)] = Field(
        default=0, validation_alias=AliasChoices("nanosec", "nsecs", "nsec")
    )


def _unbatched(value: Any) -> Any:
    """The rows of a batch of one; any other value unchanged."""
    while isinstance(value, list) and len(value) == 1 and isinstance(value[0], list):
        if not (value[0] and isinstance(value[0][0], list)):
            break
        value = value[0]
    return value


def _single(value: Any) -> Any:
    return value[0] if isinstance(value, list) and len(value) == 1 else value


def _quantity(name: str, *, required: bool) -> Any:
    keys = AliasChoices(*QUANTITY_KEYS[name])
    return Field(validation_alias=keys) if required else Field(default=(), validation_alias=keys)


_Time = Annotated[Finite | _Duration, Forms("a number of seconds, or sec and nanosec")]
_Row = list[Finite]
_Rows = Annotated[list[_Row], BeforeValidator(_unbatched)]


class _Point(StrictModel):
    """A point of a message; efforts and jerks are not used."""

    effort: Any = Field(default=None, validation_alias=AliasChoices("effort", "efforts"))
    jerk: Any = Field(default=None, validation_alias=AliasChoices("jerk", "jerks"))
    time: _Time = _quantity("time", required=True)
    position: _Row = _quantity("position", required=True)
    velocity: _Row = _quantity("velocity", required=False)
    acceleration: _Row = _quantity("acceleration", required=False)


class _PointMessage(StrictModel):
    """A message with a list of points."""

    names: list[Text] = Field(validation_alias=AliasChoices(*_NAME_KEYS))
    points: list[_Point]


class _Arrays(StrictModel):
    """Arrays with a row for each time, or each time step."""

    names: list[Text] = Field(validation_alias=AliasChoices(*_NAME_KEYS))
    step: Annotated[Positive, BeforeValidator(_single)] | None = Field(
        default=None, validation_alias=AliasChoices("dt", "interpolation_dt")
    )
    time: Annotated[list[_Time], BeforeValidator(_unbatched)] = _quantity("time", required=False)
    position: _Rows = _quantity("position", required=True)
    velocity: _Rows = _quantity("velocity", required=False)
    acceleration: _Rows = _quantity("acceleration", required=False)


def read_mapping(document: Document, joints: Joints, start_time: float) -> PointTable:
    """Read points from a mapping.

    The mapping has one of two forms. As in ROS 2, it has `joint_names` and `points`, each with
    `positions`, `velocities`, `accelerations` and `time_from_start`. It may be inside a goal, or
    MoveIt's RobotTrajectory or DisplayTrajectory. As arrays, it has `joint_names`, `time` (or
    `dt`), `positions`, `velocities` and `accelerations`, with a row for each time, possibly in a
    batch of one.

    Args:
        document: The mapping. Times are in s, or `{sec, nanosec}`.
        joints: The known joints; the file may list them in any order.
        start_time: Time that is added to times named `time_from_start` [s].

    Raises:
        DocumentError: A value is missing, unknown, of the wrong shape, or not a number; a joint is
            missing or given twice.
    """
    motion = _unwrap(document)
    if "points" in motion.data:
        message = validate(_PointMessage, motion)
        names = message.names
        columns = {key: [getattr(row, key) for row in message.points] for key in QUANTITY_KEYS}
    else:
        arrays = validate(_Arrays, motion)
        names = arrays.names
        columns = {key: getattr(arrays, key) for key in QUANTITY_KEYS}
        if not columns["time"] and arrays.step is not None:
            columns["time"] = [start_time + i * arrays.step for i in range(len(arrays.position))]
        if not columns["time"]:
            raise motion.error(("time",), "is missing", "time and positions, or points")
    _check_names(motion, names, joints)

    def error(row: int | None, quantity: str, message: str, accepted: str) -> DocumentError:
        return motion.error(_location(motion.data, quantity, row), message, accepted)

    count, order = len(columns["time"]), [names.index(name) for name in joints.names]
    has, values = dict[str, Any](), dict[str, Any]()
    for quantity in QUANTITIES:
        rows = columns[quantity] or [()] * count
        if len(rows) != count:
            raise error(None, quantity, f"has {len(rows)} rows", f"{count}, as times")
        has[quantity] = np.array([len(row) > 0 for row in rows], bool)
        values[quantity] = np.full((count, len(names)), np.nan)
        for i, row in enumerate(rows):
            if len(row) == len(names):
                values[quantity][i] = [row[joint] for joint in order]
            elif len(row) or quantity == "position":
                raise error(i, quantity, f"has {len(row)} values", f"{len(names)}, as joint names")
    time = np.array([_seconds(value) for value in columns["time"]], float)
    relative = ["time_from_start" in _location(motion.data, "time", i) for i in range(count)]
    time[relative] += start_time
    return PointTable(joints, time, values, has, error)


def _location(data: Any, quantity: str, row: int | None) -> Location:
    """Location of a quantity in a row, or in all rows; without a quantity, of all points."""
    points = data.get("points")
    if points is not None and (row is None or not quantity):
        return ("points",)
    part = data if points is None else points[row]
    keys = QUANTITY_KEYS[quantity or "time"]
    key = next((key for key in keys if key in part), keys[0])
    if points is not None:
        return ("points", row or 0, key)
    return (key,) if row is None or not quantity else (key, row)


def _seconds(value: float | _Duration) -> float:
    """A time [s]."""
    if isinstance(value, _Duration):
        return (value.sec * NANOSECONDS_PER_SECOND + value.nanosec) / NANOSECONDS_PER_SECOND
    return value


def _unwrap(document: Document) -> Document:
    """Take the mapping of the points out of those around it, without unused keys.

    Raises:
        DocumentError: There are several motions, units other than SI, or an unknown key.
    """
    data = document.data
    if not isinstance(data, dict):
        kind = type(data).__name__
        raise document.error((), f"has a {kind}", "a mapping with joint_names and points")
    _check_units(document, data.get("units"), ("units",))
    for key in _OTHER_MOTIONS:
        extra = data.get(key)
        if isinstance(extra, dict) and (extra.get("points") or extra.get("joint_names")):
            fault = "moves joints of several degrees of freedom, which is not supported"
            raise document.error((key,), fault, "a file without it, or with an empty one")
    wrapper = next((key for key in WRAPPERS if isinstance(data.get(key), dict | list)), "")
    if not wrapper or "points" in data or any(name in data for name in _NAME_KEYS):
        names = [key for key in _NAME_KEYS if isinstance(data.get(key), list)][:1]
        content = {
            key: data[key] for key in data if key not in (*_UNUSED, *_NAME_KEYS) or key in names
        }
        return replace(document, data=content)
    for key in data:
        if key not in (wrapper, *_UNUSED):
            raise document.error((key,), "unknown key", f"{wrapper} alone")
    motions = document.part((wrapper,))
    if isinstance(motions.data, list) and len(motions.data) == 1:
        motions = motions.part((0,))
    if isinstance(motions.data, list):
        fault = f"has {len(motions.data)} trajectories, but only one motion can be checked"
        raise motions.error((), fault, "one")
    return _unwrap(motions)


def _check_units(document: Document, stated: Any, where: Location) -> None:
    """Refuse stated units that are not SI, because all values are read as SI."""
    if isinstance(stated, Mapping | list):
        for key, unit in stated.items() if isinstance(stated, Mapping) else enumerate(stated):
            _check_units(document, unit, (*where, key))
    elif stated is not None and not (isinstance(stated, str) and is_si(stated)):
        raise document.error(where, f"is {stated!r}", "s, rad or m, or these per s or s²")


def _check_names(motion: Document, names: list[str], joints: Joints) -> None:
    """Check that each joint is named exactly once."""
    key = next(key for key in _NAME_KEYS if key in motion.data)
    accepted = f"each of {', '.join(joints.names)} once, in any order"
    for i, name in enumerate(names):
        if name in names[:i]:
            raise motion.error((key, i), f"joint {name!r} is given twice", accepted)
        if name not in joints.names:
            raise motion.error((key, i), f"{joints.owner} has no joint {name!r}", accepted)
    for name in joints.names:
        if name not in names:
            raise motion.error((key,), f"joint {name!r} is missing", accepted)
