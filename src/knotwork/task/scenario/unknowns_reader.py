"""The unknowns of a task: durations, speeds and knots that planning chooses; the objective."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from knotwork.errors.plain_text import default_waypoint_name, waypoint_text
from knotwork.files.documents import Location, Locations
from knotwork.task import (
    AtMost,
    ClearWay,
    ExpandedTask,
    Fastest,
    JointWaypoint,
    PathWaypoint,
    Weights,
)


@dataclass(frozen=True)
class WaypointUnknowns:
    """The unknowns at a waypoint and on the way to it from the one before, in SI.

    Attributes:
        duration_is_unknown: Whether the time since the waypoint before is an unknown.
        min_duration: Its lower bound [s].
        path_speed_is_unknown: Whether the constant speed along the path to it is one.
        way: Options of a collision-free motion to it, or `None`.
        velocity_kind: `"given"`; `"direction"` if the velocity has a given direction and an unknown
            speed; or `"unknown"` for an unknown velocity.
        max_speed: Upper bound of an unknown speed [m/s], infinite without one.
    """

    duration_is_unknown: bool = False
    min_duration: float = 0.0
    path_speed_is_unknown: bool = False
    way: ClearWay | None = None
    velocity_kind: Literal["given", "direction", "unknown"] = "given"
    max_speed: float = math.inf

    @property
    def duration_is_given(self) -> bool:
        """Whether the time since the waypoint before neither is an unknown nor follows from one."""
        return not (self.duration_is_unknown or self.path_speed_is_unknown)


@dataclass(frozen=True, eq=False)
class ScenarioUnknowns:
    """The values that a task leaves to planning, in SI.

    Attributes:
        at_waypoints: The unknowns at each waypoint of the scenario and on the way to it.
        objective: Weights of the terms that are minimised.
        total_duration: Given duration of the whole motion [s], or `None`.
        knots_are_unknown: Whether knots are chosen where times are given.
        time_dependent: Indices of waypoints that depend on times still to be chosen: their pose is
            in a moving frame, or their time counts from 0 after a chosen time.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> scenario = kw.load_scenario({"limits": {"acceleration": 2}, "waypoints": ends})
    >>> scenario.unknowns.at_waypoints[1].duration_is_unknown
    True
    """

    at_waypoints: tuple[WaypointUnknowns, ...]
    objective: Weights
    total_duration: float | None = None
    knots_are_unknown: bool = False
    time_dependent: tuple[int, ...] = ()

    @property
    def has_any(self) -> bool:
        """Whether any value is unknown."""
        return self.knots_are_unknown or any(at != WaypointUnknowns() for at in self.at_waypoints)

    @property
    def has_unknown_durations(self) -> bool:
        """Whether the time between any waypoints is an unknown."""
        return any(at.duration_is_unknown for at in self.at_waypoints)

    @property
    def first_unknown_time(self) -> int:
        """The first waypoint whose time is not given; n without one."""
        unknown = (i for i, at in enumerate(self.at_waypoints) if not at.duration_is_given)
        return next(unknown, len(self.at_waypoints))


def ends_wait(task_index: Sequence[int], i: int) -> bool:
    """Whether waypoint i of a scenario is the end of a wait: the second of its two waypoints.

    Args:
        task_index: Index in the task of each waypoint of the scenario.
        i: Index in the scenario.
    """
    return i > 0 and task_index[i] == task_index[i - 1]


def read_waypoint_unknowns(task: ExpandedTask, i: int) -> WaypointUnknowns:
    """Read the unknowns at waypoint i of a task, in SI, and on the way to it."""
    waypoint = task.waypoints[i]
    speed = None if isinstance(waypoint, JointWaypoint) else waypoint.speed
    speed_is_unknown = isinstance(speed, str | AtMost)
    max_speed = speed.at_most if isinstance(speed, AtMost) else math.inf
    if isinstance(waypoint, PathWaypoint):
        return WaypointUnknowns(path_speed_is_unknown=speed_is_unknown, max_speed=max_speed)
    kind: Literal["given", "direction", "unknown"] = "direction" if speed_is_unknown else "given"
    if waypoint.velocity == "free":
        kind = "unknown"
    is_first = i == 0 and task.start is None
    way = None if is_first else waypoint.way or task.ways
    if way == "clear":
        way = ClearWay.model_construct(clear=True)
    after = waypoint.after
    duration_is_unknown = isinstance(after, str | Fastest)
    if after is None and waypoint.time is None and not is_first:
        duration_is_unknown = task.times is not None or way is not None
    return WaypointUnknowns(
        duration_is_unknown=duration_is_unknown,
        min_duration=after.at_least or 0.0 if isinstance(after, Fastest) else 0.0,
        way=way,
        velocity_kind=kind,
        max_speed=max_speed,
    )


def read_unknowns(
    task: ExpandedTask,
    unknowns_in_task: Sequence[WaypointUnknowns],
    locations: Locations,
    task_index: Sequence[int],
) -> ScenarioUnknowns | None:
    """Read the values that a task leaves to planning, or `None` without any.

    Args:
        task: The task, in SI.
        unknowns_in_task: The unknowns at each of its waypoints.
        locations: Locations of its parts in the file, for errors.
        task_index: Index in the task of each waypoint of the scenario; -1 for the start.

    Raises:
        DocumentError: A key is about unknowns although there are none, or a value must be given.
    """
    waypoints: list[WaypointUnknowns] = []
    time_dependent: list[int] = []
    for i, task_i in enumerate(task_index):
        unknowns = WaypointUnknowns()
        if task_i >= 0 and not ends_wait(task_index, i):  # otherwise the start, or after a wait
            unknowns = unknowns_in_task[task_i]
            is_unknown = not all(before.duration_is_given for before in waypoints)
            if task.waypoints[task_i].time is not None and is_unknown:
                time_dependent.append(i)
                unknowns = replace(unknowns, duration_is_unknown=True)
        waypoints.append(unknowns)
    has_unknown_times = any(waypoint.duration_is_unknown for waypoint in waypoints)
    knots_are_given = "knots" in task.model_fields_set
    values = ScenarioUnknowns(
        at_waypoints=tuple(waypoints),
        objective=_objective(task, has_unknown_times=has_unknown_times),
        total_duration=task.duration,
        knots_are_unknown=task.knots == "optimal" or (has_unknown_times and not knots_are_given),
        time_dependent=tuple(time_dependent),
    )
    for location, message, accepted in _misused(task, values, task_index):
        raise locations.error(location, message, accepted)
    return values if values.has_any else None


def _objective(task: ExpandedTask, *, has_unknown_times: bool) -> Weights:
    objective = task.objective
    if isinstance(objective, Weights):
        return objective
    duration_is_unknown = has_unknown_times and task.duration is None
    return Weights(**{objective or ("time" if duration_is_unknown else "jerk"): 1.0})


def check_unknowns(
    task: ExpandedTask, unknowns_in_task: Sequence[WaypointUnknowns], locations: Locations
) -> None:
    """Refuse times after unknown ones, unknown velocities at the ends and times of paths.

    Args:
        task: The task, in SI.
        unknowns_in_task: The unknowns at each of its waypoints.
        locations: Locations of its parts in the file, for errors.

    Raises:
        DocumentError: One of these is given.
    """
    after_unknown = False
    for i, unknowns in enumerate(unknowns_in_task):
        for key, message, accepted in _misplaced(task, i, after_unknown=after_unknown):
            raise locations.error(("waypoints", i, key), message, accepted)
        after_unknown |= not unknowns.duration_is_given


def _misplaced(
    task: ExpandedTask, i: int, *, after_unknown: bool
) -> Iterator[tuple[str, str, str]]:
    """Misplaced keys of a waypoint: the key, its fault and the accepted keys.

    Args:
        task: The task, in SI.
        i: Index of the waypoint.
        after_unknown: Whether an earlier time is not given.
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
    if not isinstance(waypoint, PathWaypoint):
        if waypoint.velocity == "free" and (at_start or i == len(task.waypoints) - 1):
            message = "the velocity is free at an end of the motion"
            yield "velocity", message, "a velocity, or none: the arm is at rest there"
        return
    if waypoint.time is not None and after_unknown:
        message = "the time since 0 can't be given, because an earlier time is chosen"
        yield "time", message, "speed, or after: the time since the previous waypoint [s]"
    if waypoint.way is not None:
        yield "way", "the motion to here follows a tool path", "way at a waypoint without along"
    if fastest:
        message = "the time along a path follows from its speed"
        yield "after", message, "speed: fastest, or seconds"


