"""What each waypoint asks of the tool: its pose, and how fast it goes and turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from knotwork.joint_space import JointSpace
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.waypoints import CartesianWaypoint, FloatArray


@dataclass(frozen=True, eq=False)
class Target:
    """A waypoint at the tool, as asked for, in the axes of the URDF's root.

    Attributes:
        name, time: Of the waypoint; time in s.
        pose: Of the tool, `pin.SE3`.
        linear: Velocity of the TCP [m/s], shape (3,).
        angular: Angular velocity of the tool [rad/s], shape (3,).
    """

    name: str
    time: float
    pose: pin.SE3
    linear: FloatArray
    angular: FloatArray


def targets(scenario: Scenario, space: JointSpace, robot: Robot) -> list[Target]:
    """Find the tool pose and velocity that each waypoint asks for."""
    base = robot.base_placement
    found = []
    for waypoint, state in zip(scenario.waypoints, space.targets, strict=True):
        if state is not None:
            pose, twist = robot.forward(state.position), robot.twist(state.position, state.velocity)
        elif isinstance(waypoint, CartesianWaypoint):
            pose, twist = waypoint.pose, waypoint.twist
        turned = base.rotation @ twist.linear, base.rotation @ twist.angular
        found.append(Target(waypoint.name, waypoint.time, base * pose, *turned))
    return found


def spacings(asked: Sequence[Target]) -> FloatArray:
    """Distances from each waypoint to the next [m], those that stay in place left out."""
    points = np.array([target.pose.translation for target in asked]).reshape(-1, 3)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(lengths[lengths > 1e-6])
