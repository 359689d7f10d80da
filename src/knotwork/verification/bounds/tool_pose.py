"""Proved bounds on how far the tool gets from a point or a rotation, and on how fast it turns."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.trajectory import JointTrajectory
from knotwork.verification.bounds.adaptive import BUDGET, Quantity, maximum
from knotwork.verification.bounds.chain import TreeMotion, tree, tree_motion
from knotwork.verification.bounds.result import Bound, checked_limit, curve_of, upper_bounds
from knotwork.verification.bounds.tool import relative_precision
from knotwork.waypoints import FloatArray, read_only


def tool_distance_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    point: ArrayLike,
    *,
    limit: float | None = None,
    budget: int = BUDGET,
) -> Bound:
    """Bound the distance of the tool centre point from a point, over all time [m].

    Args:
        robot: The arm.
        trajectory: The motion of its joints.
        point: In base axes [m], shape (3,).
        limit: Largest distance allowed [m]; without one the bound is made tight to 0.1 %.
        budget: How many evaluations may follow the first 500.

    Raises:
        RobotError: No tool frame has been chosen.
        InputError: The trajectory is not of the robot's joints, or a value is not as it must be.

    >>> plan = kw.plan("ur5_deburring")
    >>> robot = plan.space.robot
    >>> found = kw.verification.tool_distance_bound(robot, plan.trajectory, [0, 0, 0], limit=1.5)
    >>> found.ok, found.proved
    (True, True)
    """
    place = read_only(point, (3,), "point")
    joint, lever = _tool(robot)

    def value(pose: Any, _: Any) -> float:
        return float(np.linalg.norm(pose.translation - place))

    def sizes(moved: TreeMotion) -> FloatArray:
        found = moved.point(joint, lever)[:3].copy()
        found[0] += np.linalg.norm(place)
        return found

    return _bound(robot, trajectory, value, sizes, checked_limit(limit, "distance"), budget)


def tool_angle_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    rotation: ArrayLike,
    *,
    limit: float | None = None,
    budget: int = BUDGET,
) -> Bound:
    """Bound the angle of the tool from a rotation, over all time [rad].

    Two rotations an angle φ apart differ by √8 sin(φ/2) in the Frobenius norm, which is bounded.

    Args:
        robot: The arm.
        trajectory: The motion of its joints.
        rotation: Rotation matrix in base axes, shape (3, 3).
        limit: Largest angle allowed [rad]; without one the bound is made tight to 0.1 %.
        budget: How many evaluations may follow the first 500.

    Raises:
        RobotError: No tool frame has been chosen.
        InputError: The trajectory is not of the robot's joints, or a value is not as it must be.

    >>> plan = kw.plan("ur5_deburring")
    >>> start = plan.space.robot.forward(plan.trajectory.position(0)).rotation
    >>> found = kw.verification.tool_angle_bound(plan.space.robot, plan.trajectory, start)
    >>> found.value <= found.bound < 3.2
    True
    """
    matrix = read_only(rotation, (3, 3), "rotation")
    if np.abs(matrix.T @ matrix - np.eye(3)).max() > 1e-9 or np.linalg.det(matrix) < 0.0:
        raise InputError("rotation is no rotation matrix")
    joint, _ = _tool(robot)
    most = checked_limit(limit, "angle")
    gap = math.inf if most >= math.pi else math.sqrt(8.0) * math.sin(0.5 * most)

    def value(pose: Any, _: Any) -> float:
        return float(np.linalg.norm(pose.rotation - matrix))

    def sizes(moved: TreeMotion) -> FloatArray:
        spin = moved.angular[joint]
        turn = math.sqrt(2.0)
        still = np.full_like(spin[0], math.sqrt(8.0))
        return np.stack((still, turn * spin[0], turn * (spin[1] + spin[0] ** 2)))

    found = _bound(robot, trajectory, value, sizes, gap, budget)
    return replace(
        found, value=_angle(found.value), bound=_angle(found.bound), limit=limit, ok=found.ok
    )


def tool_turning_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    limit: float | None = None,
    budget: int = BUDGET,
) -> Bound:
    """Bound the angular speed of the tool, over all time [rad/s].

    Args:
        robot: The arm.
        trajectory: The motion of its joints.
        limit: Largest angular speed allowed [rad/s]; without one the bound is made tight to 0.1 %.
        budget: How many evaluations may follow the first 500.

    Raises:
        RobotError: No tool frame has been chosen.
        InputError: The trajectory is not of the robot's joints, or a value is not as it must be.

    >>> plan = kw.plan("ur5_deburring")
    >>> found = kw.verification.tool_turning_bound(plan.space.robot, plan.trajectory, limit=2)
    >>> found.ok, found.proved
    (True, True)
    """
    joint, _ = _tool(robot)

    def value(_: Any, twist: Any) -> float:
        return float(np.linalg.norm(twist.angular))

    def sizes(moved: TreeMotion) -> FloatArray:
        return np.asarray(moved.angular[joint][:3])

    return _bound(robot, trajectory, value, sizes, checked_limit(limit, "angular speed"), budget)


def _tool(robot: Robot) -> tuple[int, float]:
    """The joint that carries the tool, and the tool's distance from it [m]."""
    frame = robot.model.frames[robot.require_tool()]
    return int(frame.parentJoint), float(np.linalg.norm(frame.placement.translation))


def _angle(gap: float) -> float:
    return 2.0 * math.asin(min(gap / math.sqrt(8.0), 1.0))


def _bound(
    robot: Robot,
    trajectory: JointTrajectory,
    value: Callable[[Any, Any], float],
    sizes: Callable[[TreeMotion], FloatArray],
    limit: float,
    budget: int,
) -> Bound:
    model, data, frame = robot.model, robot.model.createData(), robot.require_tool()
    joints, most, base = tree(model), np.array([limit]), robot.base_placement

    def values(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        found = np.empty((len(q), 1))
        for row, position, rate in zip(found, q, v, strict=True):
            pin.forwardKinematics(model, data, position, rate)
            pose = base.actInv(pin.updateFramePlacement(model, data, frame))
            row[0] = value(pose, pin.getFrameVelocity(model, data, frame, pin.LOCAL))
        return found

    def bounds(rates: FloatArray) -> FloatArray:
        return sizes(tree_motion(joints, rates))[:, None]

    def precision(found: FloatArray, scale: FloatArray) -> FloatArray:
        return relative_precision(found, scale, most)

    curve = curve_of(robot, trajectory)
    found = maximum(curve, Quantity(values, bounds, joints.angles), most, precision, budget)
    return upper_bounds(found, most)[0]
