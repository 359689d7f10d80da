"""Poses of many scenarios, searched for in one batch: which rows can't pass, and why.

A row is refused here only if a pose is missed by far in all of many searches. What is missed by
little may be next to a singularity or at the end of the arm's reach: planning has better means for
that, and decides.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.joint_space import joint_space
from knotwork.kinematics import solve_many
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.sweeps.outcome import OUT_OF_REACH, REFUSED, Outcome
from knotwork.waypoints import CartesianWaypoint

FEW, MANY = 24, 300
"""Searches for every pose that fails from the start, and for the worst pose of a row left then."""
FAR = 0.01
"""Poses that are missed by less [m + rad] are left to planning."""
TOLERANCE = 1e-7
# What of a scenario decides which robot with which tool and joint limits it has.
_ROBOT_KEYS = ("robot", "tool", "limits", "units")


def out_of_reach(scenarios: Mapping[int, Scenario]) -> dict[int, Outcome]:
    """Find scenarios with a pose that no joint positions inside the limits lead to.

    What is found depends on the scenarios given together in no digit but those of the message, as
    the searches for one pose do not know the others.

    Args:
        scenarios: By row.

    Returns:
        The outcomes of those that are refused, by row.
    """
    groups: dict[str, list[int]] = {}
    for row, scenario in scenarios.items():
        if scenario.robot is not None and scenario.document is not None:
            data: Any = scenario.document.data
            key = json.dumps([data.get(name) for name in _ROBOT_KEYS])
            groups.setdefault(key, []).append(row)
    found: dict[int, Outcome] = {}
    for rows in groups.values():
        try:
            robot = joint_space(scenarios[rows[0]]).robot
        except InputError:
            continue  # planning says what is wrong
        if robot is not None and robot.tool_frame is not None:
            found |= _refused(robot, {row: scenarios[row] for row in rows})
    return found


def _refused(robot: Robot, scenarios: Mapping[int, Scenario]) -> dict[int, Outcome]:
    targets = [
        (row, waypoint)
        for row, scenario in scenarios.items()
        for waypoint in scenario.waypoints
        if isinstance(waypoint, CartesianWaypoint)
    ]
    if not targets:
        return {}
    start = robot.configurations.get("home", np.zeros(robot.dof))
    error = _errors(robot, [one.pose for _, one in targets], start, FEW)
    worst: dict[int, int] = {}
    for i, (row, _) in enumerate(targets):
        if error[i] > FAR and (row not in worst or error[i] > error[worst[row]]):
            worst[row] = i
    if not worst:
        return {}
    again = list(worst.values())
    left = _errors(robot, [targets[i][1].pose for i in again], start, MANY)
    return {
        row: Outcome(
            REFUSED,
            OUT_OF_REACH,
            f"waypoint {targets[i][1].name!r}: the pose is out of reach: none of {MANY} searches "
            "for joint positions inside the limits comes near it; plan this row for its diagnosis",
        )
        for (row, i), miss in zip(worst.items(), left, strict=True)
        if miss > FAR
    }


def _errors(robot: Robot, poses: list[Any], start: Any, searches: int) -> Any:
    """What is left of the way to each pose [m + rad], 0 where it is met; equal poses once."""
    keys = [pose.homogeneous.tobytes() for pose in poses]
    first = {key: i for i, key in reversed(list(enumerate(keys)))}
    once = sorted(first.values())
    place = {keys[i]: k for k, i in enumerate(once)}
    found = solve_many(
        robot, [poses[i] for i in once], start, tolerance=TOLERANCE, max_restarts=searches
    )
    left = np.where(found.converged, 0.0, found.position_error + found.orientation_error)
    return left[[place[key] for key in keys]]
