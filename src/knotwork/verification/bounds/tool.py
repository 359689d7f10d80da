"""Proved bounds on the motion of the tool or another frame: speed, acceleration, place, angle."""

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
from knotwork.verification.bounds.adaptive import BUDGET, Quantity, maximum
from knotwork.verification.bounds.chain import TreeMotion, carried, tree_motion
from knotwork.verification.bounds.result import Bound, checked_limit, curve_of, upper_bounds
from knotwork.waypoints import FloatArray, read_only, rotation_fault


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
    most = checked_limit(limit, "tool speed")
    quantity = speed_quantity(robot.model, _index(robot, frame), 1)
    return _bound(robot, trajectory, quantity, most, budget)


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
    most = checked_limit(limit, "tool acceleration")
    quantity = speed_quantity(robot.model, _index(robot, frame), 2)
    return _bound(robot, trajectory, quantity, most, budget)


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
    most, base = checked_limit(limit, "distance"), robot.base_placement

    def value(model: Any, data: Any, frame: int) -> float:
        pose = base.actInv(pin.updateFramePlacement(model, data, frame))
        return float(np.linalg.norm(pose.translation - place))

    def sizes(moved: TreeMotion, joint: int, lever: float) -> FloatArray:
        found = moved.point(joint, lever)[:3].copy()
        found[0] += np.linalg.norm(place)
        return found

    quantity = _of_frame(robot.model, robot.require_tool(), value, sizes)
    return _bound(robot, trajectory, quantity, most, budget)


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
    most, base = checked_limit(limit, "angle"), robot.base_placement

    def value(model: Any, data: Any, frame: int) -> float:
        pose = base.actInv(pin.updateFramePlacement(model, data, frame))
        return float(np.linalg.norm(pose.rotation - matrix))

    def sizes(moved: TreeMotion, joint: int, _lever: float) -> FloatArray:
        turning = moved.rotation(joint)
        return np.concatenate((np.full_like(turning[:1], WIDEST), turning))

    gap = math.inf if most >= math.pi else gap_of(most)
    quantity = _of_frame(robot.model, robot.require_tool(), value, sizes)
    found = _bound(robot, trajectory, quantity, gap, budget)
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
    most = checked_limit(limit, "angular speed")

    def value(model: Any, data: Any, frame: int) -> float:
        return float(np.linalg.norm(pin.getFrameVelocity(model, data, frame, pin.LOCAL).angular))

    def sizes(moved: TreeMotion, joint: int, _lever: float) -> FloatArray:
        return np.asarray(moved.angular[joint][:3])

    quantity = _of_frame(robot.model, robot.require_tool(), value, sizes)
    return _bound(robot, trajectory, quantity, most, budget)


def speed_quantity(model: Any, frame: int, order: int) -> Quantity:
    """Speed (order 1) or acceleration (order 2) of a frame's origin."""
    moved: Callable[..., Any] = (
        pin.getFrameVelocity if order == 1 else pin.getFrameClassicalAcceleration
    )

    def value(model: Any, data: Any, frame: int) -> float:
        return float(np.linalg.norm(moved(model, data, frame).linear))

    def sizes(motion: TreeMotion, joint: int, lever: float) -> FloatArray:
        return motion.point(joint, lever)[order : order + 3]

    return _of_frame(model, frame, value, sizes)


def _of_frame(
    model: Any,
    frame: int,
    value: Callable[[Any, Any, int], float],
    sizes: Callable[[TreeMotion, int, float], FloatArray],
) -> Quantity:
    """A quantity of a frame.

    Args:
        model: Pinocchio's.
        frame: Index of the frame.
        value: From model, data after forward kinematics, and the frame.
        sizes: Bounds of the quantity and its first two derivatives, shape (3, n), from how links
            move, the joint that carries the frame and the frame's distance from it [m].
    """
    joints, data, carrier = joint_tree(model), model.createData(), carried(model, frame)

    def values(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        found = np.empty((len(q), 1))
        for row, state in zip(found, zip(q, v, a, strict=True), strict=True):
            pin.forwardKinematics(model, data, *state)
            row[0] = value(model, data, frame)
        return found

    def bounds(rates: FloatArray) -> FloatArray:
        return sizes(tree_motion(joints, rates), *carrier)[:, None]

    return Quantity(values, bounds, joints.angles)


def _index(robot: Robot, frame: str | None) -> int:
    return robot.require_tool() if frame is None else robot.frame_index(frame)


def _bound(
    robot: Robot, trajectory: JointTrajectory, quantity: Quantity, limit: float, budget: int
) -> Bound:
    most = np.array([limit])
    found = maximum(curve_of(robot, trajectory), quantity, most, budget=budget)
    return upper_bounds(found, most)[0]
