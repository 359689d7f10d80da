"""Durations, speeds and knots that a task leaves free, to be chosen, and the objective."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.files.documents import Location, Locations
from knotwork.task import AtMost, ClearWay, ExpandedTask, Fastest, PathWaypoint, Weights

SpeedKind = Literal["given", "along", "free"]


@dataclass(frozen=True, eq=False)
class FreeValues:
    """The values that a task leaves free, in SI, by index of the scenario's waypoint.

    Attributes:
        duration_is_free: Whether the time from each waypoint to the next is free, shape (n - 1,).
        min_durations: Lower bounds of these times [s], shape (n - 1,).
        speed_kinds: For each waypoint `"given"`; `"along"` for a given direction of the velocity
            with a free speed; or `"free"` for a free velocity.
        max_speeds: Upper bounds of the tool speed [m/s], shape (n,), infinite without one.
        path_speed_is_free: Whether the constant speed along a path is free between each waypoint
            and the next, shape (n - 1,).
        way_options: Options of collision-free motions, by the waypoint where they end.
        objective: Weights of `"time"`, `"jerk"`, `"effort"` and `"acceleration"`.
        total_duration: Given duration of the whole motion [s], or `None`.
        knots_are_free: Whether knots are free where times are given.
        time_dependent: Indices of waypoints that depend on times still to be chosen: their pose is
            in a moving frame, or their time counts from 0 after a chosen time.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> scenario = kw.load_scenario({"limits": {"acceleration": 2}, "waypoints": ends})
    >>> scenario.free_values.duration_is_free
    array([ True])
    """

    duration_is_free: BoolArray
    min_durations: FloatArray
    speed_kinds: tuple[SpeedKind, ...]
    max_speeds: FloatArray
    path_speed_is_free: BoolArray
    way_options: Mapping[int, ClearWay] = field(default_factory=dict)
    objective: Mapping[str, float] = field(default_factory=dict)
    total_duration: float | None = None
    knots_are_free: bool = False
    time_dependent: tuple[int, ...] = ()

    @property
    def any(self) -> bool:
        """Whether any value is free."""
        return bool(
            self.duration_is_free.any()
            or set(self.speed_kinds) != {"given"}
            or self.path_speed_is_free.any()
            or self.way_options
            or self.knots_are_free
        )

    @property
    def duration_is_chosen(self) -> BoolArray:
        """Whether each duration is chosen, itself or by the speed of a path, shape (n - 1,)."""
        return np.asarray(self.duration_is_free | self.path_speed_is_free)

    @property
    def first_chosen_time(self) -> int:
        """The first waypoint whose time is chosen; n without one."""
        return int(np.append(self.duration_is_chosen, True).argmax()) + 1

    @property
    def speed_is_chosen(self) -> BoolArray:
        """Whether each interval has free values inside or at one end, shape (n - 1,).

        The scenario alone does not define the joint speeds there.
        """
        at_ends = np.array([kind != "given" for kind in self.speed_kinds])
        return np.asarray(self.duration_is_free | at_ends[1:] | at_ends[:-1])


def ends_wait(task_index: Sequence[int], waypoint: int) -> bool:
    """Whether a waypoint of a scenario is the end of a wait: the second of its two waypoints.

    Args:
        task_index: Index in the task of each waypoint of the scenario.
        waypoint: Index in the scenario.
    """
    return waypoint > 0 and task_index[waypoint] == task_index[waypoint - 1]


def min_duration(task: ExpandedTask, i: int) -> float | None:
    """Lower bound of a free time to a waypoint [s], 0 without one; `None` for a given time."""
    waypoint = task.waypoints[i]
    if isinstance(waypoint, PathWaypoint):
        return None
    if isinstance(waypoint.after, Fastest):
        return waypoint.after.at_least or 0.0
    first = i == 0 and task.start is None
    unstated = waypoint.after is None and waypoint.time is None and not first
    left_free = task.times is not None or clear_way(task, i) is not None
    return 0.0 if waypoint.after == "fastest" or (unstated and left_free) else None


def clear_way(task: ExpandedTask, i: int) -> ClearWay | None:
    """Options of a collision-free motion to a waypoint, or `None`; in SI as the task is."""
    waypoint = task.waypoints[i]
    if isinstance(waypoint, PathWaypoint) or (i == 0 and task.start is None):
        return None
    given = waypoint.way or task.ways
    return ClearWay.model_construct(clear=True) if given == "clear" else given


def max_speed(speed: float | str | AtMost | None) -> float | None:
    """Upper bound of a free speed, infinite without one; `None` for a given speed."""
    if isinstance(speed, AtMost):
        return speed.at_most
    return math.inf if isinstance(speed, str) else None


def read_free_values(
    task: ExpandedTask, locations: Locations, task_index: Sequence[int]
) -> FreeValues | None:
    """Read the values that a task leaves free, or `None` without any.

    Args:
        task: The task, in SI.
        locations: Locations of its parts in the file, for errors.
        task_index: Index in the task of each waypoint of the scenario; -1 for the start.

    Raises:
        DocumentError: A key is about free values although none is free, or a value can't be free.
    """
    n = len(task_index)
    duration_is_free, path_speed_is_free = np.zeros((2, n - 1), dtype=bool)
    min_durations = np.zeros(n - 1)
    speed_kinds: list[SpeedKind] = ["given"] * n
    max_speeds = np.full(n, np.inf)
    way_options: dict[int, ClearWay] = {}
    time_dependent: list[int] = []
    for waypoint, i in enumerate(task_index):
        if i < 0 or ends_wait(task_index, waypoint):  # i < 0 is the start
            continue
        step, minimum, way = task.waypoints[i], min_duration(task, i), clear_way(task, i)
        if waypoint and minimum is not None:
            duration_is_free[waypoint - 1], min_durations[waypoint - 1] = True, minimum
        maximum = max_speed(getattr(step, "speed", None))
        if isinstance(step, PathWaypoint) and maximum is not None:
            path_speed_is_free[waypoint - 1] = True
        elif maximum is not None:
            speed_kinds[waypoint], max_speeds[waypoint] = "along", maximum
        elif getattr(step, "velocity", None) == "free":
            speed_kinds[waypoint] = "free"
        if way is not None:
            way_options[waypoint] = way
        if step.time is not None and (duration_is_free | path_speed_is_free).any():
            time_dependent.append(waypoint)  # the time since the waypoint before is free
            duration_is_free[waypoint - 1] = True
    has_free_times = bool(duration_is_free.any())
    knots_are_given = "knots" in task.model_fields_set
    free = FreeValues(
        duration_is_free=duration_is_free,
        min_durations=min_durations,
        speed_kinds=tuple(speed_kinds),
        max_speeds=max_speeds,
        path_speed_is_free=path_speed_is_free,
        way_options=way_options,
        objective=_objective(task, has_free_times=has_free_times),
        total_duration=task.duration,
        knots_are_free=task.knots == "optimal" or (has_free_times and not knots_are_given),
        time_dependent=tuple(time_dependent),
    )
    for location, message, accepted in _misused(task, free, task_index):
        raise locations.error(location, message, accepted)
    return free if free.any else None


def _objective(task: ExpandedTask, *, has_free_times: bool) -> dict[str, float]:
    given = task.objective
    if isinstance(given, Weights):
        return {name: value for name, value in given if value}
    if given is not None:
        return {given: 1.0}
    return {"time": 1.0} if has_free_times and task.duration is None else {"jerk": 1.0}


def check_free_values(task: ExpandedTask, locations: Locations) -> None:
    """Refuse times after free ones, free velocities at the ends and free times of paths.

    Raises:
        DocumentError: One of these is given.
    """
    is_free = False
    for i in range(len(task.waypoints)):
        for key, message, accepted in _misplaced(task, i, after_free=is_free):
            raise locations.error(("waypoints", i, key), message, accepted)
        is_free |= time_is_free(task, i)


def time_is_free(task: ExpandedTask, i: int) -> bool:
    """Whether the time from the waypoint before waypoint i is free, itself or by a speed."""
    waypoint = task.waypoints[i]
    by_speed = isinstance(waypoint, PathWaypoint) and max_speed(waypoint.speed) is not None
    return by_speed or min_duration(task, i) is not None


def _misplaced(task: ExpandedTask, i: int, *, after_free: bool) -> Iterator[tuple[str, str, str]]:
    """Misplaced keys of a waypoint: the key, its fault and the accepted keys.

    Args:
        task: The task, in SI.
        i: Index of the waypoint.
        after_free: Whether an earlier time is free.
    """
    waypoint, at_start = task.waypoints[i], i == 0 and task.start is None
    fastest = isinstance(waypoint.after, str | Fastest)
    if at_start and fastest:
        message = "the first waypoint has no previous one, so no time to it can be chosen"
        yield "after", message, "no time here, or start: the start of the motion"
    if at_start and waypoint.way is not None:
        message = "the first waypoint has no previous one, so there is no motion to it"
        yield "way", message, "way at a later waypoint, or start: the start of the motion"
    if getattr(waypoint, "velocity", None) == "free" and (at_start or i == len(task.waypoints) - 1):
        message = "the velocity is free at an end of the motion"
        yield "velocity", message, "a velocity, or none: the arm is at rest there"
    if not isinstance(waypoint, PathWaypoint):
        return
    if waypoint.time is not None and after_free:
        message = "the time since 0 can't be given, because an earlier time is chosen"
        yield "time", message, "speed, or after: the time since the previous waypoint [s]"
    if waypoint.way is not None:
        yield "way", "the motion to here follows a tool path", "way at a waypoint without along"
    if fastest:
        message = "the time along a path follows from its speed"
        yield "after", message, "speed: fastest, or seconds"


def _misused(
    task: ExpandedTask, free: FreeValues, task_index: Sequence[int]
) -> Iterator[tuple[Location, str, str]]:
    """Keys about free values although none is free, and free values that exclude each other."""
    timed, objective = bool(free.duration_is_free.any()), task.objective is not None
    has_free_times = int(free.duration_is_free.sum()) > len(free.time_dependent)
    weighs_time = free.objective.get("time", 0.0) > 0.0
    if task.duration is not None and not has_free_times:
        accepted = "times: fastest, or after: fastest at a waypoint"
        yield ("duration",), "is given, but so is every time", accepted
    if objective and not (
        has_free_times or free.knots_are_free or set(free.speed_kinds) - {"given"}
    ):
        accepted = "times: fastest, after: fastest at a waypoint, or knots: optimal"
        yield ("objective",), "gives an objective, but no time is free", accepted
    if objective and weighs_time and (not has_free_times or task.duration is not None):
        message = "the time is given, so it can't be minimised"
        yield ("objective",), message, "jerk, effort or acceleration"
    if timed and task.duration is None and not weighs_time:
        message = "gives no weight to the time, so the slowest motion would be optimal"
        accepted = "time as well, for example {time: 1, effort: 0.01}, or duration: seconds"
        yield ("objective",), message, accepted
    if task.chosen is not None and free.any:
        message = "gives the motion between waypoints, but times or speeds are free"
        yield ("chosen",), message, "numbers for all of them; leave out chosen"
    if isinstance(task.knots, tuple) and free.any:
        yield ("knots",), "knot times are given, but waypoint times are free", "leave out knots"
    if task.planner != "modified-hermite" and free.any:
        accepted = "modified-hermite; plan --freeze writes a scenario with numbers for any planner"
        yield ("planner",), f"{task.planner!r} needs given times, and some are free", accepted
    if free.objective.get("effort", 0.0) > 0.0 and task.robot is None:
        yield ("objective",), "effort needs a robot, and the file names none", ""
    if free.time_dependent and task.duration is not None:
        number = task_index[free.time_dependent[0]] + 1
        message = f"is given together with the time at waypoint {number}, after chosen ones"
        yield ("duration",), message, "one of them"
