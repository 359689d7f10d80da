"""Trajectories of other tools as mappings: ROS 2's JointTrajectory, and plain JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from knotwork.documents import Document, Location
from knotwork.errors import DocumentError
from knotwork.foreign.point_rows import (
    KEYS,
    UNUSED_IN_POINT,
    Arrays,
    PointRows,
    refuse_unknown,
)
from knotwork.foreign.point_units import check_units
from knotwork.foreign.table import PointTable, joint_order

WRAPPERS = ("goal", "trajectory", "joint_trajectory")
"""Keys that hold a message: of an action goal, of a MoveIt RobotTrajectory."""

_NAMES = ("joint_names", "joints", "names", "name")
_RATES = ("position", "velocity", "acceleration")
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
    "multi_dof_trajectory",
    "multi_dof_joint_trajectory",
    *UNUSED_IN_POINT,
    "tool_position",
    "tool_quaternion",
    "tool_linear_velocity",
    "tool_angular_velocity",
)


def read_points(
    document: Document,
    joint_names: Sequence[str],
    joint_units: Sequence[str],
    *,
    start_time: float = 0.0,
) -> PointTable:
    """Read points from a mapping.

    Either as ROS 2 has them, `joint_names` and `points` with `positions`, `velocities`,
    `accelerations` and `time_from_start` each (also inside a goal, or a MoveIt robot trajectory);
    or as arrays, `joint_names`, `time`, `positions`, `velocities` and `accelerations`, a row for
    each time.

    Args:
        document: The mapping. Times are in s, or `{sec, nanosec}`.
        joint_names: The joints there are; the file may list them in any order.
        joint_units: `"rad"` or `"m"` for each.
        start_time: What is added to times named `time_from_start` [s].

    Raises:
        DocumentError: Something is missing, unknown, of the wrong shape, or no number; a joint is
            missing or given twice.
    """
    outer, (data, at) = _inside(document)
    given, names_at = _names(document, data, at)

    def name_error(index: int | None, message: str, accepted: str) -> DocumentError:
        where = names_at if index is None else (*names_at, index)
        return document.error(where, message, accepted)

    order = joint_order(given, joint_names, name_error)
    reader = PointRows if "points" in data else Arrays
    rows = reader(document, data, at, len(given), start_time)
    units = [(given[i], joint_units[order.index(i)]) for i in range(len(given))]
    for part, where in (*outer, (data, at)):
        check_units(document, part, where, units)

    def place(row: int, quantity: str, joint: int | None) -> Callable[[str, str], DocumentError]:
        where = rows.location(row, quantity, None if joint is None else order[joint])
        return lambda message, accepted: document.error(where, message, accepted)

    tables = {quantity: rows.table(quantity) for quantity in _RATES}
    return PointTable(
        tuple(joint_names),
        tuple(joint_units),
        rows.time(),
        tables["position"][0][:, order],
        tables["velocity"][0][:, order],
        tables["acceleration"][0][:, order],
        tables["velocity"][1],
        tables["acceleration"][1],
        place,
    )


Part = tuple[Mapping[str, Any], Location]


def _inside(document: Document) -> tuple[list[Part], Part]:
    """The mappings around the one that holds the points, and that one, each with its place."""
    data: Any = document.data
    at: Location = ()
    outer: list[Part] = []
    for _ in range(len(WRAPPERS)):
        if not isinstance(data, dict):
            kind = type(data).__name__
            raise document.error(at, f"holds a {kind}", "a mapping with joint_names and points")
        if any(name in data for name in _NAMES) or "points" in data:
            break
        key = next((key for key in WRAPPERS if isinstance(data.get(key), dict)), None)
        if key is None:
            break
        refuse_unknown(document, data, at, WRAPPERS + _UNUSED)
        outer.append((data, at))
        data, at = data[key], (*at, key)
    rows = ("points",) if "points" in data else tuple(key for keys in KEYS.values() for key in keys)
    refuse_unknown(document, data, at, _NAMES + rows + _UNUSED)
    return outer, (data, at)


def _names(document: Document, data: Mapping[str, Any], at: Location) -> tuple[list[str], Location]:
    key = next((key for key in _NAMES if isinstance(data.get(key), list)), None)
    if key is None:
        raise document.error((*at, "joint_names"), "is missing and must be a list of joint names")
    for i, name in enumerate(data[key]):
        if not isinstance(name, str):
            raise document.error((*at, key, i), f"{name!r} is no joint name", "text")
    return data[key], (*at, key)
