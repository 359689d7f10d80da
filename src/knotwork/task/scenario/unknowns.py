"""The unknowns of a scenario: durations, speeds and the objective."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from knotwork.files.documents import Location, Locations
from knotwork.task import AtMost, ClearWay, Fastest, PathWaypoint, PlainTask, Weights
from knotwork.waypoints import BoolArray, FloatArray

SpeedKind = Literal["given", "along", "free"]


@dataclass(frozen=True, eq=False)
class Unknowns:
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
        time_dependent: Indices of waypoints that depend on times still to be chosen: their pose is
            in a moving frame, or their time counts from 0 after a chosen time.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": "fastest"}]
    >>> kw.load_scenario({"limits": {"acceleration": 2}, "waypoints": ends}).unknowns.duration
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
    time_dependent: tuple[int, ...] = ()

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
    def chosen_duration(self) -> BoolArray:
        """Intervals whose duration is chosen, itself or by the speed of a path, shape (n - 1,)."""
        chosen = self.duration.copy()
        chosen[[i - 1 for i in self.path_speed]] = True
        return chosen

    @property
    def first_unknown_time(self) -> int:
        """The first waypoint with an unknown time; n without one."""
        return int(np.append(self.chosen_duration, True).argmax()) + 1

    @property
    def has_unknown_speed(self) -> BoolArray:
        """Whether each interval has unknowns inside or at one end, shape (n - 1,).

        The scenario alone does not define the joint speeds there.
        """
        at_ends = np.array([kind != "given" for kind in self.speed])
        unknown: BoolArray = self.duration | at_ends[1:] | at_ends[:-1]
        return unknown


def ends_wait(task_index: Sequence[int], waypoint: int) -> bool:
    """Whether a waypoint of a scenario is the end of a wait: the second of its two waypoints.

    Args:
        task_index: Index in the task of each waypoint of the scenario.
        waypoint: Index in the scenario.
    """
    return waypoint > 0 and task_index[waypoint] == task_index[waypoint - 1]


def min_time(task: PlainTask, i: int) -> float | None:
    """Lower bound of the chosen time to a waypoint [s], 0 without one; `None` for a given time."""
    waypoint = task.waypoints[i]
    if isinstance(waypoint, PathWaypoint):
        return None
    if isinstance(waypoint.after, Fastest):
        return waypoint.after.at_least or 0.0
    first = i == 0 and task.start is None
    unstated = waypoint.after is None and waypoint.time is None and not first
    chosen = task.times is not None or clear_way(task, i) is not None
    return 0.0 if waypoint.after == "fastest" or (unstated and chosen) else None


def clear_way(task: PlainTask, i: int) -> ClearWay | None:
    """Options of a collision-free motion to a waypoint, or `None`; in SI as the task is."""
    waypoint = task.waypoints[i]
    if isinstance(waypoint, PathWaypoint) or (i == 0 and task.start is None):
        return None
    given = waypoint.way or task.ways
    return ClearWay.model_construct(clear=True) if given == "clear" else given


def max_speed(speed: float | str | AtMost | None) -> float | None:
    """Upper bound of a chosen speed, infinite without one; `None` for a given speed."""
    if isinstance(speed, AtMost):
        return speed.at_most
    return math.inf if isinstance(speed, str) else None


def read_unknowns(
    task: PlainTask, locations: Locations, task_index: Sequence[int]
) -> Unknowns | None:
    """Read the unknowns of a task, or `None` without any.

    Args:
        task: The task, in SI.
        locations: Locations of its parts in the file, for errors.
        task_index: Index in the task of each waypoint of the scenario; -1 for the start.

    Raises:
        DocumentError: A key is about choices although no value is chosen, or the value can't be
            chosen.
    """
    n = len(task_index)
    duration, at_least = np.zeros(n - 1, dtype=bool), np.zeros(n - 1)
    speed: list[SpeedKind] = ["given"] * n
    at_most = np.full(n, np.inf)
    paths: dict[int, float] = {}
    ways: dict[int, ClearWay] = {}
    timed: list[int] = []
    for waypoint, i in enumerate(task_index):
        if i < 0 or ends_wait(task_index, waypoint):  # i < 0 is the start
            continue
        step, minimum, way = task.waypoints[i], min_time(task, i), clear_way(task, i)
        if waypoint and minimum is not None:
            duration[waypoint - 1], at_least[waypoint - 1] = True, minimum
        maximum = max_speed(getattr(step, "speed", None))
        if isinstance(step, PathWaypoint) and maximum is not None:
            paths[waypoint] = maximum
        elif maximum is not None:
            speed[waypoint], at_most[waypoint] = "along", maximum
        elif getattr(step, "velocity", None) == "free":
            speed[waypoint] = "free"
        if way is not None:
            ways[waypoint] = way
        if step.time is not None:
            timed.append(waypoint)
    has_free_times, knots_are_given = bool(duration.any()), "knots" in task.model_fields_set
    unknowns = Unknowns(
        duration=duration,
        at_least=at_least,
        speed=tuple(speed),
        at_most=at_most,
        path_speed=paths,
        ways=ways,
        objective=_objective(task, has_free_times=has_free_times),
        total=task.duration,
        optimal_knots=task.knots == "optimal" or (has_free_times and not knots_are_given),
    )
    dependent = tuple(waypoint for waypoint in timed if waypoint >= unknowns.first_unknown_time)
    duration[[waypoint - 1 for waypoint in dependent]] = True
    unknowns = replace(unknowns, time_dependent=dependent)
    for location, message, accepted in _misused(task, unknowns, task_index):
        raise locations.error(location, message, accepted)
    return unknowns if unknowns.anything else None


def _objective(task: PlainTask, *, has_free_times: bool) -> dict[str, float]:
    given = task.objective
    if isinstance(given, Weights):
        return {name: value for name, value in given if value}
    if given is not None:
        return {given: 1.0}
    return {"time": 1.0} if has_free_times and task.duration is None else {"jerk": 1.0}


def check_open_values(task: PlainTask, locations: Locations) -> None:
    """Refuse times after free ones, free velocities at the ends and free times of paths.

    Raises:
        DocumentError: One of these is given.
    """
    is_chosen = False
    for i, waypoint in enumerate(task.waypoints):
        for key, message, accepted in _misplaced(task, i, after_chosen=is_chosen):
            raise locations.error(("waypoints", i, key), message, accepted)
        is_chosen |= min_time(task, i) is not None
        is_chosen |= isinstance(waypoint, PathWaypoint) and max_speed(waypoint.speed) is not None


def _misplaced(task: PlainTask, i: int, *, after_chosen: bool) -> Iterator[tuple[str, str, str]]:
    """Misplaced keys of a waypoint: the key, its fault and the accepted keys.

    Args:
        task: The task, in SI.
        i: Index of the waypoint.
        after_chosen: Whether an earlier time is chosen.
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
    if waypoint.time is not None and after_chosen:
        message = "the time since 0 can't be given, because an earlier time is chosen"
        yield "time", message, "speed, or after: the time since the previous waypoint [s]"
    if waypoint.way is not None:
        yield "way", "the motion to here follows a tool path", "way at a waypoint without along"
    if fastest:
        message = "the time along a path follows from its speed"
        yield "after", message, "speed: fastest, or seconds"