def _misused(
    task: ExpandedTask, unknowns: ScenarioUnknowns, task_index: Sequence[int]
) -> Iterator[tuple[Location, str, str]]:
    """Keys about unknowns although there are none, and unknowns that exclude each other."""
    unknown_times = sum(at.duration_is_unknown for at in unknowns.at_waypoints)
    has_unknown_times = unknown_times > len(unknowns.time_dependent)
    has_unknown_speeds = any(at.velocity_kind != "given" for at in unknowns.at_waypoints)
    has_objective = task.objective is not None
    weighs_time = unknowns.objective.time > 0.0
    if task.duration is not None and not has_unknown_times:
        accepted = "times: fastest, or after: fastest at a waypoint"
        yield ("duration",), "is given, but so is every time", accepted
    if has_objective and not (
        has_unknown_times or unknowns.knots_are_unknown or has_unknown_speeds
    ):
        accepted = "times: fastest, after: fastest at a waypoint, or knots: optimal"
        yield ("objective",), "gives an objective, but no time is to be chosen", accepted
    if has_objective and weighs_time and (not has_unknown_times or task.duration is not None):
        message = "the time is given, so it can't be minimised"
        yield ("objective",), message, "jerk, effort or acceleration"
    if unknowns.has_unknown_durations and task.duration is None and not weighs_time:
        message = "gives no weight to the time, so the slowest motion would be optimal"
        accepted = "time as well, for example {time: 1, effort: 0.01}, or duration: seconds"
        yield ("objective",), message, accepted
    if task.chosen is not None and unknowns.has_any:
        message = "gives the motion between waypoints, but times or speeds are to be chosen"
        yield ("chosen",), message, "numbers for all of them, or no key chosen"
    if isinstance(task.knots, tuple) and unknowns.has_any:
        message = "knot times are given, but waypoint times are to be chosen"
        yield ("knots",), message, "no key knots"
    if task.planner != "modified-hermite" and unknowns.has_any:
        accepted = "modified-hermite; its plan.freeze (--freeze) writes numbers for any planner"
        message = f"{task.planner!r} needs given times, and some are to be chosen"
        yield ("planner",), message, accepted
    if unknowns.objective.effort > 0.0 and task.robot is None:
        yield ("objective",), "effort needs a robot, and the file names none", ""
    if unknowns.time_dependent and task.duration is not None:
        task_i = task_index[unknowns.time_dependent[0]]
        name = waypoint_text(task.waypoints[task_i].name or default_waypoint_name(task_i))
        message = f"is given together with the time at {name}, after chosen ones"
        yield ("duration",), message, "one of them"
