"""Trajectories of other tools as mappings: ROS 2's JointTrajectory, and plain JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.documents import Document, Location
from knotwork.errors import DocumentError, did_you_mean
from knotwork.foreign.table import PointTable, joint_order
from knotwork.waypoints import FloatArray

NANOSECONDS = 1_000_000_000
MOST_SECONDS = 2**32
WRAPPERS = ("goal", "trajectory", "joint_trajectory")
"""Keys that hold a message: of an action goal, of a MoveIt RobotTrajectory."""

_NAMES = ("joint_names", "joints", "names", "name")
_KEYS: dict[str, tuple[str, ...]] = {
    "time": ("time_from_start", "time", "times", "t"),
    "position": ("positions", "position", "q"),
    "velocity": ("velocities", "velocity", "qd"),
    "acceleration": ("accelerations", "acceleration", "qdd"),
}
_RATES = ("position", "velocity", "acceleration")
_UNUSED_IN_POINT = ("effort", "efforts", "jerk", "jerks")
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
    *_UNUSED_IN_POINT,
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
    data, at = _inside(document)
    given, names_at = _names(document, data, at)

    def name_error(index: int | None, message: str, accepted: str) -> DocumentError:
        where = names_at if index is None else (*names_at, index)
        return document.error(where, message, accepted)

    order = joint_order(given, joint_names, name_error)
    reader = _PointRows if "points" in data else _Arrays
    rows = reader(document, data, at, len(given), start_time)
    _check_units(document, data, at, given, order, joint_names, joint_units)

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


def _inside(document: Document) -> tuple[Mapping[str, Any], Location]:
    """The mapping that holds the points, out of what may be around it."""
    data: Any = document.data
    at: Location = ()
    for _ in range(len(WRAPPERS)):
        if not isinstance(data, dict):
            kind = type(data).__name__
            raise document.error(at, f"holds a {kind}", "a mapping with joint_names and points")
        if any(name in data for name in _NAMES) or "points" in data:
            break
        key = next((key for key in WRAPPERS if isinstance(data.get(key), dict)), None)
        if key is None:
            break
        _refuse_unknown(document, data, at, WRAPPERS + _UNUSED)
        data, at = data[key], (*at, key)
    rows = (
        ("points",) if "points" in data else tuple(key for keys in _KEYS.values() for key in keys)
    )
    _refuse_unknown(document, data, at, _NAMES + rows + _UNUSED)
    return data, at


def _refuse_unknown(
    document: Document, data: Mapping[str, Any], at: Location, known: Sequence[str]
) -> None:
    for key in data:
        if key not in known:
            raise document.error((*at, key), "unknown key", did_you_mean(key, known))


def _names(document: Document, data: Mapping[str, Any], at: Location) -> tuple[list[str], Location]:
    key = next((key for key in _NAMES if isinstance(data.get(key), list)), None)
    if key is None:
        raise document.error((*at, "joint_names"), "is missing and must be a list of joint names")
    for i, name in enumerate(data[key]):
        if not isinstance(name, str):
            raise document.error((*at, key, i), f"{name!r} is no joint name", "text")
    return data[key], (*at, key)


def _check_units(
    document: Document,
    data: Mapping[str, Any],
    at: Location,
    given: Sequence[str],
    order: Sequence[int],
    joint_names: Sequence[str],
    joint_units: Sequence[str],
) -> None:
    """Refuse units other than the joints' own: values are taken in rad or m, as in ROS."""
    units = data.get("units")
    stated = units.get("joints") if isinstance(units, dict) else units
    if stated is None:
        return
    where = (*at, "units", "joints") if isinstance(units, dict) else (*at, "units")
    listed = stated if isinstance(stated, list) else [stated] * len(given)
    if len(listed) != len(given):
        raise document.error(where, f"has {len(listed)} entries", f"{len(given)}, as joint names")
    for name, unit, index in zip(joint_names, joint_units, order, strict=True):
        if listed[index] != unit:
            raise document.error(where, f"joint {name!r} is in {listed[index]!r}", f"{unit!r}")


