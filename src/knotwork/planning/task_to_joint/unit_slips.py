"""Poses that are out of reach because of a wrong unit of lengths or angles."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from knotwork.errors import TaskError
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.scenario.angle_slips import angle_slips
from knotwork.waypoints import CartesianWaypoint

# Beyond this factor on the arm's reach, or on its inverse, a pose is not merely badly placed.
FAR_FACTOR = 20.0


def suggest_unit(error: TaskError, scenario: Scenario, robot: Robot) -> None:
    """Add the unit that would make a pose reachable to the error of the pose.

    Args:
        error: Error of the waypoint that can't be reached.
        scenario: The task.
        robot: The arm.
    """
    waypoint = next(w for w in scenario.waypoints if w.name == error.waypoint)
    if not isinstance(waypoint, CartesianWaypoint):
        return
    distance, reach = float(np.linalg.norm(waypoint.position)), _reach(robot)
    if scenario.units.length == "m" and FAR_FACTOR * reach < distance <= 1000 * reach:
        shown, unit = f"{distance:.4g} m", "mm"
    elif (
        scenario.units.length == "mm" and distance < reach / FAR_FACTOR and 1000 * distance <= reach
    ):
        shown, unit = f"{1000 * distance:.4g} mm", "m"
    else:
        units = dict(zip(robot.joint_names, robot.joint_units, strict=True))
        slips = angle_slips(scenario, units)
        if slips:
            error.add(slips[0])
        return
    error.add(
        f"it is {shown} from the base of an arm that reaches {reach:.2g} m at most; if the file's "
        f"lengths are in {unit}, say so with `units: {{length: {unit}}}`"
    )


def _reach(robot: Robot) -> float:
    """Length of the arm stretched out up to its tool frame [m].

    The tool's offset is left out: it comes from the same file as the pose.
    """
    robot.require_tool()
    tool = robot.model.frames[robot.model.getFrameId(robot.tool_frame, pin.BODY)]
    placements = [*robot.model.jointPlacements, tool.placement]
    links = sum(float(np.linalg.norm(placement.translation)) for placement in placements)
    bounds = np.abs([robot.lower_position_limit, robot.upper_position_limit]).max(axis=0)
    return links + float(sum(bounds[[unit == "m" for unit in robot.joint_units]]))
