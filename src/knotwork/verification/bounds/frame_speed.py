"""Proved bounds on the speed and acceleration of the tool or another frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.curves.trajectory import JointTrajectory
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree
from knotwork.verification.bounds.adaptive import (
    Bound,
    Quantity,
    checked_limit,
    curve_of,
    upper_bounds,
)
from knotwork.verification.bounds.link_motion import carrier_of, tree_motion
from knotwork.waypoints import FloatArray


def tool_speed_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    frame: str | None = None,
    limit: float | None = None,
) -> Bound:
    """Bound the speed of the tool centre point, or of a frame's origin, over all time [m/s].

    Between samples h apart the speed is at most the larger of both plus h²/8 times a bound on its
    second derivative along the chain of joints: see "Proved over all time" in the documentation.

    Args:
        robot: The arm.
        trajectory: The motion of its joints.
        frame: Name of a link, for example the forearm for the elbow; by default the tool.
        limit: Upper limit [m/s]; without one the bound is tight to 0.1 %.

    Raises:
        UnknownNameError: The robot has no such frame.
        RobotError: No frame is given and no tool frame has been chosen.
        InputError: The trajectory is not of the robot's joints, or the limit isn't positive.

    >>> plan = kw.plan("ur5_deburring")
    >>> speed = kw.verification.tool_speed_bound(plan.space.robot, plan.trajectory, limit=0.25)
    >>> speed.ok, speed.proved
    (True, True)
    """
    return _bound(robot, trajectory, frame, 1, checked_limit(limit, "tool speed"))


def tool_acceleration_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    frame: str | None = None,
    limit: float | None = None,
) -> Bound:
    """Bound the acceleration of the tool centre point, or of a frame's origin [m/s²].

    The bound holds over all time, on both sides of breaks. Arguments and errors are those of
    `tool_speed_bound`, the limit in m/s².

    >>> plan = kw.plan("ur5_deburring")
    >>> robot = plan.space.robot
    >>> found = kw.verification.tool_acceleration_bound(robot, plan.trajectory, limit=1.0)
    >>> found.ok, found.proved, found.value < found.bound < 1.0
    (True, True, True)
    """
    return _bound(robot, trajectory, frame, 2, checked_limit(limit, "tool acceleration"))


def speed_quantity(model: Any, frame: int, order: int) -> Quantity:
    """Speed (order 1) or acceleration (order 2) of a frame's origin."""
    moved: Callable[..., Any] = (
        pin.getFrameVelocity if order == 1 else pin.getFrameClassicalAcceleration
    )
    joints, data, (joint, lever) = joint_tree(model), model.createData(), carrier_of(model, frame)

    def values(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        sizes = np.empty((len(q), 1))
        for row, state in zip(sizes, zip(q, v, a, strict=True), strict=True):
            pin.forwardKinematics(model, data, *state)
            row[0] = np.linalg.norm(moved(model, data, frame).linear)
        return sizes

    def bounds(rates: FloatArray) -> FloatArray:
        return tree_motion(joints, rates).point(joint, lever)[order : order + 3, None]

    return Quantity(values, bounds, joints.angles)


def _bound(
    robot: Robot,
    trajectory: JointTrajectory,
    frame: str | None,
    order: int,
    limit: float,
) -> Bound:
    index = robot.require_tool() if frame is None else robot.frame_index(frame)
    quantity, limits = speed_quantity(robot.model, index, order), np.array([limit])
    return upper_bounds(curve_of(robot, trajectory), quantity, limits)[0]
