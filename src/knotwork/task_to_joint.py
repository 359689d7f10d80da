"""A scenario's waypoints at the joints: inverse kinematics, position (eq 3) and velocity (eq 4)."""

from __future__ import annotations

import numpy as np

from knotwork.errors import UnknownNameError
from knotwork.joint_space import JointSpace
from knotwork.scenario import JointTarget, Scenario
from knotwork.waypoints import CartesianWaypoint, FloatArray, JointWaypoints

HOME = "home"


def task_to_joint(scenario: Scenario, space: JointSpace) -> JointWaypoints:
    """Find the joint positions and velocities that meet each waypoint.

    Of the solutions of a pose the one nearest to the waypoint before it is taken, turns of ±2π
    within limits included; for the first waypoint, nearest to the robot's home. With `near` in
    the scenario, the one nearest to that, for every waypoint.

    Args:
        scenario: The task.
        space: The joints and the robot it is for.

    Raises:
        UnreachablePoseError: No configuration reaches a pose.
        OutsideLimitsError: A pose is reached only with joints outside their limits.
        SingularityError: The arm can't move as asked at a waypoint.
        DocumentError: Joint values name a joint or configuration that does not exist.
    """
    near = space.values(scenario.near, missing=None) if scenario.near is not None else None
    before = near
    positions: list[FloatArray] = []
    velocities: list[FloatArray] = []
    for waypoint in scenario.waypoints:
        if isinstance(waypoint, JointTarget):
            position, velocity = _at_joints(waypoint, space)
        else:
            reference = near if near is not None else before
            if reference is None:
                reference = _home(space)
            position, velocity = _at_tool(waypoint, space, reference)
        positions.append(position)
        velocities.append(velocity)
        before = position
    return JointWaypoints(
        joint_names=space.joint_names,
        time=scenario.times,
        position=np.array(positions),
        velocity=np.array(velocities),
        names=tuple(waypoint.name for waypoint in scenario.waypoints),
        joint_units=space.joint_units,
    )


def _at_joints(target: JointTarget, space: JointSpace) -> tuple[FloatArray, FloatArray]:
    position = space.values(target.joints)
    if target.velocity is None:
        return position, np.zeros_like(position)
    return position, space.values(target.velocity, missing=0.0)


def _at_tool(
    waypoint: CartesianWaypoint, space: JointSpace, reference: FloatArray
) -> tuple[FloatArray, FloatArray]:
    from knotwork.kinematics import solve_pose_ik, solve_velocity_ik

    robot = space.robot
    if robot is None:
        raise UnknownNameError("robot", "", (), where=waypoint.where)
    solution = solve_pose_ik(
        robot, waypoint.pose, reference, waypoint=waypoint.name, where=waypoint.where
    )
    velocity = solve_velocity_ik(
        robot, solution.q, waypoint.twist, waypoint=waypoint.name, where=waypoint.where
    )
    return solution.q, velocity


def _home(space: JointSpace) -> FloatArray:
    """Home, or for a robot that has none the middle of the joints' ranges."""
    if HOME in space.configurations:
        return np.array(space.configurations[HOME])
    bounded = np.isfinite(space.lower_position_limit) & np.isfinite(space.upper_position_limit)
    middle = np.zeros(len(space.joint_names))
    middle[bounded] = (
        space.lower_position_limit[bounded] + space.upper_position_limit[bounded]
    ) / 2
    return middle
