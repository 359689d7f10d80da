"""Trajectories of other tools as mappings: ROS 2's JointTrajectory, and plain JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from knotwork.documents import Document, Location
from knotwork.errors import DocumentError, did_you_mean
from knotwork.foreign.point_table import QUANTITIES, Joints, PointTable
from knotwork.foreign.unit_words import in_si

KEYS: dict[str, tuple[str, ...]] = {
    "time": ("time_from_start", "time", "times", "t"),
    "position": ("positions", "position", "q"),
    "velocity": ("velocities", "velocity", "qd"),
    "acceleration": ("accelerations", "acceleration", "qdd"),
}
"""Keys under which a mapping may give each quantity."""

UNUSED_IN_POINT = ("effort", "efforts", "jerk", "jerks")

NANOSECONDS = 1_000_000_000
MOST_SECONDS = 2**32

WRAPPERS = ("goal", "trajectory", "joint_trajectory")
"""Keys of messages: of an action goal, of MoveIt's RobotTrajectory, DisplayTrajectory."""

_STEPS = ("dt", "interpolation_dt")
"""Keys of a constant time step, in place of times."""

_NAMES = ("joint_names", "joints", "names", "name")
_OTHER_MOTIONS = ("multi_dof_trajectory", "multi_dof_joint_trajectory")
_UNUSED = (
    "header",
    "format",
    "version",
    "planner",
    "note",
    "units",
    "name",
    "description",
    "path_tolerance",
    "goal_tolerance",
    "component_path_tolerance",
    "component_goal_tolerance",
    "goal_time_tolerance",
    # MoveIt's messages around a trajectory
    *("model_id", "trajectory_start", "group_name", "planning_time", "error_code"),
    "controller_names",
    # cuRobo's JointState
    *("knot", "knot_dt", "control_space", "aux_data", "device_cfg", "tensor_args"),
    *_OTHER_MOTIONS,
    *UNUSED_IN_POINT,
    "tool_position",
    "tool_quaternion",
    "tool_linear_velocity",
    "tool_angular_velocity",
)
_ROWS = tuple(key for keys in KEYS.values() for key in keys)


def read_points(document: Document, joints: Joints, start_time: float) -> PointTable:
    """Read points from a mapping.

    Either as in ROS 2, `joint_names` and `points` with `positions`, `velocities`,
    `accelerations` and `time_from_start` each (also inside a goal, or MoveIt's RobotTrajectory or
    DisplayTrajectory); or as arrays, `joint_names`, `time` (or `dt`), `positions`, `velocities` and
    `accelerations`, a row for each time, also in a batch of one.

    Args:
        document: The mapping. Times are in s, or `{sec, nanosec}`.
        joints: The known joints; the file may list them in any order.
        start_time: Added to times named `time_from_start` [s].

    Raises:
        DocumentError: A value is missing, unknown, of the wrong shape, or not a number; a joint is
            missing or given twice.
    """
    outer, (data, at) = _inside(document)
    given = _names(document, data, at, joints)
    order = [given.index(name) for name in joints.names]
    rows, rows_at = _rows(document, data, at)
    for part, where in (*outer, (data, at)):
        _check_units(document, part.get("units"), (*where, "units"))

    def place(row: int, quantity: str, joint: int | None) -> Callable[[str, str], DocumentError]:
        where = rows[row][quantity].where if quantity else rows_at
        where = where if joint is None else (*where, order[joint])
        return lambda message, accepted: document.error(where, message, accepted)

    time = np.array([_seconds(document, row["time"], start_time) for row in rows], float)
    has = {name: np.array([name in row for row in rows], bool) for name in QUANTITIES}
    values = {name: np.full((len(rows), len(given)), np.nan) for name in QUANTITIES}
    for name, table in values.items():
        for i in np.flatnonzero(has[name]):
            table[i] = _numbers(document, rows[i][name], len(given))
        values[name] = table[:, order]
    return PointTable(joints, time, values, has, place)


class _Entry(NamedTuple):
    """A value of a file for a quantity: key, value and location."""

    key: str
    value: Any
    where: Location


_Row = dict[str, _Entry]
Part = tuple[Mapping[str, Any], Location]


