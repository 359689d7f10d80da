"""Durations, speeds and knots that a task leaves free, to be chosen, and the objective."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from knotwork.files.documents import Location, Locations
from knotwork.task import AtMost, ClearWay, ExpandedTask, Fastest, PathWaypoint, Weights


@dataclass(frozen=True)
class FreeWaypoint:
    """Free values at a waypoint and on the way to it from the one before, in SI.

    Attributes:
        duration_is_free: Whether the time since the waypoint before is free.
        min_duration: Its lower bound [s].
        path_speed_is_free: Whether the constant speed along the path to it is free.
        way: Options of a collision-free motion to it, or `None`.
        speed_kind: `"given"`; `"direction"` if the velocity has a given direction and a free speed;
            or `"free"` for a free velocity.
        max_speed: Upper bound of a free speed [m/s], infinite without one.
    """

    duration_is_free: bool = False
    min_duration: float = 0.0
    path_speed_is_free: bool = False
    way: ClearWay | None = None
    speed_kind: Literal["given", "direction", "free"] = "given"
    max_speed: float = math.inf

    @property
    def duration_is_unknown(self) -> bool:
        """Whether the time since the waypoint before is free, itself or by the speed of a path."""
        return self.duration_is_free or self.path_speed_is_free


@dataclass(frozen=True, eq=False)
class FreeValues:
    """The values that a task leaves free, in SI.

    Attributes:
        waypoints: Free values at each waypoint of the scenario and on the way to it.
        objective: Weights of the terms that are minimised.
        total_duration: Given duration of the whole motion [s], or `None`.
        knots_are_free: Whether knots are free where times are given.
        time_dependent: Indices of waypoints that depend on times still to be chosen: their pose is
            in a moving frame, or their time counts from 0 after a chosen time.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> scenario = kw.load_scenario({"limits": {"acceleration": 2}, "waypoints": ends})
    >>> scenario.free_values.waypoints[1].duration_is_free
    True
    """

    waypoints: tuple[FreeWaypoint, ...]
    objective: Weights
    total_duration: float | None = None
    knots_are_free: bool = False
    time_dependent: tuple[int, ...] = ()

    @property
    def has_any(self) -> bool:
        """Whether any value is free."""
        return self.knots_are_free or any(free != FreeWaypoint() for free in self.waypoints)

    @property
    def has_free_durations(self) -> bool:
        """Whether the time between any waypoints is free itself."""
        return any(free.duration_is_free for free in self.waypoints)

    @property
    def first_unknown_time(self) -> int:
        """The first waypoint whose time is unknown; n without one."""
        return [*(free.duration_is_unknown for free in self.waypoints), True].index(True)


def ends_wait(task_index: Sequence[int], i: int) -> bool:
    """Whether waypoint i of a scenario is the end of a wait: the second of its two waypoints.

    Args:
        task_index: Index in the task of each waypoint of the scenario.
        i: Index in the scenario.
    """
    return i > 0 and task_index[i] == task_index[i - 1]


def read_free_waypoint(task: ExpandedTask, i: int) -> FreeWaypoint:
    """Read the free values at waypoint i of a task, in SI, and on the way to it."""
    waypoint = task.waypoints[i]
    speed = getattr(waypoint, "speed", None)
    speed_is_free = isinstance(speed, str | AtMost)
    max_speed = speed.at_most if isinstance(speed, AtMost) else math.inf
    if isinstance(waypoint, PathWaypoint):
        return FreeWaypoint(path_speed_is_free=speed_is_free, max_speed=max_speed)
    kind: Literal["given", "direction", "free"] = "direction" if speed_is_free else "given"
    if getattr(waypoint, "velocity", None) == "free":
        kind = "free"
    is_first = i == 0 and task.start is None
    way = None if is_first else waypoint.way or task.ways
    if way == "clear":
        way = ClearWay.model_construct(clear=True)
    after = waypoint.after
    duration_is_free = isinstance(after, str | Fastest)
    if after is None and waypoint.time is None and not is_first:
        duration_is_free = task.times is not None or way is not None
    return FreeWaypoint(
        duration_is_free=duration_is_free,
        min_duration=after.at_least or 0.0 if isinstance(after, Fastest) else 0.0,
        way=way,
        speed_kind=kind,
        max_speed=max_speed,
    )


def read_free_values(
    task: ExpandedTask,
    free_in_task: Sequence[FreeWaypoint],
    locations: Locations,
    task_index: Sequence[int],
) -> FreeValues | None:
    """Read the values that a task leaves free, or `None` without any.

    Args:
        task: The task, in SI.
        free_in_task: Free values at each of its waypoints.
        locations: Locations of its parts in the file, for errors.
        task_index: Index in the task of each waypoint of the scenario; -1 for the start.

    Raises:
        DocumentError: A key is about free values although none is free, or a value can't be free.
    """
    waypoints: list[FreeWaypoint] = []
    time_dependent: list[int] = []
    for i, task_i in enumerate(task_index):
        free = FreeWaypoint()
        if task_i >= 0 and not ends_wait(task_index, i):  # otherwise the start, or after a wait
            free = free_in_task[task_i]
            is_unknown = any(before.duration_is_unknown for before in waypoints)
            if task.waypoints[task_i].time is not None and is_unknown:
                time_dependent.append(i)
                free = replace(free, duration_is_free=True)
        waypoints.append(free)
    has_free_times = any(free.duration_is_free for free in waypoints)
    knots_are_given = "knots" in task.model_fields_set
    values = FreeValues(
        waypoints=tuple(waypoints),
        objective=_objective(task, has_free_times=has_free_times),
        total_duration=task.duration,
        knots_are_free=task.knots == "optimal" or (has_free_times and not knots_are_given),
        time_dependent=tuple(time_dependent),
    )
    for location, message, accepted in _misused(task, values, task_index):
        raise locations.error(location, message, accepted)
    return values if values.has_any else None


def _objective(task: ExpandedTask, *, has_free_times: bool) -> Weights:
    given = task.objective
    if isinstance(given, Weights):
        return given
    duration_is_free = has_free_times and task.duration is None
    return Weights(**{given or ("time" if duration_is_free else "jerk"): 1.0})


def check_free_values(
    task: ExpandedTask, free_in_task: Sequence[FreeWaypoint], locations: Locations
) -> None:
    """Refuse times after free ones, free velocities at the ends and free times of paths.

    Args:
        task: The task, in SI.
        free_in_task: Free values at each of its waypoints.
        locations: Locations of its parts in the file, for errors.

    Raises:
        DocumentError: One of these is given.
    """
    after_free = False
    for i, free in enumerate(free_in_task):
        for key, message, accepted in _misplaced(task, i, after_free=after_free):
            raise locations.error(("waypoints", i, key), message, accepted)
        after_free |= free.duration_is_unknown


def _misplaced(task: ExpandedTask, i: int, *, after_free: bool) -> Iterator[tuple[str, str, str]]:
    """Misplaced keys of a waypoint: the key, its fault and the accepted keys.

    Args:
        task: The task, in SI.
        i: Index of the waypoint.
        after_free: Whether an earlier time is free.
    """
    waypoint = task.waypoints[i]
    at_start = i == 0 and task.start is None
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
    task: ExpandedTask, free_values: FreeValues, task_index: Sequence[int]
) -> Iterator[tuple[Location, str, str]]:
    """Keys about free values although none is free, and free values that exclude each other."""
    free_times = sum(waypoint.duration_is_free for waypoint in free_values.waypoints)
    has_free_times = free_times > len(free_values.time_dependent)
    has_free_speeds = any(waypoint.speed_kind != "given" for waypoint in free_values.waypoints)
    has_objective = task.objective is not None
    weighs_time = free_values.objective.time > 0.0
    if task.duration is not None and not has_free_times:
        accepted = "times: fastest, or after: fastest at a waypoint"
        yield ("duration",), "is given, but so is every time", accepted
    if has_objective and not (has_free_times or free_values.knots_are_free or has_free_speeds):
        accepted = "times: fastest, after: fastest at a waypoint, or knots: optimal"
        yield ("objective",), "gives an objective, but no time is free", accepted
    if has_objective and weighs_time and (not has_free_times or task.duration is not None):
        message = "the time is given, so it can't be minimised"
        yield ("objective",), message, "jerk, effort or acceleration"
    if free_values.has_free_durations and task.duration is None and not weighs_time:
        message = "gives no weight to the time, so the slowest motion would be optimal"
        accepted = "time as well, for example {time: 1, effort: 0.01}, or duration: seconds"
        yield ("objective",), message, accepted
    if task.chosen is not None and free_values.has_any:
        message = "gives the motion between waypoints, but times or speeds are free"
        yield ("chosen",), message, "numbers for all of them; leave out chosen"
    if isinstance(task.knots, tuple) and free_values.has_any:
        yield ("knots",), "knot times are given, but waypoint times are free", "leave out knots"
    if task.planner != "modified-hermite" and free_values.has_any:
        accepted = "modified-hermite; its plan.freeze (--freeze) writes numbers for any planner"
        yield ("planner",), f"{task.planner!r} needs given times, and some are free", accepted
    if free_values.objective.effort > 0.0 and task.robot is None:
        yield ("objective",), "effort needs a robot, and the file names none", ""
    if free_values.time_dependent and task.duration is not None:
        number = task_index[free_values.time_dependent[0]] + 1
        message = f"is given together with the time at waypoint {number}, after chosen ones"
        yield ("duration",), message, "one of them"
