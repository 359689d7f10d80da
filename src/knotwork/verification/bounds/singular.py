"""A proved lower bound on the smallest singular value of the tool Jacobian."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from knotwork.curves.trajectory import JointTrajectory
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, joint_tree
from knotwork.verification.bounds.adaptive import (
    Bound,
    Quantity,
    checked_limit,
    curve_of,
    upper_bounds,
)
from knotwork.verification.bounds.link_motion import TreeMotion, product, tree_motion
from knotwork.waypoints import FloatArray

VALUE_PRECISION = 1e-2
"""Relative tightness of the bound."""

VALUE_RESOLUTION = 1e-3
"""Absolute tightness of the bound that is always sufficient."""


def singular_value_bound(
    robot: Robot,
    trajectory: JointTrajectory,
    *,
    limit: float | None = None,
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
    >>> robot = plan.space.robot
    >>> nearest = kw.verification.singular_value_bound(robot, plan.trajectory, limit=0.05)
    >>> nearest.ok, nearest.proved
    (True, True)
    """
    allowed = None if limit is None else checked_limit(limit, "smallest singular value")
    limits = np.array([math.inf if allowed is None else -allowed * allowed])
    curve = curve_of(robot, trajectory)
    (worst,) = upper_bounds(curve, _quantity(robot), limits, _precision)
    smallest = math.sqrt(max(-worst.value, 0.0)) if math.isfinite(worst.value) else -worst.value
    return worst._replace(
        value=smallest,
        bound=math.sqrt(max(-worst.bound, 0.0)),
        limit=allowed,
        ok=allowed is None or smallest >= allowed,
    )


def _precision(value: FloatArray, _scale: FloatArray) -> FloatArray:
    smallest = np.sqrt(np.maximum(-value, 0.0))
    step = np.maximum(VALUE_PRECISION * smallest, VALUE_RESOLUTION)
    return np.asarray(np.maximum(smallest**2 - np.maximum(smallest - step, 0.0) ** 2, step**2))


def _quantity(robot: Robot) -> Quantity:
    """Negative square of the smallest singular value, to be maximised.

    Singular values do not depend on the axes. In the axes of the first moving link, the first joint
    does not affect the Jacobian, and its rate does not affect the bounds.
    """
    model, data = robot.model, robot.model.createData()
    frame = robot.require_tool()
    joints = joint_tree(model)
    carrier = model.frames[frame].parentJoint
    distance = float(np.linalg.norm(model.frames[frame].placement.translation))
    first = joints.column[joints.path(carrier)[0]]

    def values(q: FloatArray, _v: FloatArray, _a: FloatArray) -> FloatArray:
        jacobians = np.empty((len(q), 6, q.shape[1]))
        for J, row in zip(jacobians, q, strict=True):
            J[:] = pin.computeFrameJacobian(model, data, row, frame, pin.LOCAL).reshape(J.shape)
        finite = np.isfinite(jacobians.sum(axis=(1, 2)))[:, None, None]
        values = np.linalg.svd(np.where(finite, jacobians, 0.0), compute_uv=False)[:, -1:]
        return np.where(finite[:, 0], -(values**2), np.inf)

    def sizes(rates: FloatArray) -> FloatArray:
        rates = rates.copy()
        rates[:, first] = 0.0
        J = jacobian_sizes(tree_motion(joints, rates), carrier, distance)
        return product(J, J)[:, None]

    return Quantity(values, sizes, joints.angles)


def jacobian_sizes(motion: TreeMotion, carrier: int, distance: float) -> FloatArray:
    """Bound the Frobenius norm of a point's Jacobian and of its first two derivatives.

    The column of a joint is (axis × (point - origin), axis), of a prismatic one (axis, 0).

    Args:
        motion: Bounds on the motion of the links.
        carrier: Joint whose link carries the point.
        distance: Distance of the point from that link's origin [m].

    Returns:
        Bounds, shape (3, n).
    """
    joints: JointTree = motion.tree
    reach = distance * motion.unit[carrier][:3]
    total = np.zeros_like(reach)
    for i in reversed(joints.path(carrier)):
        axis = motion.unit[joints.parent[i]][:3]
        angular = joints.turns[i] * axis
        linear = abs(joints.slides[i]) * axis
        if joints.turns[i]:
            linear = linear + product(angular, reach)
        total += linear**2 + angular**2
        reach = reach + motion.offset[i][:3]
    return np.asarray(np.sqrt(total))