def _inside(document: Document) -> tuple[list[Part], Part]:
    """The mappings around the points, and the mapping of the points, each with its location."""
    data: Any = document.data
    at: Location = ()
    outer: list[Part] = []
    for _ in range(len(WRAPPERS)):
        if not isinstance(data, dict):
            kind = type(data).__name__
            raise document.error(at, f"has a {kind}", "a mapping with joint_names and points")
        if any(name in data for name in _NAMES) or "points" in data:
            break
        held = [key for key in WRAPPERS if isinstance(data.get(key), dict | list)]
        if not held:
            break
        key = held[0]
        if len(held) > 1:
            fault = f"is given together with {key!r}, but only one motion can be checked"
            raise document.error((*at, held[1]), fault, "one")
        _refuse_unknown(document, data, at, WRAPPERS + _UNUSED)
        outer.append((data, at))
        data, at = data[key], (*at, key)
        if isinstance(data, list):
            if len(data) != 1:
                fault = f"has {len(data)} trajectories, but only one motion can be checked"
                raise document.error(at, fault, "one")
            data, at = data[0], (*at, 0)
    rows = ("points",) if "points" in data else (*_ROWS, *_STEPS)
    _refuse_unknown(document, data, at, _NAMES + rows + _UNUSED)
    return outer, (data, at)


def _check_units(document: Document, stated: Any, where: Location) -> None:
    """Refuse units that are stated to be others than s, rad, m and so on: values are in these."""
    if isinstance(stated, Mapping | list):
        pairs = stated.items() if isinstance(stated, Mapping) else enumerate(stated)
        for key, one in pairs:
            _check_units(document, one, (*where, key))
    elif stated is not None and not (isinstance(stated, str) and in_si(stated)):
        raise document.error(where, f"is {stated!r}", "s, rad or m, or these per s or s²")


def _refuse_unknown(
    document: Document, data: Mapping[str, Any], at: Location, known: Sequence[str]
) -> None:
    """Refuse an unknown key, perhaps misspelt, and motions of other joints."""
    for key in data:
        if key not in known:
            raise document.error((*at, key), "unknown key", did_you_mean(key, known))
    for key in _OTHER_MOTIONS:
        other = data.get(key)
        if isinstance(other, dict) and (other.get("points") or other.get("joint_names")):
            fault = "moves joints of several degrees of freedom, which is not supported"
            raise document.error((*at, key), fault, "a file without it, or with an empty one")


def _names(document: Document, data: Mapping[str, Any], at: Location, joints: Joints) -> list[str]:
    """Joints in the order of the file, each exactly once."""
    key = next((key for key in _NAMES if isinstance(data.get(key), list)), None)
    if key is None:
        raise document.error((*at, "joint_names"), "is missing and must be a list of joint names")
    given, where = data[key], (*at, key)
    accepted = f"each of {', '.join(joints.names)} once, in any order"
    for i, name in enumerate(given):
        if not isinstance(name, str):
            raise document.error((*where, i), f"{name!r} is not a joint name", "text")
        if name in given[:i]:
            raise document.error((*where, i), f"joint {name!r} is given twice", accepted)
        if name not in joints.names:
            raise document.error((*where, i), f"{joints.owner} has no joint {name!r}", accepted)
    for name in joints.names:
        if name not in given:
            raise document.error(where, f"joint {name!r} is missing", accepted)
    return list(given)


def _rows(document: Document, data: Mapping[str, Any], at: Location) -> tuple[list[_Row], Location]:
    """Values for each time, by quantity, and their location."""
    if "points" in data:
        points, where = data["points"], (*at, "points")
        if not isinstance(points, list):
            raise document.error(where, f"is {points!r}", "a list of points")
        rows = []
        for i, point in enumerate(points):
            if not isinstance(point, dict):
                raise document.error((*where, i), f"is {point!r}", "a mapping")
            _refuse_unknown(document, point, (*where, i), _ROWS + UNUSED_IN_POINT)
            rows.append(_given(document, point, (*where, i), "must be given", 0))
        return rows, where
    columns = _given(
        document, _with_times(document, data, at), at, "time and positions, or points", 1
    )
    columns = {name: of._replace(value=_of_batch(of.value)) for name, of in columns.items()}
    time = columns["time"]
    if not isinstance(time.value, list):
        raise document.error(time.where, f"is {time.value!r}", "a list of times in s")
    size = len(time.value)
    for _, column, where in columns.values():
        if not isinstance(column, list) or len(column) != size:
            found = len(column) if isinstance(column, list) else "no"
            raise document.error(where, f"has {found} rows", f"{size}, as times")
    rows = [
        {name: _Entry(of.key, of.value[i], (*of.where, i)) for name, of in columns.items()}
        for i in range(size)
    ]
    return rows, time.where


