"""Inverse kinematics of a velocity (eq 4): the joint velocities that give the tool its twist."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.errors import SingularityError
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray, read_only

# Below this singular value a joint at 3 rad/s moves the tool by less than 3 mm/s in the lost
# direction: no arm is used there, and the joint velocities found are worth a second look.
NEAR_SINGULAR = 1e-3
# Singular values below this part of the largest are taken for rounding of zero: a joint rotated
# by a few times 1e-13 rad off a singularity has one of that size.
RANK_TOLERANCE = 1e-11


def singular_values(robot: Robot, q: ArrayLike) -> FloatArray:
    """Singular values of the TCP's Jacobian, largest first, shape (min(6, d),).

    Metres and radians are taken as they are: one metre counts as one radian.

    Args:
        robot: The robot.
        q: Joint positions [rad or m], shape (d,).
    """
    values = np.linalg.svd(robot.jacobian(q), compute_uv=False)
    return np.asarray(values, dtype=float)


def smallest_singular_value(robot: Robot, q: ArrayLike) -> float:
    """Smallest singular value of the TCP's Jacobian: zero where the arm is singular."""
    return float(singular_values(robot, q)[-1])


def solve_velocity_ik(
    robot: Robot,
    q: ArrayLike,
    twist: Any,
    *,
    waypoint: str = "",
    where: str = "",
    linear_tolerance: float = 1e-9,
    angular_tolerance: float = 1e-9,
) -> FloatArray:
    """Find the joint velocities that give the TCP a twist: v = J(q)⁺ twist (eq 4).

    For six joints that is J⁻¹ twist; for more, the smallest joint velocities that do it; for
    fewer, the only ones if there are any. Nothing is damped: what is returned gives the twist.

    Args:
        robot: The robot.
        q: Joint positions [rad or m], shape (d,).
        twist: Linear [m/s], then angular velocity [rad/s] of the TCP, in base axes
            (`local_world_aligned`): `pin.Motion` or shape (6,).
        waypoint: Name of the waypoint, for errors.
        where: Where it is defined, for errors.
        linear_tolerance: Residual allowed [m/s], for speeds above 1 m/s in proportion.
        angular_tolerance: Residual allowed [rad/s], for speeds above 1 rad/s in proportion.

    Returns:
        Joint velocities [rad/s or m/s], shape (d,).

    Raises:
        SingularityError: No joint velocities give the twist, or, close to a singularity, only
            such as exceed the arm's velocity limits.
        WaypointDataError: An array is not finite or of another shape.
    """
    wanted = read_only(twist.vector if isinstance(twist, pin.Motion) else twist, (6,), "twist")
    J = robot.jacobian(q)
    if not wanted.any():
        return np.zeros(robot.dof)
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    kept = s > RANK_TOLERANCE * s[0]
    v: FloatArray = Vt[kept].T @ ((U[:, kept].T @ wanted) / s[kept])
    v = v + Vt[kept].T @ ((U[:, kept].T @ (wanted - J @ v)) / s[kept])  # undo most rounding
    residual = wanted - J @ v
    linear, angular = float(np.linalg.norm(residual[:3])), float(np.linalg.norm(residual[3:]))
    scale = max(1.0, float(np.linalg.norm(wanted)))
    if linear > linear_tolerance * scale or angular > angular_tolerance * scale:
        message = _unattainable(robot, J, residual)
    elif s[-1] < NEAR_SINGULAR and (np.abs(v) > robot.velocity_limit).any():
        message = _too_fast(robot, U[:, -1], s[-1], v)
    else:
        return v
    raise SingularityError(
        waypoint,
        message,
        smallest_singular_value=float(s[-1]),
        residual=(linear, angular),
        joint_velocity=dict(zip(robot.joint_names, v.tolist(), strict=True)),
        where=where,
    )


def _unattainable(robot: Robot, J: FloatArray, residual: FloatArray) -> str:
    """Message for a twist outside the Jacobian's range, with the part of it that is."""
    linear, angular = np.linalg.norm(residual[:3]), np.linalg.norm(residual[3:])
    smallest = np.linalg.svd(J, compute_uv=False)[-1]
    left = (
        f"{linear:.3g} m/s and {angular:.3g} rad/s of it are left over, "
        f"{describe_direction(residual)}"
    )
    if robot.dof < 6 and smallest > NEAR_SINGULAR:
        return (
            f"an arm of {robot.dof} joints can't give the tool this velocity: {left} (smallest "
            f"singular value {smallest:.3g})"
        )
    return (
        f"the arm is singular here (smallest singular value {smallest:.3g}) and can't give the "
        f"tool this velocity: {left}"
    )


def _too_fast(robot: Robot, direction: FloatArray, smallest: float, v: FloatArray) -> str:
    limits = robot.velocity_limit
    said = ", ".join(
        f"{robot.joint_names[i]} at {abs(v[i]):.4g} {robot.joint_units[i]}/s "
        f"(limit {limits[i]:.4g})"
        for i in np.flatnonzero(np.abs(v) > limits)
    )
    return (
        f"the arm is close to a singularity (smallest singular value {smallest:.3g}, "
        f"{describe_direction(direction)}) and would need {said}"
    )


def describe_direction(twist: FloatArray) -> str:
    """Say in words along and about which base axes a twist goes, for example `along z`.

    Args:
        twist: Linear [m/s], then angular [rad/s], shape (6,); its size does not matter.
    """
    parts = []
    for verb, vector in (("along", twist[:3]), ("about", twist[3:])):
        norm = float(np.linalg.norm(vector))
        if norm < 1e-3 * float(np.linalg.norm(twist)):
            continue
        unit = vector / norm
        axis = int(np.argmax(np.abs(unit)))
        if abs(unit[axis]) > 0.999:
            parts.append(f"{verb} {'xyz'[axis]}")
        else:
            values = ", ".join(f"{value + 0.0:.2f}" for value in unit)
            parts.append(f"{verb} ({values})")
    return f"{' and '.join(parts)} of the base frame"
