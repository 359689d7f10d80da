"""Proved bounds on the motion of the tool or another frame: speed, acceleration, singularities."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.joint_tree import JointTree, joint_tree
from knotwork.robot.many_states import frame_rates
from knotwork.verification.bounds.adaptive import (
    Bound,
    Quantity,
    checked_limit,
    curve_of,
    upper_bounds,
)
from knotwork.verification.bounds.link_motion import TreeMotion, carrier_of, product, tree_motion

SINGULAR_PRECISION = 1e-2
"""Tightness of the bound on a singular value without a limit, relative to the value."""

SINGULAR_RESOLUTION = 1e-3
"""Tightness that is always sufficient: reports call a motion almost singular below this value."""


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
    >>> speed = kw.verification.tool_speed_bound(plan.joints.robot, plan.trajectory, limit=0.25)
    >>> speed.ok, speed.proved
    (True, True)
    """
    return _point_bound(robot, trajectory, frame, 1, checked_limit(limit, "tool speed"))


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
    >>> robot = plan.joints.robot
    >>> found = kw.verification.tool_acceleration_bound(robot, plan.trajectory, limit=1.0)
    >>> found.ok, found.proved, found.value < found.bound < 1.0
    (True, True, True)
    """
    return _point_bound(robot, trajectory, frame, 2, checked_limit(limit, "tool acceleration"))


def speed_quantity(model: Any, frame: int, order: int) -> Quantity:
    """The quantity to bound: speed (order 1) or acceleration (order 2) of a frame's origin."""
    tree, (joint, lever) = joint_tree(model), carrier_of(model, frame)

    def values(*states: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(frame_rates(model, [(frame, order)], *states), axis=2))

    def bounds(rates: FloatArray) -> FloatArray:
        return tree_motion(tree, rates).point(joint, lever)[order : order + 3, None]

    return Quantity(values, bounds, tree.is_angle)


def _point_bound(
    robot: Robot, trajectory: JointTrajectory, frame: str | None, order: int, limit: float
) -> Bound:
    index = robot.require_tool() if frame is None else robot.link_index(frame)
    quantity, limits = speed_quantity(robot.model, index, order), np.array([limit])
    return upper_bounds(curve_of(robot, trajectory), quantity, limits)[0]


def singular_value_bound(
    robot: Robot, trajectory: JointTrajectory, *, limit: float | None = None
) -> Bound:
    """Lower bound of the smallest singular value σ of the tool Jacobian, over all time.

    σ² is the smallest eigenvalue of G = J Jᵀ (Jᵀ J with fewer than six joints). It is a concave
    function of G, so between samples h apart σ² is at least the smaller of both less h²/8 times a
    bound on the second derivative of G: see "Proved over all time" in the documentation.

    Args:
        robot: The arm, with a tool frame.
        trajectory: The motion of its joints.
        limit: Lower limit (metres and radians mixed); without one the bound is tight to 1 % or
            0.001, whichever is more.

    Raises:
        RobotError: No tool frame has been chosen.
        InputError: The trajectory is not of the robot's joints, or the limit isn't positive.

    >>> plan = kw.plan("ur5_deburring")
    >>> robot = plan.joints.robot
    >>> nearest = kw.verification.singular_value_bound(robot, plan.trajectory, limit=0.05)
    >>> nearest.ok, nearest.proved
    (True, True)
    """
    allowed = None if limit is None else checked_limit(limit, "smallest singular value")
    limits = np.array([math.inf if allowed is None else -allowed * allowed])
    curve = curve_of(robot, trajectory)
    (worst,) = upper_bounds(curve, _singularity(robot), limits, _singularity_precision)
    smallest = math.sqrt(max(-worst.value, 0.0)) if math.isfinite(worst.value) else -worst.value
    return worst._replace(
        value=smallest,
        bound=math.sqrt(max(-worst.bound, 0.0)),
        limit=allowed,
        ok=allowed is None or smallest >= allowed,
    )


def _singularity_precision(value: FloatArray, _scale: FloatArray) -> FloatArray:
    smallest = np.sqrt(np.maximum(-value, 0.0))
    step = np.maximum(SINGULAR_PRECISION * smallest, SINGULAR_RESOLUTION)
    return np.asarray(np.maximum(smallest**2 - np.maximum(smallest - step, 0.0) ** 2, step**2))


def _singularity(robot: Robot) -> Quantity:
    """Negative square of the smallest singular value, to be maximised.

    Singular values do not depend on the axes. In the axes of the first moving link, the first joint
    does not affect the Jacobian, and its rate does not affect the bounds.
    """
    tree = joint_tree(robot.model)
    carrier, distance = carrier_of(robot.model, robot.require_tool())
    first = tree.column[tree.chain_to(carrier)[0]]

    def values(q: FloatArray, _v: FloatArray, _a: FloatArray) -> FloatArray:
        jacobians = joint_axes(robot).jacobians(q)
        finite = np.isfinite(jacobians.sum(axis=(1, 2)))[:, None, None]
        values = np.linalg.svd(np.where(finite, jacobians, 0.0), compute_uv=False)[:, -1:]
        return np.where(finite[:, 0], -(values**2), np.inf)

    def rate_bounds(rates: FloatArray) -> FloatArray:
        rates = rates.copy()
        rates[:, first] = 0.0
        J = jacobian_rate_bounds(tree_motion(tree, rates), carrier, distance)
        return product(J, J)[:, None]

    return Quantity(values, rate_bounds, tree.is_angle)


def jacobian_rate_bounds(motion: TreeMotion, carrier: int, distance: float) -> FloatArray:
    """Bound the Frobenius norm of a point's Jacobian and of its first two derivatives.

    The column of a joint is (axis × (point - origin), axis), of a prismatic one (axis, 0).

    Args:
        motion: Bounds on the motion of the links.
        carrier: Joint whose link carries the point.
        distance: Distance of the point from that link's origin [m].

    Returns:
        Bounds, shape (3, n).
    """
    tree: JointTree = motion.tree
    reach = distance * motion.unit[carrier][:3]
    total = np.zeros_like(reach)
    for i in reversed(tree.chain_to(carrier)):
        axis = motion.unit[tree.parent[i]][:3]
        angular = tree.angle_per_unit[i] * axis
        linear = abs(tree.length_per_unit[i]) * axis
        if tree.angle_per_unit[i]:
            linear = linear + product(angular, reach)
        total += linear**2 + angular**2
        reach = reach + motion.offset[i][:3]
    return np.asarray(np.sqrt(total))
