"""The tool at the waypoints and along the way, from Pinocchio's own forward kinematics."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from knotwork.joint_space import JointSpace
from knotwork.robot import Robot
from knotwork.scenario import ToleranceSet
from knotwork.verification.report import LimitUse, Requirement, Singularity
from knotwork.waypoints import CartesianWaypoint, FloatArray

EFFORT_UNIT = {"rad": "N m", "m": "N"}


def tool_requirements(
    waypoint: CartesianWaypoint,
    robot: Robot,
    q: FloatArray,
    v: FloatArray,
    tolerances: ToleranceSet,
) -> Iterator[Requirement]:
    """Compare the tool's pose and velocity with what a waypoint asks for.

    Args:
        waypoint: What is asked for.
        robot: The arm.
        q: Joint positions at the waypoint's time [rad or m], shape (d,).
        v: Joint velocities [rad/s or m/s], shape (d,).
        tolerances: What error is allowed.
    """
    pose = robot.forward(q)
    twist = robot.twist(q, v)
    turn = float(np.linalg.norm(pin.log3(waypoint.rotation.T @ pose.rotation)))
    asked, found = _quaternion(waypoint.rotation), _quaternion(pose.rotation)
    rows = (
        ("position", waypoint.position, pose.translation, None, "m"),
        ("orientation", asked, found if asked @ found >= 0 else -found, turn, "rad"),
        ("linear_velocity", waypoint.linear, twist.linear, None, "m/s"),
        ("angular_velocity", waypoint.angular, twist.angular, None, "rad/s"),
    )
    for quantity, requested, achieved, distance, unit in rows:
        error = float(np.linalg.norm(achieved - requested)) if distance is None else distance
        tolerance = getattr(tolerances, quantity)
        yield Requirement(
            waypoint.name,
            waypoint.time,
            quantity,
            tuple(requested.tolist()),
            tuple(achieved.tolist()),
            error,
            tolerance,
            unit,
            error <= tolerance,
        )


def _quaternion(rotation: FloatArray) -> FloatArray:
    return np.array(pin.Quaternion(rotation).coeffs())


def smallest_singular_value(robot: Robot, time: FloatArray, q: FloatArray) -> Singularity:
    """Find where sampled configurations come nearest to a singularity of the arm.

    Args:
        robot: The arm.
        time: Sample times [s], shape (n,).
        q: Joint positions [rad or m], shape (n, d).
    """
    jacobians = np.array([robot.jacobian(row) for row in q])
    values = np.linalg.svd(jacobians, compute_uv=False)[:, -1]
    nearest = int(values.argmin())
    return Singularity(float(values[nearest]), float(time[nearest]), len(time))


def effort_use(
    space: JointSpace,
    robot: Robot,
    time: FloatArray,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
) -> Iterator[LimitUse]:
    """Compare joint efforts, by inverse dynamics at sampled times, with their limits.

    Args:
        space: The joints and their limits.
        robot: The arm.
        time: Sample times [s], shape (n,).
        q: Joint positions [rad or m], shape (n, d).
        v: Joint velocities [rad/s or m/s], shape (n, d).
        a: Joint accelerations [rad/s² or m/s²], shape (n, d).
    """
    efforts = np.array([robot.torque(*state) for state in zip(q, v, a, strict=True)])
    worst = np.abs(efforts).argmax(axis=0)
    for i, joint in enumerate(space.joint_names):
        value = float(efforts[worst[i], i])
        limit = float(space.limits["effort"][i])
        given = bool(np.isfinite(limit))
        margin = limit - abs(value)
        yield LimitUse(
            joint,
            "effort",
            value,
            float(np.copysign(limit, value)) if given else None,
            margin if given else None,
            float(time[worst[i]]),
            EFFORT_UNIT[space.joint_units[i]],
            True,
            margin >= 0 if given else True,
        )
