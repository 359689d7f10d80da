"""Proved bounds on how far the tool gets from a point or a rotation, and on how fast it turns."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree
from knotwork.tool_paths.rotations import WIDEST, angle_of, gap_of
from knotwork.trajectory import JointTrajectory
from knotwork.verification.bounds.adaptive import BUDGET, Quantity
from knotwork.verification.bounds.chain import TreeMotion, carried, tree_motion
from knotwork.verification.bounds.result import Bound, checked_limit
from knotwork.verification.bounds.tool import single_bound
from knotwork.waypoints import FloatArray, read_only, rotation_fault


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
    joint, lever = carried(robot.model, robot.require_tool())

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
    if fault := rotation_fault(matrix, 1e-9):
        raise InputError(f"rotation is no rotation matrix: {fault}")
    joint, _ = carried(robot.model, robot.require_tool())
    most = checked_limit(limit, "angle")

    def value(pose: Any, _: Any) -> float:
        return float(np.linalg.norm(pose.rotation - matrix))

    def sizes(moved: TreeMotion) -> FloatArray:
        turning = moved.rotation(joint)
        return np.concatenate((np.full_like(turning[:1], WIDEST), turning))

    gap = math.inf if most >= math.pi else gap_of(most)
    found = _bound(robot, trajectory, value, sizes, gap, budget)
    angle, bound = (float(angle_of(one)) for one in (found.value, found.bound))
    return found._replace(value=angle, bound=bound, limit=limit)


def tool_turning_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    limit: float | None = None,
    budget: int = BUDGET,
) -> Bound:
    """Bound the angular speed of the tool, over all time [rad/s].

    Arguments and errors are those of `tool_distance_bound` without its point, the limit in rad/s.

    >>> plan = kw.plan("ur5_deburring")
    >>> found = kw.verification.tool_turning_bound(plan.space.robot, plan.trajectory, limit=2)
    >>> found.ok, found.proved
    (True, True)
    """
    joint, _ = carried(robot.model, robot.require_tool())

    def value(_: Any, twist: Any) -> float:
        return float(np.linalg.norm(twist.angular))

    def sizes(moved: TreeMotion) -> FloatArray:
        return np.asarray(moved.angular[joint][:3])

    return _bound(robot, trajectory, value, sizes, checked_limit(limit, "angular speed"), budget)


def _bound(
    robot: Robot,
    trajectory: JointTrajectory,
    value: Callable[[Any, Any], float],
    sizes: Callable[[TreeMotion], FloatArray],
    limit: float,
    budget: int,
) -> Bound:
    model, data, frame = robot.model, robot.model.createData(), robot.require_tool()
    joints, base = joint_tree(model), robot.base_placement

    def values(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        found = np.empty((len(q), 1))
        for row, position, rate in zip(found, q, v, strict=True):
            pin.forwardKinematics(model, data, position, rate)
            pose = base.actInv(pin.updateFramePlacement(model, data, frame))
            row[0] = value(pose, pin.getFrameVelocity(model, data, frame, pin.LOCAL))
        return found

    def bounds(rates: FloatArray) -> FloatArray:
        return sizes(tree_motion(joints, rates))[:, None]

    quantity = Quantity(values, bounds, joints.angles)
    return single_bound(robot, trajectory, quantity, limit, budget)
