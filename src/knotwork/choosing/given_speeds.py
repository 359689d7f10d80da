"""Given speeds of the tool, compared with its limit before anything is chosen."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable

import numpy as np

from knotwork.choosing.along_path import AlongPath, proved
from knotwork.choosing.task import FreeTask
from knotwork.errors import InputError, together
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.timing.infeasible_values import rounded_down
from knotwork.timing.problem import with_margin

ROUNDING = 1e-9
"""A given speed along a path may be beyond the limit by this part of it."""

NO_ROOM = 5e-4
"""A given speed at a waypoint that leaves less of the limit is refused: the solver needs room."""

ROOM = 0.002
"""A speed that is advised leaves this part of the limit to the motion around the waypoint."""


def greatest_path_speed(scenario: Scenario) -> float:
    """The greatest speed of a tool path that its tolerance can't carry beyond the tool's limit.

    In m/s, infinite without a limit.
    """
    limit = scenario.motion_limits.tool_speed
    return math.inf if limit is None else limit / (1.0 + scenario.tolerances.path_speed)


def paths_without_room(scenario: Scenario) -> dict[int, list[InputError]]:
    """Errors for given speeds of the limit of the tool, or above it, by number of the path."""
    limit, free = scenario.motion_limits.tool_speed, scenario.free
    errors: dict[int, list[InputError]] = {}
    if limit is None or free is None:
        return errors
    for number, path in enumerate(scenario.paths):
        for k, stretch in enumerate(path.stretches):
            given = free.index[path.first + 1 + k] not in free.path_speed
            if given and stretch.speed >= limit * (1.0 - ROUNDING):
                error = path_error(scenario, path, k, "leaves no room below")
                errors.setdefault(number, []).append(error)
    return errors


def path_error(scenario: Scenario, path: ScenarioPath, k: int, what: str) -> InputError:
    """Say that the given speed of a stretch is too near the tool's limit."""
    i = path.first + 1 + k
    begin, end = (scenario.waypoints[i - j].name for j in (1, 0))
    error = InputError(
        f"{_shown(scenario, path.stretches[k].speed)} along the path from {begin!r} to {end!r} "
        f"{what} tool_speed, {_limit(scenario)}; "
        f"accepted: at most {_shown(scenario, greatest_path_speed(scenario))} (the path_speed "
        f"tolerance is {scenario.tolerances.path_speed:g} of the speed), or a higher limit"
    )
    index = i if scenario.free is None else scenario.free.index[i]
    return located(scenario, error, "waypoints", index, "speed")


def waypoints_beyond_tool_speed(task: FreeTask) -> list[InputError]:
    """Errors for waypoints at which the tool is given a speed of its limit, nearly, or above it."""
    found: list[InputError] = []
    scenario, free = task.scenario, task.free
    limit, robot = scenario.motion_limits.tool_speed, task.space.robot
    if limit is None or robot is None:
        return found
    rows = np.abs(task.waypoints.time[:, None] - scenario.times[None, :]).argmin(axis=0)
    on_paths = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    for i, row in enumerate(rows):
        if free.speed[i] != "given" or i in on_paths:
            continue
        q, v = task.waypoints.position[row], task.waypoints.velocity[row]
        speed = float(np.linalg.norm(robot.jacobian(q)[:3] @ v))
        if not speed > limit * (1.0 - NO_ROOM):
            continue
        k = free.index[i]
        most = (1.0 - ROOM) * limit
        error = InputError(
            f"waypoint {scenario.waypoints[i].name!r}: the tool is given a speed of "
            f"{_shown(scenario, speed)}, and tool_speed is {_limit(scenario)}; "
            f"accepted: at most {_shown(scenario, most)}, {rounded_down(most / speed, 3):g} "
            "times that speed, or a higher limit"
        )
        place = ("waypoints", k) if k >= 0 else ("start",)
        found.append(located(scenario, error, *place))
    return found


def located(scenario: Scenario, error: InputError, *place: str | int) -> InputError:
    """The error, with the field of the file at fault, where the scenario has a file."""
    if scenario.document is not None:
        error.locate(scenario.document.where(place))
    return error


def tell(errors: Iterable[InputError]) -> None:
    """Raise what several errors say together, if there are any."""
    found = list(errors)
    if found:
        raise together(found)


def _shown(scenario: Scenario, speed: float) -> str:
    """A speed [m/s] in the units of the scenario."""
    scale, unit = scenario.shown_length
    return f"{rounded_down(scale * speed, 6):.6g} {unit}/s"


def _limit(scenario: Scenario) -> str:
    """The limit of the tool's speed, and what it is before the margin."""
    limit = scenario.motion_limits.tool_speed or math.inf
    return with_margin(lambda speed: _shown(scenario, speed), limit, scenario.margin)


def paths_beyond_tool_speed(task: FreeTask, told: Container[int]) -> dict[int, list[InputError]]:
    """Errors for given speeds that take the tool beyond its limit, by number of the path.

    Args:
        task: The task.
        told: Paths that are left out.
    """
    scenario, robot = task.scenario, task.space.robot
    limit = scenario.motion_limits.tool_speed
    errors: dict[int, list[InputError]] = {}
    if limit is None or robot is None:
        return errors
    from knotwork.verification import tool_speed_bound

    for number, path in enumerate(scenario.paths):
        if number in told:
            continue
        fastest = max(range(len(path.stretches)), key=lambda k: path.stretches[k].speed)
        if path.stretches[fastest].speed <= greatest_path_speed(scenario):
            continue
        motion = AlongPath(task, path).motion(scenario)
        bound = tool_speed_bound(robot, motion, limit=limit)
        if not proved(bound):
            errors[number] = [path_error(scenario, path, fastest, "takes the tool beyond")]
    return errors
