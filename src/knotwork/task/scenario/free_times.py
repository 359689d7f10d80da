"""`FreeTimes`: the unknowns of a scenario: durations, speeds and the objective."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from knotwork.task import ClearWay
from knotwork.waypoints import FloatArray

BoolArray = NDArray[np.bool_]

PROVISIONAL_TIME = 1.0
"""Provisional duration of an interval whose time is free [s]."""

PROVISIONAL_SPEED = 0.01
"""Provisional speed along a path whose speed is free [m/s]."""

SpeedKind = Literal["given", "along", "free"]


@dataclass(frozen=True, eq=False)
class FreeTimes:
    """The unknowns of a scenario.

    Attributes:
        duration: Whether the time from each waypoint to the next is chosen, shape (n - 1,).
        at_least: Lower bounds of these times [s], shape (n - 1,).
        speed: For each waypoint `"given"`; `"along"` for a given direction of the velocity
            with a chosen speed; or `"free"` for a chosen velocity.
        at_most: Upper bounds of the tool speed [m/s], shape (n,), infinite without one.
        path_speed: Upper bound [m/s] by the waypoint at the end of each path stretch whose
            constant speed is chosen, infinite without one.
        ways: Options of collision-free motions, by the waypoint where they end.
        objective: Weights of `"time"`, `"jerk"`, `"effort"` and `"acceleration"`.
        total: Given duration of the whole motion [s], or `None`.
        optimal_knots: Whether knots are chosen where times are given.
        meets: Waypoints, by index, whose pose or duration depends on earlier times. They are in
            moving frames, or have a time since 0.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> kw.load_scenario({"limits": {"acceleration": 2}, "waypoints": ends}).free.duration
    array([ True])
    """

    duration: BoolArray
    at_least: FloatArray
    speed: tuple[SpeedKind, ...]
    at_most: FloatArray
    path_speed: Mapping[int, float] = field(default_factory=dict)
    ways: Mapping[int, ClearWay] = field(default_factory=dict)
    objective: Mapping[str, float] = field(default_factory=dict)
    total: float | None = None
    optimal_knots: bool = False
    meets: tuple[int, ...] = ()

    @property
    def anything(self) -> bool:
        """Whether there are unknowns."""
        return bool(
            self.duration.any()
            or set(self.speed) != {"given"}
            or self.path_speed
            or self.ways
            or self.optimal_knots
        )

    @property
    def first_untimed(self) -> int:
        """The first waypoint with an unknown time; n without one."""
        chosen = [*(np.flatnonzero(self.duration) + 1).tolist(), *self.path_speed]
        return min(chosen, default=len(self.speed))

    @property
    def untimed(self) -> BoolArray:
        """Intervals with chosen values inside or at one end, shape (n - 1,).

        The scenario alone does not define the joint speeds there.
        """
        chosen: BoolArray = np.array([kind != "given" for kind in self.speed])
        untimed: BoolArray = self.duration | chosen[1:] | chosen[:-1]
        return untimed
