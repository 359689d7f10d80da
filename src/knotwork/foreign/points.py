"""Trajectories of other tools as mappings: ROS 2's JointTrajectory, and plain JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.documents import Document, Location
from knotwork.errors import DocumentError, did_you_mean
from knotwork.foreign.point_units import KEYS, UNUSED_IN_POINT, check_units
from knotwork.foreign.table import QUANTITIES, PointTable, joint_order

NANOSECONDS = 1_000_000_000
MOST_SECONDS = 2**32

WRAPPERS = ("goal", "trajectory", "joint_trajectory")
"""Keys that hold a message: of an action goal, of a MoveIt RobotTrajectory."""

_NAMES = ("joint_names", "joints", "names", "name")
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
        start_time: What is added to times named `time_from_start` [s].
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
    message = "points" in data
    cells = (_cells_of_message if message else _cells_of_arrays)(document, data, at)
    units = [(given[i], joint_units[order.index(i)]) for i in range(len(given))]
    for part, where in (*outer, (data, at)):
        check_units(document, part, where, units)

    def place(row: int, quantity: str, joint: int | None) -> Callable[[str, str], DocumentError]:
        cell = cells[quantity][row] if quantity else None
        where = (*at, "points" if message else _key(document, data, "time", at) or "")
        if cell is not None:
            where = cell.where if joint is None else (*cell.where, order[joint])
        return lambda message, accepted: document.error(where, message, accepted)

    reader = _Reader(document, len(given), start_time)
    time = np.array([reader.seconds(cell) for cell in cells["time"] if cell is not None])
    values = {quantity: reader.table(cells[quantity])[:, order] for quantity in QUANTITIES}
    has = {name: np.array([cell is not None for cell in cells[name]], bool) for name in values}
    return PointTable(tuple(joint_names), tuple(joint_units), time, values, has, place)


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
        _refuse_unknown(document, data, at, WRAPPERS + _UNUSED)
        outer.append((data, at))
        data, at = data[key], (*at, key)
    rows = ("points",) if "points" in data else _ROWS
    _refuse_unknown(document, data, at, _NAMES + rows + _UNUSED)
    return outer, (data, at)


def _refuse_unknown(
    document: Document, data: Mapping[str, Any], at: Location, known: Sequence[str]
) -> None:
    """Refuse an unknown key: it may be a known one, misspelt."""
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


@dataclass(frozen=True)
class _Cell:
    """One quantity in one row of a file: the value, its key and its place."""

    value: Any
    key: str
    where: Location


_Cells = dict[str, list[_Cell | None]]
"""The rows of each quantity, `None` where a row lacks it."""


def _cells_of_message(document: Document, data: Mapping[str, Any], at: Location) -> _Cells:
    """Rows of points as ROS 2 has them, one mapping for each."""
    points, where = data["points"], (*at, "points")
    if not isinstance(points, list):
        raise document.error(where, f"is {points!r}", "a list of points")
    cells: _Cells = {quantity: [] for quantity in KEYS}
    for i, point in enumerate(points):
        if not isinstance(point, dict):
            raise document.error((*where, i), f"is {point!r}", "a mapping")
        _refuse_unknown(document, point, (*where, i), _ROWS + UNUSED_IN_POINT)
        for quantity, rows in cells.items():
            key = _key(document, point, quantity, (*where, i))
            lacks = key is None or (point[key] == [] and quantity != "time")
            rows.append(None if lacks else _Cell(point[key], key or "", (*where, i, key or "")))
        if cells["time"][i] is None:
            raise document.error((*where, i, "time_from_start"), "is missing")
        if cells["position"][i] is None:
            raise document.error((*where, i, "positions"), "is missing and must be given")
    return cells


def _cells_of_arrays(document: Document, data: Mapping[str, Any], at: Location) -> _Cells:
    """Rows of arrays, each array with a row for each time."""
    cells: _Cells = {}
    for quantity, names in KEYS.items():
        key = _key(document, data, quantity, at)
        if key is None:
            if quantity in ("time", "position"):
                name = names[1] if quantity == "time" else names[0]
                raise document.error((*at, name), "is missing", "time and positions, or points")
            cells[quantity] = [None] * len(cells["time"])
            continue
        rows, where = data[key], (*at, key)
        if quantity == "time":
            if not isinstance(rows, list):
                raise document.error(where, f"is {rows!r}", "a list of times in s")
        elif not isinstance(rows, list) or len(rows) != len(cells["time"]):
            size = len(rows) if isinstance(rows, list) else "no"
            raise document.error(where, f"has {size} rows", f"{len(cells['time'])}, as times")
        cells[quantity] = [_Cell(value, key, (*where, i)) for i, value in enumerate(rows)]
    return cells


def _key(document: Document, data: Mapping[str, Any], quantity: str, at: Location) -> str | None:
    """Name under which a mapping gives a quantity, if it does."""
    found = [key for key in KEYS[quantity] if data.get(key) is not None]
    if len(found) > 1:
        message = f"is given beside {found[0]!r}, which means the same"
        raise document.error((*at, found[1]), message, "one")
    return found[0] if found else None


class _Reader:
    """Reads numbers, and says where those are that are none."""

    def __init__(self, document: Document, joints: int, start_time: float) -> None:
        self.document, self.joints, self.start_time = document, joints, start_time

    def table(self, cells: list[_Cell | None]) -> Any:
        """Values of all joints, shape (n, d), NaN in the rows that lack them."""
        values = np.full((len(cells), self.joints), np.nan)
        for i, cell in enumerate(cells):
            if cell is not None:
                values[i] = self.numbers(cell)
        return values

    def numbers(self, cell: _Cell) -> list[float]:
        """A row of numbers, one a joint."""
        values, where = cell.value, cell.where
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

    def seconds(self, cell: _Cell) -> float:
        """A time [s] from a number or from whole seconds and nanoseconds."""
        start = self.start_time if cell.key == "time_from_start" else 0.0
        if not isinstance(cell.value, dict):
            return start + self.number(cell.value, cell.where)
        parts = {"sec": 0, "nanosec": 0}
        for field, part in cell.value.items():
            where = (*cell.where, field)
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
