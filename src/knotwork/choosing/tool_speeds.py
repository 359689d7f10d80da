"""Given speeds of the tool, compared with its limit before anything is chosen."""

from __future__ import annotations

import math

import numpy as np

from knotwork.choosing.task import FreeTask
from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.timing.safe_numbers import rounded_down

ROUNDING = 1e-9
"""A given speed at a waypoint may be beyond the limit by this part of it."""

ROOM = 0.01
"""A speed that is advised leaves this part of the limit to the motion around the waypoint."""


def greatest_path_speed(scenario: Scenario) -> float:
    """The greatest speed of a tool path that its tolerance can't carry beyond the tool's limit.

    In m/s, infinite without a limit.
    """
    limit = scenario.motion_limits.tool_speed
    return math.inf if limit is None else limit / (1.0 + scenario.tolerances.path_speed)


def check_path_speeds(scenario: Scenario) -> None:
    """Refuse a tool path whose given speed leaves the tool no room below its limit.

    Raises:
        InputError: The speed along a path is that of the limit, or above it.
    """
    limit, free = scenario.motion_limits.tool_speed, scenario.free
    if limit is None or free is None:
        return
    for path in scenario.paths:
        for k, stretch in enumerate(path.stretches):
            i = path.first + 1 + k
            if free.index[i] in free.path_speed or stretch.speed < limit * (1.0 - ROUNDING):
                continue
            begin, end = (scenario.waypoints[i - j].name for j in (1, 0))
            most = greatest_path_speed(scenario)
            with scenario.error_context("waypoints", free.index[i], "speed"):
                raise InputError(
                    f"{_shown(scenario, stretch.speed)} along the path from {begin!r} to {end!r} "
                    f"leaves no room below tool_speed, {_shown(scenario, limit)}; "
                    f"accepted: at most {_shown(scenario, most)} (the path_speed tolerance is "
                    f"{scenario.tolerances.path_speed:g} of the speed), or a higher limit"
                )


def check_waypoint_speeds(task: FreeTask) -> None:
    """Refuse a waypoint at which the tool is given a speed beyond its limit.

    Raises:
        InputError: There is one.
    """
    scenario, free = task.scenario, task.free
    limit, robot = scenario.motion_limits.tool_speed, task.space.robot
    if limit is None or robot is None:
        return
    rows = np.abs(task.waypoints.time[:, None] - scenario.times[None, :]).argmin(axis=0)
    for i, row in enumerate(rows):
        if free.speed[i] != "given":
            continue
        q, v = task.waypoints.position[row], task.waypoints.velocity[row]
        speed = float(np.linalg.norm(robot.jacobian(q)[:3] @ v))
        if not speed > limit * (1.0 + ROUNDING):
            continue
        k = free.index[i]
        with scenario.error_context(*(("waypoints", k) if k >= 0 else ("start",))):
            most = (1.0 - ROOM) * limit
            raise InputError(
                f"waypoint {scenario.waypoints[i].name!r}: the tool is given a speed of "
                f"{_shown(scenario, speed)}, and tool_speed is {_shown(scenario, limit)}; "
                f"accepted: at most {_shown(scenario, most)}, {rounded_down(most / speed, 3):g} "
                "times that speed, or a higher limit"
            )


def _shown(scenario: Scenario, speed: float) -> str:
    """A speed [m/s] in the units of the scenario."""
    scale, unit = scenario.shown_length
    return f"{rounded_down(scale * speed, 6):.6g} {unit}/s"
