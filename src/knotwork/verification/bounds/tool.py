"""Proved bounds on the speed and the acceleration of the tool or of any other frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree
from knotwork.trajectory import JointTrajectory
from knotwork.verification.bounds.adaptive import BUDGET, Quantity, maximum
from knotwork.verification.bounds.chain import carried, tree_motion
from knotwork.verification.bounds.result import Bound, checked_limit, curve_of, upper_bounds
from knotwork.waypoints import FloatArray

PRECISION = 1e-3
"""How near a bound comes to the largest value found, relative to that or to the limit."""

FLOOR = 1e-6
"""Resolution of values near zero, as a fraction of the largest that the joints' rates allow."""


def tool_speed_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    frame: str | None = None,
    limit: float | None = None,
    budget: int = BUDGET,
) -> Bound:
    """Bound the speed of the tool centre point, or of a frame's origin, over all time [m/s].

    Between samples h apart the speed is at most the larger of both plus h²/8 times a bound on its
    second derivative along the chain of joints: see "Proved over all time" in the documentation.

    Args:
        robot: The arm.
        trajectory: The motion of its joints.
        frame: Name of a link, for example the forearm for the elbow; by default the tool.
        limit: Largest speed allowed [m/s]; without one the bound is made tight to 0.1 %.
        budget: How many evaluations may follow the first 500.

    Raises:
        UnknownNameError: There is no such frame.
        RobotError: No frame is given and no tool frame has been chosen.
        InputError: The trajectory is not of the robot's joints, or the limit isn't positive.

    >>> plan = kw.plan("ur5_deburring")
    >>> speed = kw.verification.tool_speed_bound(plan.space.robot, plan.trajectory, limit=0.25)
    >>> speed.ok, speed.proved
    (True, True)
    """
    return _bound(robot, trajectory, frame, limit, budget, 1, "tool speed")


def tool_acceleration_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    frame: str | None = None,
    limit: float | None = None,
    budget: int = BUDGET,
) -> Bound:
    """Bound the acceleration of the tool centre point, or of a frame's origin [m/s²].

    It holds over all time, on both sides of breaks. Arguments and errors are those of
    `tool_speed_bound`, the limit in m/s².

    >>> plan = kw.plan("ur5_deburring")
    >>> robot = plan.space.robot
    >>> found = kw.verification.tool_acceleration_bound(robot, plan.trajectory, limit=1.0)
    >>> found.ok, found.proved, found.value < found.bound < 1.0
    (True, True, True)
    """
    return _bound(robot, trajectory, frame, limit, budget, 2, "tool acceleration")


def _bound(
    robot: Robot,
    trajectory: JointTrajectory,
    frame: str | None,
    limit: float | None,
    budget: int,
    order: int,
    what: str,
) -> Bound:
    allowed = checked_limit(limit, what)
    index = robot.require_tool() if frame is None else robot.frame_index(frame)
    quantity = frame_quantity(robot.model, index, order)

    return single_bound(robot, trajectory, quantity, allowed, budget)


def single_bound(
    robot: Robot, trajectory: JointTrajectory, quantity: Quantity, limit: float, budget: int
) -> Bound:
    """Bound a quantity of one component against a limit, infinite for none."""
    most = np.array([limit])

    def precision(value: FloatArray, scale: FloatArray) -> FloatArray:
        return relative_precision(value, scale, most)

    found = maximum(curve_of(robot, trajectory), quantity, most, precision, budget)
    return upper_bounds(found, most)[0]


def relative_precision(value: FloatArray, scale: FloatArray, limit: FloatArray) -> FloatArray:
    """How near a bound has to come to the samples: a share of the limit or the value, if larger."""
    least = np.where(np.isfinite(limit), limit, FLOOR / PRECISION * scale)
    share = np.maximum(np.where(np.isfinite(value), value, 0.0), least)
    return np.asarray(PRECISION * share)


def frame_quantity(model: Any, frame: int, order: int) -> Quantity:
    """Speed (order 1) or acceleration (order 2) of a frame's origin, as a `Quantity`."""
    joints, data = joint_tree(model), model.createData()
    joint, distance = carried(model, frame)
    moved: Callable[..., Any] = (
        pin.getFrameVelocity if order == 1 else pin.getFrameClassicalAcceleration
    )

    def values(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        vectors = np.empty((len(q), 3))
        for row, state in zip(vectors, zip(q, v, a, strict=True), strict=True):
            pin.forwardKinematics(model, data, *state)
            row[:] = moved(model, data, frame).linear
        return np.asarray(np.linalg.norm(vectors, axis=1, keepdims=True))

    def sizes(rates: FloatArray) -> FloatArray:
        return tree_motion(joints, rates).point(joint, distance)[order : order + 3, None]

    return Quantity(values, sizes, joints.angles)