class _Rows:
    """What both shapes share: reading numbers, and saying where they stand."""

    def __init__(
        self,
        document: Document,
        data: Mapping[str, Any],
        at: Location,
        joints: int,
        start_time: float,
    ) -> None:
        self.document, self.data, self.at, self.joints = document, data, at, joints
        self.start_time = start_time
        self.prepare()

    def prepare(self) -> None:
        """Find the rows."""

    def key(self, data: Mapping[str, Any], quantity: str, at: Location) -> str | None:
        """Name under which a mapping gives a quantity, if it does."""
        found = [key for key in _KEYS[quantity] if data.get(key) is not None]
        if len(found) > 1:
            raise self.document.error(
                (*at, found[1]), f"is given beside {found[0]!r}, which means the same", "one"
            )
        return found[0] if found else None

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

    def seconds(self, value: Any, where: Location, key: str) -> float:
        """A time [s] from a number or from whole seconds and nanoseconds."""
        start = self.start_time if key == "time_from_start" else 0.0
        if not isinstance(value, dict):
            return start + self.number(value, where)
        parts = {"sec": 0, "nanosec": 0}
        for field, part in value.items():
            name = {"secs": "sec", "nsecs": "nanosec", "nsec": "nanosec"}.get(field, field)
            if name not in parts:
                raise self.document.error((*where, field), "unknown key", "sec and nanosec")
            if isinstance(part, bool) or not isinstance(part, int) or abs(part) > MOST_SECONDS:
                raise self.document.error((*where, field), f"{part!r} is no number of {name}")
            parts[name] = part
        return start + (parts["sec"] * NANOSECONDS + parts["nanosec"]) / NANOSECONDS

    def location(self, row: int, quantity: str, joint: int | None) -> Location:
        """Where a value stands, or the rows if no quantity is named."""
        raise NotImplementedError

    def time(self) -> FloatArray:
        """Times [s], shape (n,)."""
        raise NotImplementedError

    def table(self, quantity: str) -> tuple[FloatArray, Any]:
        """Values of a quantity, shape (n, d), and in which rows it is given, shape (n,)."""
        raise NotImplementedError


class _PointRows(_Rows):
    """Points as ROS 2 has them, one mapping for each."""

    def prepare(self) -> None:
        self.points = self.data["points"]
        where = (*self.at, "points")
        if not isinstance(self.points, list):
            raise self.document.error(where, f"is {self.points!r}", "a list of points")
        known = tuple(key for keys in _KEYS.values() for key in keys) + _UNUSED_IN_POINT
        for i, point in enumerate(self.points):
            if not isinstance(point, dict):
                raise self.document.error((*where, i), f"is {point!r}", "a mapping")
            _refuse_unknown(self.document, point, (*where, i), known)

    def location(self, row: int, quantity: str, joint: int | None) -> Location:
        if not quantity:
            return (*self.at, "points")
        at = (*self.at, "points", row)
        key = self.key(self.points[row], quantity, at)
        where: Location = at if key is None else (*at, key)
        return where if joint is None else (*where, joint)

    def time(self) -> FloatArray:
        times = []
        for i, point in enumerate(self.points):
            at = (*self.at, "points", i)
            key = self.key(point, "time", at)
            if key is None:
                raise self.document.error((*at, "time_from_start"), "is missing")
            times.append(self.seconds(point[key], (*at, key), key))
        return np.array(times)

    def table(self, quantity: str) -> tuple[FloatArray, Any]:
        values = np.full((len(self.points), self.joints), np.nan)
        given = np.zeros(len(self.points), dtype=bool)
        for i, point in enumerate(self.points):
            at = (*self.at, "points", i)
            key = self.key(point, quantity, at)
            if key is not None and point[key] != []:
                values[i] = self.numbers(point[key], (*at, key))
                given[i] = True
            elif quantity == "position":
                raise self.document.error((*at, "positions"), "is missing and must be given")
        return values, given


class _Arrays(_Rows):
    """Arrays with a row for each time."""

    def prepare(self) -> None:
        self.keys: dict[str, str] = {}
        for quantity in _KEYS:
            key = self.key(self.data, quantity, self.at)
            if key is not None:
                self.keys[quantity] = key
        for quantity, name in (("time", "time"), ("position", "positions")):
            if quantity not in self.keys:
                raise self.document.error(
                    (*self.at, name), "is missing", "time and positions, or points"
                )
        key = self.keys["time"]
        rows = self.data[key]
        if not isinstance(rows, list):
            raise self.document.error((*self.at, key), f"is {rows!r}", "a list of times in s")
        self.count = len(rows)

    def location(self, row: int, quantity: str, joint: int | None) -> Location:
        if not quantity:
            return (*self.at, self.keys["time"])
        where = (*self.at, self.keys[quantity], row)
        return where if joint is None else (*where, joint)

    def time(self) -> FloatArray:
        key = self.keys["time"]
        return np.array(
            [self.seconds(value, (*self.at, key, i), key) for i, value in enumerate(self.data[key])]
        )

    def table(self, quantity: str) -> tuple[FloatArray, Any]:
        if quantity not in self.keys:
            empty = np.full((self.count, self.joints), np.nan)
            return empty, np.zeros(self.count, dtype=bool)
        key = self.keys[quantity]
        rows, where = self.data[key], (*self.at, key)
        if not isinstance(rows, list) or len(rows) != self.count:
            size = len(rows) if isinstance(rows, list) else "no"
            raise self.document.error(where, f"has {size} rows", f"{self.count}, as times")
        values = [self.numbers(row, (*where, i)) for i, row in enumerate(rows)]
        return np.array(values).reshape(self.count, self.joints), np.ones(self.count, dtype=bool)