def _misused(
    task: PlainTask, unknowns: Unknowns, task_index: Sequence[int]
) -> Iterator[tuple[Location, str, str]]:
    """Keys about choices although no value is chosen, and choices that exclude each other."""
    timed, objective = bool(unknowns.duration.any()), task.objective is not None
    weighs_time = unknowns.objective.get("time", 0.0) > 0.0
    if task.duration is not None and not timed:
        accepted = "times: fastest, or after: fastest at a waypoint"
        yield ("duration",), "is given, but so is every time", accepted
    if objective and not (timed or unknowns.optimal_knots or set(unknowns.speed) - {"given"}):
        accepted = "times: fastest, after: fastest at a waypoint, or knots: optimal"
        yield ("objective",), "gives an objective, but no time is free", accepted
    if objective and weighs_time and (not timed or task.duration is not None):
        message = "the time is given, so it can't be minimised"
        yield ("objective",), message, "jerk, effort or acceleration"
    if timed and task.duration is None and not weighs_time:
        message = "gives no weight to the time, so the slowest motion would be optimal"
        accepted = "time as well, for example {time: 1, effort: 0.01}, or duration: seconds"
        yield ("objective",), message, accepted
    if task.chosen is not None and unknowns.anything:
        message = "gives the motion between waypoints, but times or speeds are free"
        yield ("chosen",), message, "numbers for all of them, or no key chosen"
    if isinstance(task.knots, tuple) and unknowns.anything:
        yield ("knots",), "knot times are given, but waypoint times are free", "no key knots"
    if task.planner != "modified-hermite" and unknowns.anything:
        accepted = "modified-hermite; plan --freeze writes a scenario with numbers for any planner"
        yield ("planner",), f"{task.planner!r} needs given times, and some are free", accepted
    if unknowns.objective.get("effort", 0.0) > 0.0 and task.robot is None:
        yield ("objective",), "effort needs a robot, and the file names none", ""
    if unknowns.time_dependent and task.duration is not None:
        number = task_index[unknowns.time_dependent[0]] + 1
        message = f"is given together with the time at waypoint {number}, after chosen ones"
        yield ("duration",), message, "one of them"
