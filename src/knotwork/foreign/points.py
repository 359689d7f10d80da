"""Trajectories of other tools as mappings: ROS 2's JointTrajectory, and plain JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.documents import Document, Location
from knotwork.errors import DocumentError, did_you_mean
from knotwork.foreign.point_units import KEYS, UNUSED_IN_POINT, check_units
from knotwork.foreign.table import QUANTITIES, PointTable, joint_order
from knotwork.waypoints import FloatArray

NANOSECONDS = 1_000_000_000
MOST_SECONDS = 2**32

WRAPPERS = ("goal", "trajectory", "joint_trajectory")
"""Keys that hold a message: of an action goal, of a MoveIt RobotTrajectory."""

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
    *_OTHER_MOTIONS,
    *UNUSED_IN_POINT,
    "tool_position",
    "tool_quaternion",
    "tool_linear_velocity",
    "tool_angular_velocity",
)
_ROWS = tuple(key for keys in KEYS.values() for key in keys)


def read_points(
    document: Document,
    joint_names: Sequence[str],
    joint_units: Sequence[str],
    *,
    start_time: float = 0.0,
    owner: str = "the scenario",
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
        start_time: Added to times named `time_from_start` [s].
        owner: What the joints are of, for errors.

    Raises:
        DocumentError: Something is missing, unknown, of the wrong shape, or no number; a joint is
            missing or given twice.
    """
    outer, (data, at) = _inside(document)
    given, names_at = _names(document, data, at)

    def name_error(index: int | None, message: str, accepted: str) -> DocumentError:
        where = names_at if index is None else (*names_at, index)
        return document.error(where, message, accepted)

    order = joint_order(given, joint_names, name_error, owner)
    units = [(given[i], joint_units[order.index(i)]) for i in range(len(given))]
    rows, rows_at, stands = _rows(document, data, at)
    for part, where in (*outer, (data, at)):
        check_units(document, part, where, units)
    keys = [
        {name: _key(document, row, name, stands(i, "")[:-1]) for name in KEYS}
        for i, row in enumerate(rows)
    ]

    def place(row: int, quantity: str, joint: int | None) -> Callable[[str, str], DocumentError]:
        key = keys[row][quantity] if quantity else None
        where = rows_at if key is None else stands(row, key)
        where = (*where, *([] if joint is None else [order[joint]]))
        return lambda message, accepted: document.error(where, message, accepted)

    time, values = _Reader(document, len(given), start_time).values(rows, keys, stands)
    has = {name: np.array([one[name] is not None for one in keys], bool) for name in values}
    ordered = {name: table[:, order] for name, table in values.items()}
    return PointTable(tuple(joint_names), tuple(joint_units), time, ordered, has, place)


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
        held = [key for key in WRAPPERS if isinstance(data.get(key), dict)]
        if not held:
            break
        key = held[0]
        if len(held) > 1:
            fault = f"is given beside {key!r}, and one motion is checked"
            raise document.error((*at, held[1]), fault, "one")
        _refuse_unknown(document, data, at, WRAPPERS + _UNUSED)
        outer.append((data, at))
        data, at = data[key], (*at, key)
    rows = ("points",) if "points" in data else _ROWS
    _refuse_unknown(document, data, at, _NAMES + rows + _UNUSED)
    return outer, (data, at)


def _refuse_unknown(
    document: Document, data: Mapping[str, Any], at: Location, known: Sequence[str]
) -> None:
    """Refuse an unknown key, which may be a known one, misspelt, and what else is to move."""
    for key in data:
        if key not in known:
            raise document.error((*at, key), "unknown key", did_you_mean(key, known))
    for key in _OTHER_MOTIONS:
        other = data.get(key)
        if isinstance(other, dict) and (other.get("points") or other.get("joint_names")):
            fault = "moves joints of several freedoms as well, which is not checked"
            raise document.error((*at, key), fault, "a file without it, or with an empty one")


def _names(document: Document, data: Mapping[str, Any], at: Location) -> tuple[list[str], Location]:
    key = next((key for key in _NAMES if isinstance(data.get(key), list)), None)
    if key is None:
        raise document.error((*at, "joint_names"), "is missing and must be a list of joint names")
    for i, name in enumerate(data[key]):
        if not isinstance(name, str):
            raise document.error((*at, key, i), f"{name!r} is no joint name", "text")
    return data[key], (*at, key)