def _of_batch(value: Any) -> Any:
    """The rows of a batch of one; any other value unchanged."""
    while isinstance(value, list) and len(value) == 1 and isinstance(value[0], list):
        if not (value[0] and isinstance(value[0][0], list)):
            break
        value = value[0]
    return value


def _with_times(document: Document, data: Mapping[str, Any], at: Location) -> Mapping[str, Any]:
    """The mapping with times from its time step, if it has no times."""
    step = next((key for key in _STEPS if data.get(key) is not None), None)
    if step is None or any(data.get(key) for key in KEYS["time"]):
        return data
    value, where = data[step], (*at, step)
    value = value[0] if isinstance(value, list) and len(value) == 1 else value
    size = _number(document, value, where)
    if not 0.0 < size < np.inf:
        raise document.error(where, f"is {size:g}", "a positive number of seconds")
    rows = _of_batch(next((data[key] for key in KEYS["position"] if data.get(key)), []))
    count = len(rows) if isinstance(rows, list) else 0
    return {**data, "time_from_start": [i * size for i in range(count)]}


def _given(
    document: Document, data: Mapping[str, Any], at: Location, accepted: str, usual: int
) -> _Row:
    """Values of a mapping by quantity; time and positions are required.

    Args:
        document: The document.
        data: The mapping.
        at: Its location.
        accepted: Accepted input, for the error.
        usual: Index among `KEYS["time"]` of the usual key there.
    """
    row: _Row = {}
    for name, keys in KEYS.items():
        found = [key for key in keys if data.get(key) not in (None, [])]
        if len(found) > 1:
            message = f"is given together with {found[0]!r}, which means the same"
            raise document.error((*at, found[1]), message, "one")
        if found:
            row[name] = _Entry(found[0], data[found[0]], (*at, found[0]))
        elif name in ("time", "position"):
            key = keys[usual if name == "time" else 0]
            raise document.error((*at, key), "is missing", accepted)
    return row


def _numbers(document: Document, entry: _Entry, size: int) -> list[float]:
    """A row of numbers, one per joint."""
    values, where = entry.value, entry.where
    if not isinstance(values, list):
        raise document.error(where, f"is {values!r}", f"a list of {size} numbers")
    if len(values) != size:
        raise document.error(where, f"has {len(values)} values", f"{size}, as joint names")
    return [_number(document, value, (*where, i)) for i, value in enumerate(values)]


def _number(document: Document, value: Any, where: Location) -> float:
    """One number, perhaps infinite or NaN."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise document.error(where, f"{value!r} is not a number", "a number")
    try:
        return float(value)
    except OverflowError:
        raise document.error(where, "is beyond the range of numbers") from None


def _seconds(document: Document, entry: _Entry, start_time: float) -> float:
    """A time [s] from a number, or from whole seconds and nanoseconds."""
    start = start_time if entry.key == "time_from_start" else 0.0
    if not isinstance(entry.value, dict):
        return start + _number(document, entry.value, entry.where)
    parts = {"sec": 0, "nanosec": 0}
    for field, part in entry.value.items():
        where = (*entry.where, field)
        name = {"secs": "sec", "nsecs": "nanosec", "nsec": "nanosec"}.get(field, field)
        if name not in parts:
            raise document.error(where, "unknown key", "sec and nanosec")
        if isinstance(part, bool) or not isinstance(part, int) or abs(part) > MOST_SECONDS:
            raise document.error(where, f"{part!r} is not a number of {name}")
        if name == "nanosec" and not 0 <= part < NANOSECONDS:
            accepted = f"0 to {NANOSECONDS - 1}; whole seconds are in sec"
            raise document.error(where, f"{part} is out of range", accepted)
        parts[name] = part
    return start + (parts["sec"] * NANOSECONDS + parts["nanosec"]) / NANOSECONDS
