"""`FreeTimes`: what a scenario leaves to be chosen: durations, speeds, and for what."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.waypoints import FloatArray

BoolArray = NDArray[np.bool_]

PROVISIONAL_TIME = 1.0
"""An interval whose time is free lasts so long in the scenario until it is chosen [s]."""

PROVISIONAL_SPEED = 0.01
"""A speed along a path that is free, until it is chosen [m/s]."""

SpeedKind = Literal["given", "along", "free"]


class FreeWay(NamedTuple):
    """A motion that finds its own way.

    Attributes:
        tries: Number of ways that are looked for.
        room: Clearance beyond the margins that it keeps where it can [m].
    """

    tries: int
    room: float


@dataclass(frozen=True, eq=False)
class FreeTimes:
    """What a scenario leaves to be chosen.

    Attributes:
        duration: Whether the time from each waypoint to the next is chosen, shape (n - 1,).
        at_least: The least that it may be [s], shape (n - 1,).
        speed: For each waypoint `"given"`; `"along"`, where the direction of its velocity is given
            and the speed is chosen; or `"free"`, where the velocity is chosen.
        at_most: The greatest speed of the tool there [m/s], shape (n,), infinite without one.
        path_speed: Greatest speed [m/s] by the waypoint at the end of each path stretch whose
            constant speed is chosen, infinite without one.
        ways: What is asked of motions that find their way, by the waypoint where they end.
        objective: Weights of `"time"`, `"jerk"`, `"effort"` and `"acceleration"`.
        total: Duration of the whole motion that is given [s], or `None`.
        optimal_knots: Knots are chosen where times are given, too.
        meets: Waypoints, by index, whose pose or duration is known once times before are: they are
            in frames that move, or have a time since 0.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> kw.load_scenario({"limits": {"acceleration": 2}, "waypoints": ends}).free.duration
    array([ True])
    """

    duration: BoolArray
    at_least: FloatArray
    speed: tuple[SpeedKind, ...]
    at_most: FloatArray
    path_speed: Mapping[int, float] = field(default_factory=dict)
    ways: Mapping[int, FreeWay] = field(default_factory=dict)
    objective: Mapping[str, float] = field(default_factory=dict)
    total: float | None = None
    optimal_knots: bool = False
    meets: tuple[int, ...] = ()

    @property
    def anything(self) -> bool:
        """Whether there is something to choose."""
        return bool(
            self.duration.any()
            or set(self.speed) != {"given"}
            or self.path_speed
            or self.ways
            or self.optimal_knots
        )

    @property
    def first_untimed(self) -> int:
        """The first waypoint whose time is not known until it is chosen; n without one."""
        chosen = [*(np.flatnonzero(self.duration) + 1).tolist(), *self.path_speed]
        return min(chosen, default=len(self.speed))

    @property
    def untimed(self) -> BoolArray:
        """Intervals that are chosen whole or at one end, shape (n - 1,).

        How fast a joint is there does not follow from the scenario.
        """
        chosen: BoolArray = np.array([kind != "given" for kind in self.speed])
        untimed: BoolArray = self.duration | chosen[1:] | chosen[:-1]
        return untimed
