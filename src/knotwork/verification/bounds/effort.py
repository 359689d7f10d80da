"""Proved bounds on joint efforts: their derivatives by Newton's and Euler's laws for every link."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree
from knotwork.robot.many_states import joint_efforts
from knotwork.verification.bounds.adaptive import Bound, Quantity, curve_of, upper_bounds
from knotwork.verification.bounds.link_motion import TreeMotion, product, tree_motion, unit_bounds


def effort_bound(
    robot: Robot, trajectory: JointTrajectory, *, limit: ArrayLike | None = None
) -> tuple[Bound, ...]:
    """Bound every joint's effort over all time: its torque, or its force if prismatic [N m or N].

    Between samples h apart an effort is at most the larger of both plus h²/8 times a bound on its
    second derivative, by Newton's and Euler's laws for every link: see "Proved over all time" in
    the documentation. Gravity, inertias and the inertia of the motors count as in `Robot.effort`.

    Args:
        robot: The arm.
        trajectory: The motion of its joints.
        limit: Upper limit for each joint [N m or N], shape (d,), infinite where there is none; by
            default the robot's.

    Returns:
        One bound per joint, in the robot's order, tight to 0.1 % for a joint without a limit.

    Raises:
        InputError: The trajectory is not of the robot's joints, or the limit is not one positive
            number per joint.

    >>> plan = kw.plan("ur5_deburring")
    >>> efforts = kw.verification.effort_bound(plan.joints.robot, plan.trajectory)
    >>> all(joint.proved and joint.bound < joint.limit for joint in efforts)
    True
    """
    fault = f"effort limits are {limit!r}; accepted: {robot.dof} positive numbers, one per joint"
    try:
        limits = np.asarray(robot.limits.effort if limit is None else limit, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(fault) from error
    if limits.shape != (robot.dof,) or not (limits > 0.0).all():
        raise InputError(fault)

    curve, quantity = curve_of(robot, trajectory), effort_quantity(robot.model)
    return upper_bounds(curve, quantity, limits)


def effort_rate_bounds(motion: TreeMotion, model: Any, rates: FloatArray) -> FloatArray:
    """Bound the joint efforts and their first two derivatives, shape (3, d, n).

    With c the centre of mass, f and n the force and moment of a joint on its link, both summed from
    the tips to the base (r the offset to a child, armature the reflected inertia of the motor):

        f = m (c'' - g) + sum of f_child
        n = (I ω)' + (c - o) × m (c'' - g) + sum of n_child + r × f_child
        effort = axis · n + armature q''      (prismatic: axis · f)

    Args:
        motion: Bounds on the motion of the links.
        model: Pinocchio model with the inertias of the links and motors.
        rates: Bounds of |q|, … |q''''|, shape (5, d, n).
    """
    tree = motion.tree
    n = rates.shape[2]
    force = np.zeros((len(tree.parent), 3, n))
    moment = np.zeros_like(force)
    result = np.asarray(model.armature)[:, None] * rates[2:5]
    for i in range(len(tree.parent) - 1, 0, -1):
        unit, parent = motion.unit[i], tree.parent[i]
        body = model.inertias[i]
        moments = np.linalg.eigvalsh(body.inertia)
        if body.mass or moments.any():
            lever = float(np.linalg.norm(body.lever))
            inertial = body.mass * motion.point(i, lever)[2:5]
            inertial[0] += body.mass * np.linalg.norm(model.gravity.linear)
            force[i] += inertial
            moment[i] += product(lever * unit[:3], inertial)
            moment[i] += _spin(motion.angular[i], moments)
        axis, column = motion.unit[parent][:3], tree.column[i]
        if tree.angle_per_unit[i]:
            result[:, column] += tree.angle_per_unit[i] * product(axis, moment[i])
        if tree.length_per_unit[i]:
            result[:, column] += abs(tree.length_per_unit[i]) * product(axis, force[i])
        force[parent] += force[i]
        moment[parent] += moment[i] + product(motion.offset[i][:3], force[i])
    return result


def _spin(angular: FloatArray, moments: FloatArray) -> FloatArray:
    """Bound (I ω)' and its first two derivatives, from the principal moments of inertia [kg m²].

    The mean moment does not change when the link rotates. Thus only half the difference of the
    largest and the smallest one enters the derivatives of I.
    """
    tensor = np.ptp(moments) / 2.0 * unit_bounds(angular, 2.0)[:4]
    tensor[0] = np.abs(moments).max()
    return product(tensor, angular)[1:]


def effort_quantity(model: Any) -> Quantity:
    """The quantity to bound: joint efforts of a model."""
    tree = joint_tree(model)

    def rate_bounds(rates: FloatArray) -> FloatArray:
        return effort_rate_bounds(tree_motion(tree, rates), model, rates)

    return Quantity(partial(joint_efforts, model), rate_bounds, tree.is_angle, absolute=True)