def _rows(
    document: Document, data: Mapping[str, Any], at: Location
) -> tuple[list[dict[str, Any]], Location, Callable[[int, str], Location]]:
    """A mapping for each time, where they all stand, and where a key of one stands."""
    if "points" in data:
        points, where = data["points"], (*at, "points")
        if not isinstance(points, list):
            raise document.error(where, f"is {points!r}", "a list of points")
        for i, point in enumerate(points):
            if not isinstance(point, dict):
                raise document.error((*where, i), f"is {point!r}", "a mapping")
            _refuse_unknown(document, point, (*where, i), _ROWS + UNUSED_IN_POINT)
        given = [{key: value for key, value in one.items() if value != []} for one in points]
        return given, where, lambda i, key: (*where, i, key)
    keys = {quantity: _key(document, data, quantity, at) for quantity in KEYS}
    for quantity, name in (("time", "time"), ("position", "positions")):
        if keys[quantity] is None:
            raise document.error((*at, name), "is missing", "time and positions, or points")
    columns = {key: data[key] for key in keys.values() if key is not None}
    time = keys["time"] or ""
    if not isinstance(columns[time], list):
        raise document.error((*at, time), f"is {columns[time]!r}", "a list of times in s")
    size = len(columns[time])
    for key, column in columns.items():
        if not isinstance(column, list) or len(column) != size:
            found = len(column) if isinstance(column, list) else "no"
            raise document.error((*at, key), f"has {found} rows", f"{size}, as times")
    rows = [{key: column[i] for key, column in columns.items()} for i in range(size)]
    return rows, (*at, time), lambda i, key: (*at, key, i)


def _key(document: Document, data: Mapping[str, Any], quantity: str, at: Location) -> str | None:
    """Name under which a mapping gives a quantity, if it does."""
    found = [key for key in KEYS[quantity] if data.get(key) is not None]
    if len(found) > 1:
        message = f"is given together with {found[0]!r}, which means the same"
        raise document.error((*at, found[1]), message, "one")
    return found[0] if found else None


class _Reader:
    """Reads numbers, and says where those are that are none."""

    def __init__(self, document: Document, joints: int, start_time: float) -> None:
        self.document, self.joints, self.start_time = document, joints, start_time

    def numbers(self, values: Any, where: Location) -> list[float]:
        """A row of numbers, one a joint."""
        if not isinstance(values, list):
            raise self.document.error(where, f"is {values!r}", f"a list of {self.joints} numbers")
        if len(values) != self.joints:
            raise self.document.error(
                where, f"has {len(values)} values", f"{self.joints}, as joint names"
            )
        return [self.number(value, (*where, i)) for i, value in enumerate(values)]

    def number(self, value: Any, where: Location) -> float:
        """One number, which may still be infinite or NaN."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.document.error(where, f"{value!r} is no number", "a number")
        try:
            return float(value)
        except OverflowError:
            raise self.document.error(where, "is beyond the range of numbers") from None

    def values(
        self,
        rows: Sequence[Mapping[str, Any]],
        keys: Sequence[Mapping[str, str | None]],
        stands: Callable[[int, str], Location],
    ) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Times [s], shape (n,), and quantities, each (n, d), NaN where a row has none."""
        time = np.empty(len(rows))
        values = {name: np.full((len(rows), self.joints), np.nan) for name in QUANTITIES}
        for i, (row, names) in enumerate(zip(rows, keys, strict=True)):
            for name in ("time", "position"):
                if names[name] is None:
                    where = stands(i, KEYS[name][0])
                    raise self.document.error(where, "is missing and must be given")
            for name, key in names.items():
                if name == "time" and key is not None:
                    time[i] = self.seconds(row[key], key, stands(i, key))
                elif key is not None:
                    values[name][i] = self.numbers(row[key], stands(i, key))
        return time, values

    def seconds(self, value: Any, key: str, at: Location) -> float:
        """A time [s] from a number or from whole seconds and nanoseconds."""
        start = self.start_time if key == "time_from_start" else 0.0
        if not isinstance(value, dict):
            return start + self.number(value, at)
        parts = {"sec": 0, "nanosec": 0}
        for field, part in value.items():
            where = (*at, field)
            name = {"secs": "sec", "nsecs": "nanosec", "nsec": "nanosec"}.get(field, field)
            if name not in parts:
                raise self.document.error(where, "unknown key", "sec and nanosec")
            if isinstance(part, bool) or not isinstance(part, int) or abs(part) > MOST_SECONDS:
                raise self.document.error(where, f"{part!r} is no number of {name}")
            if name == "nanosec" and not 0 <= part < NANOSECONDS:
                accepted = f"0 to {NANOSECONDS - 1}; whole seconds are in sec"
                raise self.document.error(where, f"{part} is out of range", accepted)
            parts[name] = part
        return start + (parts["sec"] * NANOSECONDS + parts["nanosec"]) / NANOSECONDS
