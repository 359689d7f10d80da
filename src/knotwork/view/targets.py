"""Pose and velocity of the tool that each waypoint asks for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from knotwork.joint_space import JointSpace
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.waypoints import CartesianWaypoint, FloatArray


def targets(scenario: Scenario, space: JointSpace, robot: Robot) -> list[CartesianWaypoint]:
    """Find the tool pose and velocity that each waypoint asks for, in the URDF root's axes.

    A wait is there once, where it begins.
    """
    base = robot.base_placement
    found = []
    for i, (waypoint, state) in enumerate(zip(scenario.waypoints, space.targets, strict=True)):
        if i - 1 in space.waits:
            continue
        if state is not None:
            pose, twist = robot.forward(state.position), robot.twist(state.position, state.velocity)
        elif isinstance(waypoint, CartesianWaypoint):
            pose, twist = waypoint.pose, waypoint.twist
        turned = pin.Motion(base.rotation @ twist.linear, base.rotation @ twist.angular)
        found.append(CartesianWaypoint(waypoint.name, waypoint.time, base * pose, turned))
    return found


def spacings(asked: Sequence[CartesianWaypoint]) -> FloatArray:
    """Distances from each waypoint to the next [m], those that stay in place left out."""
    points = np.array([target.pose.translation for target in asked]).reshape(-1, 3)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(lengths[lengths > 1e-6])
