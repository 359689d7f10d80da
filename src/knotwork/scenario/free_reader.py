"""Unknowns of a scenario file: durations and speeds to be chosen, and the objective."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from knotwork.documents import Location, Places
from knotwork.errors.plain_text import default_waypoint_name
from knotwork.scenario.free_times import PROVISIONAL_TIME, FreeTimes, FreeWay, SpeedKind
from knotwork.task import AtMost, ClearWay, Fastest, PathWaypoint, PlainTask, Weights

MOST_BEFORE, SHORTEST = 20, 1e-3
"""Largest number of waypoints that share the time before a given one, and the minimum time of each
[s]."""

_Fault = tuple[bool, Location, str, str]
"""Whether the fault exists, its location, its description, and the accepted values."""


def least_time(file: PlainTask, i: int) -> float | None:
    """Lower bound of the time to a waypoint [s], 0 without one; `None` if it is given."""
    waypoint = file.waypoints[i]
    if isinstance(waypoint, PathWaypoint):
        return None
    if isinstance(waypoint.after, Fastest):
        return waypoint.after.at_least or 0.0
    first = i == 0 and file.start is None
    left = waypoint.after is None and waypoint.time is None and not first
    chosen = file.times is not None or clear_way(file, i) is not None
    return 0.0 if waypoint.after == "fastest" or (left and chosen) else None


def clear_way(file: PlainTask, i: int) -> FreeWay | None:
    """Options of a collision-free motion to a waypoint, or `None`; in SI as the file is."""
    waypoint = file.waypoints[i]
    if isinstance(waypoint, PathWaypoint) or (i == 0 and file.start is None):
        return None
    given = waypoint.way or file.ways
    if isinstance(given, ClearWay):
        return FreeWay(given.tries, given.room or 0.0)
    return FreeWay(ClearWay.model_fields["tries"].default, 0.0) if given else None


def provisional_time(file: PlainTask, i: int, before: float) -> float | None:
    """Time to a waypoint until it is chosen [s]; `None` if it is given.

    Before a waypoint with a given time it is a share of the remaining time.

    Args:
        file: Content of the file, in SI.
        i: Index of the waypoint.
        before: Time of the previous waypoint [s].
    """
    least = least_time(file, i)
    if least is None:
        return None
    longest, parts = max(least, PROVISIONAL_TIME), 1
    for one in file.waypoints[i : i + MOST_BEFORE]:
        if one.time is not None:
            return min(longest, max(one.time - before, MOST_BEFORE * SHORTEST) / parts)
        given = one.after if isinstance(one.after, float) else 0.0
        before += given + (one.wait or 0.0)
        parts += not given
    return longest


def given_speed(speed: float | str | AtMost | None, provisional: float) -> float | None:
    """A speed of the file, or the provisional one where it is free."""
    return provisional if isinstance(speed, str | AtMost) else speed


def greatest_speed(speed: float | str | AtMost | None) -> float | None:
    """Upper bound of a free speed, infinite without one; `None` if it is not free."""
    if isinstance(speed, AtMost):
        return speed.at_most
    return math.inf if isinstance(speed, str) else None


def read_free_times(file: PlainTask, places: Places, index: tuple[int, ...]) -> FreeTimes | None:
    """Read the unknowns of a file, or `None` without any.

    Args:
        file: Content of the file.
        places: Its places in the file, for errors.
        index: Index in the file of each waypoint of the scenario; -1 for the start.

    Raises:
        DocumentError: A key is about choices and nothing is chosen, or it can't be chosen.
    """
    least = [
        least_time(file, there) if there >= 0 and here != there else None
        for here, there in pairwise(index)
    ]
    speed: list[SpeedKind] = ["given"] * len(index)
    at_most = np.full(len(index), np.inf)
    paths: dict[int, float] = {}
    for i, k in enumerate(index):
        waypoint = file.waypoints[k] if k >= 0 else None
        most = greatest_speed(getattr(waypoint, "speed", None))
        if isinstance(waypoint, PathWaypoint):
            if most is not None and k != index[i - 1]:
                paths[i] = most
        elif most is not None:
            speed[i], at_most[i] = "along", most
        elif getattr(waypoint, "velocity", None) == "free":
            speed[i] = "free"
    free = FreeTimes(
        duration=np.array([one is not None for one in least], dtype=bool),
        at_least=np.array([one or 0.0 for one in least]),
        speed=tuple(speed),
        at_most=at_most,
        path_speed=paths,
        ways={
            i: way
            for i, k in enumerate(index)
            if i and k != index[i - 1] and k >= 0 and (way := clear_way(file, k))
        },
        objective=_objective(file),
        total=file.duration,
        optimal_knots=_optimal_knots(file),
    )
    late = [
        i
        for i in range(free.first_untimed, len(index))
        if index[i] != index[i - 1] and file.waypoints[index[i]].time is not None
    ]
    free.duration[[i - 1 for i in late]] = True
    free = replace(free, meets=tuple(late))
    _refuse(places, _misused(file, free))
    if late and file.duration is not None:
        raise places.error(
            ("duration",),
            f"is given together with the time at waypoint {index[late[0]] + 1}, after chosen ones",
            "one of them",
        )
    return free if free.anything else None


def _refuse(places: Places, faults: Iterator[_Fault]) -> None:
    for wrong, location, message, accepted in faults:
        if wrong:
            raise places.error(location, message, accepted)


def _optimal_knots(file: PlainTask) -> bool:
    """Whether knots are chosen for given times; by default if other times are free."""
    return file.knots == "optimal" or (
        "knots" not in file.model_fields_set and _free_anywhere(file)
    )


def _objective(file: PlainTask) -> dict[str, float]:
    given = file.objective
    if isinstance(given, Weights):
        return {name: value for name, value in given if value}
    if given is not None:
        return {given: 1.0}
    smooth = file.duration is not None or not _free_anywhere(file)
    return {"jerk": 1.0} if smooth else {"time": 1.0}


def _free_anywhere(file: PlainTask) -> bool:
    return any(least_time(file, i) is not None for i in range(len(file.waypoints)))


def check_places(file: PlainTask, places: Places) -> None:
    """Refuse times after free ones, free velocities at the ends and free times of paths.

    Raises:
        DocumentError: One of these is given.
    """
    _refuse(places, _misplaced(file))


def _misplaced(file: PlainTask) -> Iterator[_Fault]:
    free = ""
    last = len(file.waypoints) - 1
    for i, waypoint in enumerate(file.waypoints):
        place, at_start = ("waypoints", i), i == 0 and file.start is None
        along = isinstance(waypoint, PathWaypoint)
        speed = waypoint.speed if isinstance(waypoint, PathWaypoint) else None
        chosen = greatest_speed(speed) is not None
        untimed = isinstance(waypoint.after, str | Fastest)
        yield (
            at_start and untimed,
            (*place, "after"),
            "the first waypoint has no previous one, so no time to it can be chosen",
            "no time here, or start: the start of the motion",
        )
        yield (
            along and waypoint.time is not None and bool(free),
            (*place, "time"),
            f"the time since 0 can't be given, because the earlier time to {free} is chosen",
            "speed, or after: the time since the previous waypoint [s]",
        )
        yield (
            along and waypoint.way is not None,
            (*place, "way"),
            "the motion to here follows a tool path",
            "way at a waypoint without along",
        )
        yield (
            at_start and waypoint.way is not None,
            (*place, "way"),
            "the first waypoint has no previous one, so there is no motion to it",
            "way at a later waypoint, or start: the start of the motion",
        )
        yield (
            getattr(waypoint, "velocity", None) == "free" and (at_start or i == last),
            (*place, "velocity"),
            "the velocity is free at an end of the motion",
            "a velocity, or none: the arm is at rest there",
        )
        yield (
            along and untimed,
            (*place, "after"),
            "the time along a path follows from its speed",
            "speed: fastest, or seconds",
        )
        for key in ("time", "after"):
            yield (
                chosen and getattr(waypoint, key) is not None,
                (*place, key),
                "is given together with a speed that is chosen",
                f"speed: fastest, or {key}, not both",
            )
        if least_time(file, i) is not None or chosen:
            free = default_waypoint_name(i) if waypoint.name is None else repr(waypoint.name)


def _misused(file: PlainTask, free: FreeTimes) -> Iterator[_Fault]:
    """Keys about choices where nothing is chosen, and choices that exclude each other."""
    timed, objective = bool(free.duration.any()), file.objective is not None
    weighs_time = free.objective.get("time", 0.0) > 0.0
    along = any(isinstance(waypoint, PathWaypoint) for waypoint in file.waypoints)
    yield (
        file.times is not None and not timed and not free.path_speed,
        ("times",),
        "fastest, but every waypoint gives its time" + " or its speed along a path" * along,
        "no times here, or after: fastest at a waypoint"
        + ", or speed: fastest along a path" * along,
    )
    yield (
        file.duration is not None and not timed,
        ("duration",),
        "is given, but so is every time",
        "times: fastest, or after: fastest at a waypoint",
    )
    yield (
        objective and not (timed or free.optimal_knots or set(free.speed) - {"given"}),
        ("objective",),
        "gives an objective, but no time is free",
        "times: fastest, after: fastest at a waypoint, or knots: optimal",
    )
    yield (
        objective and weighs_time and (not timed or file.duration is not None),
        ("objective",),
        "the time is given, so it can't be minimised",
        "jerk, effort or acceleration",
    )
    yield (
        timed and file.duration is None and not weighs_time,
        ("objective",),
        "gives no weight to the time, so the slowest motion would be optimal",
        "time as well, for example {time: 1, effort: 0.01}, or duration: seconds",
    )
    yield (
        file.chosen is not None and free.anything,
        ("chosen",),
        "gives the motion between waypoints, but times or speeds are free",
        "numbers for all of them, or no chosen",
    )
    yield (
        isinstance(file.knots, tuple) and free.anything,
        ("knots",),
        "knot times are given, but waypoint times are free",
        "no knots",
    )
    yield (
        file.planner != "modified-hermite" and free.anything,
        ("planner",),
        f"{file.planner!r} needs given times, and some are free",
        "modified-hermite; plan --freeze writes a scenario with numbers for any planner",
    )
    yield (
        free.objective.get("effort", 0.0) > 0.0 and file.robot is None,
        ("objective",),
        "effort needs a robot, and the file names none",
        "",
    )
