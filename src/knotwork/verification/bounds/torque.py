"""Proved bounds on joint torques: their derivatives by Newton's and Euler's laws for every link."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree
from knotwork.verification.bounds.adaptive import Bound, Quantity, curve_of, upper_bounds
from knotwork.verification.bounds.link_motion import TreeMotion, product, tree_motion, unit_bounds
from knotwork.waypoints import FloatArray


def torque_bound(
    robot: Robot, trajectory: JointTrajectory, *, limit: ArrayLike | None = None
) -> tuple[Bound, ...]:
    """Bound every joint's torque (its force, if prismatic) over all time [N m or N].

    Between samples h apart a torque is at most the larger of both plus h²/8 times a bound on its
    second derivative, by Newton's and Euler's laws for every link: see "Proved over all time" in
    the documentation. Gravity, inertias and the inertia of the motors count as in `Robot.torque`.

    Args:
        robot: The arm.
        trajectory: The motion of its joints.
        limit: Upper limit for each joint [N m or N], shape (d,), infinite where there is none; by
            default the robot's `effort_limit`.

    Returns:
        One bound per joint, in the robot's order; without a limit it is tight to 0.1 %.

    Raises:
        InputError: The trajectory is not of the robot's joints, or the limit is not one positive
            number per joint.

    >>> plan = kw.plan("ur5_deburring")
    >>> torque = kw.verification.torque_bound(plan.space.robot, plan.trajectory)
    >>> all(joint.proved and joint.bound < joint.limit for joint in torque)
    True
    """
    fault = f"torque limits are {limit!r}; give {robot.dof} positive numbers, one a joint"
    try:
        limits = np.asarray(robot.effort_limit if limit is None else limit, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(fault) from error
    if limits.shape != (robot.dof,) or not (limits > 0.0).all():
        raise InputError(fault)

    curve, quantity = curve_of(robot, trajectory), torque_quantity(robot.model)
    return upper_bounds(curve, quantity, limits)


class Masses(NamedTuple):
    """Inertias of the links, by joint; entry 0, the base, is not used.

    Attributes:
        mass: Mass [kg].
        lever: Distance of the centre of mass from the joint's origin [m].
        inertia: Largest principal moment of inertia about the centre of mass [kg m²].
        spread: Half the difference of the largest and the smallest moment [kg m²]. Only this part
            of the inertia changes when the link rotates.
        gravity: Gravity [m/s²].
        armature: Reflected inertia of each motor [kg m² or kg], by velocity column.
    """

    mass: tuple[float, ...]
    lever: tuple[float, ...]
    inertia: tuple[float, ...]
    spread: tuple[float, ...]
    gravity: float
    armature: FloatArray


def masses(model: Any) -> Masses:
    """Read inertias from a Pinocchio model."""
    moments = [np.linalg.eigvalsh(inertia.inertia) for inertia in model.inertias]
    return Masses(
        mass=tuple(float(inertia.mass) for inertia in model.inertias),
        lever=tuple(float(np.linalg.norm(inertia.lever)) for inertia in model.inertias),
        inertia=tuple(float(np.abs(values).max()) for values in moments),
        spread=tuple(float(values[-1] - values[0]) / 2.0 for values in moments),
        gravity=float(np.linalg.norm(model.gravity.linear)),
        armature=np.array(model.armature),
    )


def torque_sizes(motion: TreeMotion, bodies: Masses, rates: FloatArray) -> FloatArray:
    """Bound the joint torques and their first two derivatives, shape (3, d, n).

    With c the centre of mass, f and n the force and moment of a joint on its link, both summed from
    the tips to the base (r the offset to a child):

        f = m (c'' - g) + sum of f_child
        n = (I ω)' + (c - o) × m (c'' - g) + sum of n_child + r × f_child
        torque = axis · n + armature q''      (prismatic: axis · f)

    Args:
        motion: Bounds on the motion of the links.
        bodies: Inertias of the links.
        rates: Bounds of |q|, … |q''''|, shape (5, d, n).
    """
    joints = motion.tree
    n = rates.shape[2]
    force = np.zeros((len(joints.parent), 3, n))
    moment = np.zeros_like(force)
    result = bodies.armature[:, None] * rates[2:5]
    for i in range(len(joints.parent) - 1, 0, -1):
        unit, parent = motion.unit[i], joints.parent[i]
        if bodies.mass[i] or bodies.inertia[i]:
            inertial = bodies.mass[i] * motion.point(i, bodies.lever[i])[2:5]
            inertial[0] += bodies.mass[i] * bodies.gravity
            force[i] += inertial
            moment[i] += product(bodies.lever[i] * unit[:3], inertial)
            moment[i] += _spin(motion.angular[i], bodies.inertia[i], bodies.spread[i])
        axis, column = motion.unit[parent][:3], joints.column[i]
        if joints.turns[i]:
            result[:, column] += joints.turns[i] * product(axis, moment[i])
        if joints.slides[i]:
            result[:, column] += abs(joints.slides[i]) * product(axis, force[i])
        force[parent] += force[i]
        moment[parent] += moment[i] + product(motion.offset[i][:3], force[i])
    return result


def _spin(angular: FloatArray, largest: float, spread: float) -> FloatArray:
    """Bound (I ω)' and its first two derivatives."""
    tensor = spread * unit_bounds(angular, 2.0)[:4]
    tensor[0] = largest
    return product(tensor, angular)[1:]


def torque_quantity(model: Any) -> Quantity:
    """Joint torques of a model, by Pinocchio's inverse dynamics (`pin.rnea`)."""
    joints, bodies = joint_tree(model), masses(model)
    data = model.createData()

    def values(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        result = np.empty_like(q)
        for row, state in zip(result, zip(q, v, a, strict=True), strict=True):
            row[:] = pin.rnea(model, data, *state)
        return result

    def sizes(rates: FloatArray) -> FloatArray:
        return torque_sizes(tree_motion(joints, rates), bodies, rates)

    return Quantity(values, sizes, joints.angles, absolute=True)
