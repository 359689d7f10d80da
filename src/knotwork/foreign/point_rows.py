"""Rows of points in mappings: a mapping for each point, or arrays with a row for each time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from knotwork.documents import Document, Location
from knotwork.errors import did_you_mean
from knotwork.waypoints import FloatArray

NANOSECONDS = 1_000_000_000
MOST_SECONDS = 2**32

KEYS: dict[str, tuple[str, ...]] = {
    "time": ("time_from_start", "time", "times", "t"),
    "position": ("positions", "position", "q"),
    "velocity": ("velocities", "velocity", "qd"),
    "acceleration": ("accelerations", "acceleration", "qdd"),
}
UNUSED_IN_POINT = ("effort", "efforts", "jerk", "jerks")


def refuse_unknown(
    document: Document, data: Mapping[str, Any], at: Location, known: Sequence[str]
) -> None:
    """Refuse keys that mean nothing here.

    Raises:
        DocumentError: There is one; it may be a misspelt one that does mean something.
    """
    for key in data:
        if key not in known:
            raise document.error((*at, key), "unknown key", did_you_mean(key, known))


class Rows(ABC):
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

    @abstractmethod
    def prepare(self) -> None:
        """Find the rows."""

    def key(self, data: Mapping[str, Any], quantity: str, at: Location) -> str | None:
        """Name under which a mapping gives a quantity, if it does."""
        found = [key for key in KEYS[quantity] if data.get(key) is not None]
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
            if name == "nanosec" and not 0 <= part < NANOSECONDS:
                accepted = f"0 to {NANOSECONDS - 1}; whole seconds are in sec"
                raise self.document.error((*where, field), f"{part} is out of range", accepted)
            parts[name] = part
        return start + (parts["sec"] * NANOSECONDS + parts["nanosec"]) / NANOSECONDS

    @abstractmethod
    def location(self, row: int, quantity: str, joint: int | None) -> Location:
        """Where a value stands, or the rows if no quantity is named."""

    @abstractmethod
    def time(self) -> FloatArray:
        """Times [s], shape (n,)."""

    @abstractmethod
    def table(self, quantity: str) -> tuple[FloatArray, Any]:
        """Values of a quantity, shape (n, d), and in which rows it is given, shape (n,)."""


class PointRows(Rows):
    """Points as ROS 2 has them, one mapping for each."""

    def prepare(self) -> None:
        """Find the rows."""
        self.points = self.data["points"]
        where = (*self.at, "points")
        if not isinstance(self.points, list):
            raise self.document.error(where, f"is {self.points!r}", "a list of points")
        known = tuple(key for keys in KEYS.values() for key in keys) + UNUSED_IN_POINT
        for i, point in enumerate(self.points):
            if not isinstance(point, dict):
                raise self.document.error((*where, i), f"is {point!r}", "a mapping")
            refuse_unknown(self.document, point, (*where, i), known)

    def location(self, row: int, quantity: str, joint: int | None) -> Location:
        """Where a value stands, or the rows if no quantity is named."""
        if not quantity:
            return (*self.at, "points")
        at = (*self.at, "points", row)
        key = self.key(self.points[row], quantity, at)
        where: Location = at if key is None else (*at, key)
        return where if joint is None else (*where, joint)

    def time(self) -> FloatArray:
        """Times [s], shape (n,)."""
        times = []
        for i, point in enumerate(self.points):
            at = (*self.at, "points", i)
            key = self.key(point, "time", at)
            if key is None:
                raise self.document.error((*at, "time_from_start"), "is missing")
            times.append(self.seconds(point[key], (*at, key), key))
        return np.array(times)

    def table(self, quantity: str) -> tuple[FloatArray, Any]:
        """Values of a quantity, shape (n, d), and in which rows it is given, shape (n,)."""
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


class Arrays(Rows):
    """Arrays with a row for each time."""

    def prepare(self) -> None:
        """Find the rows."""
        self.keys: dict[str, str] = {}
        for quantity in KEYS:
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
        """Where a value stands, or the rows if no quantity is named."""
        if not quantity:
            return (*self.at, self.keys["time"])
        where = (*self.at, self.keys[quantity], row)
        return where if joint is None else (*where, joint)

    def time(self) -> FloatArray:
        """Times [s], shape (n,)."""
        key = self.keys["time"]
        return np.array(
            [self.seconds(value, (*self.at, key, i), key) for i, value in enumerate(self.data[key])]
        )

    def table(self, quantity: str) -> tuple[FloatArray, Any]:
        """Values of a quantity, shape (n, d), and in which rows it is given, shape (n,)."""
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
