"""Inverse kinematics of a velocity (eq 4): the joint velocities for a twist of the tool."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.errors import FastJoint, SingularityError
from knotwork.errors.arguments import require_number
from knotwork.robot import Robot
from knotwork.robot.joint_tree import cache_per_robot
from knotwork.robot.kinematics.chain.joint_ranges import position_limits, range_middles
from knotwork.units import SI, Units

IMPLAUSIBLE_SINGULAR_VALUE = 1e-3
"""Singular value below which the joint velocities are checked against plausible limits.

There a joint at 3 rad/s moves the tool by less than 3 mm/s in the lost direction.
"""
MAX_JOINT_SPEED = 10.0
"""Velocity limit near a singularity for a joint without one [rad/s or m/s].

No joint of an arm is faster.
"""
WELL_CONDITIONED = 1e4
"""Condition number below which Jacobians are inverted.

One correction then reduces the rounding errors to those of a singular value decomposition.
"""
RANK_TOLERANCE = 1e-11
"""Fraction of the largest singular value below which a singular value counts as zero.

It is of this size if a joint is a few 1e-13 rad away from a singularity.
"""


def singular_values(robot: Robot, q: ArrayLike) -> FloatArray:
    """Singular values of the TCP's Jacobian, largest first, shape (min(6, d),).

    One metre counts as one radian.

    >>> robot = kw.load_robot("ur5")
    >>> stretched = np.zeros(6)
    >>> values = kw.kinematics.singular_values(robot, stretched)
    >>> values.shape, bool(values[-1] < 1e-9)
    ((6,), True)

    Args:
        robot: The robot.
        q: Joint positions [rad or m], shape (d,).

    Raises:
        ArrayError: A value is not finite, or an array has a wrong shape.
        RobotError: No tool frame has been chosen.
    """
    values = np.linalg.svd(robot.jacobian(q), compute_uv=False)
    return np.asarray(values, dtype=float)


def smallest_singular_value(robot: Robot, q: ArrayLike) -> float:
    """Smallest of the `singular_values`: zero where the arm is singular.

    >>> robot = kw.load_robot("ur5")
    >>> kw.kinematics.smallest_singular_value(robot, robot.configurations["home"]) > 0.05
    True
    """
    return float(singular_values(robot, q)[-1])


def solve_velocity_ik(
    robot: Robot,
    q: ArrayLike,
    twist: Any,
    *,
    preferred: ArrayLike | None = None,
    waypoint: str = "",
    where: str = "",
    linear_tolerance: float = 1e-9,
    angular_tolerance: float = 1e-9,
    units: Units = SI,
) -> FloatArray:
    """Find the joint velocities that give the TCP a twist: v = J(q)⁺ twist (eq 4).

    For six joints this is J⁻¹ twist; for fewer, the only solution if there is one. For more, it is
    the solution of minimum norm, weighted by the velocity limits: v = W (J W)⁺ twist, where W is
    the diagonal matrix of the limits (Whitney, 1969). `preferred` adds its null-space component W
    (I − (J W)⁺ J W) W⁻¹ v₀. There is no damping, so the result gives the twist exactly.

    Args:
        robot: The robot.
        q: Joint positions [rad or m], shape (d,).
        twist: Linear [m/s], then angular velocity [rad/s] of the TCP, in base axes
            (`local_world_aligned`): `pin.Motion` or shape (6,).
        preferred: Joint velocities v₀ that self-motion approximates [rad/s or m/s], shape (d,),
            for example `pull_to_middle`; by default none.
        waypoint: Name of the waypoint, for errors.
        where: Location of its definition, for errors.
        linear_tolerance: Residual allowed [m/s], for speeds above 1 m/s in proportion.
        angular_tolerance: Residual allowed [rad/s], for speeds above 1 rad/s in proportion.
        units: Units of speeds in errors.

    Returns:
        Joint velocities [rad/s or m/s], shape (d,).

    Raises:
        SingularityError: The twist is unattainable or, close to a singularity, needs joint
            velocities above the arm's limits.
        ArrayError: An array is not finite or has a wrong shape.
        InputError: A tolerance is not positive.

    >>> robot = kw.load_robot("ur5")
    >>> v = kw.solve_velocity_ik(robot, robot.configuration("home"), [0.1, 0, 0, 0, 0, 0])
    >>> robot.twist(robot.configuration("home"), v).linear.round(6) + 0.0
    array([0.1, 0. , 0. ])
    """
    require_number(linear_tolerance, "linear_tolerance", "m/s", positive=True)
    require_number(angular_tolerance, "angular_tolerance", "rad/s", positive=True)
    wanted = checked_array(twist.vector if isinstance(twist, pin.Motion) else twist, (6,), "twist")
    self_motion = None if preferred is None else checked_array(preferred, (robot.dof,), "preferred")
    J = robot.jacobian(q)
    if not wanted.any() and self_motion is None:
        return np.zeros(robot.dof)
    (v,) = solve_velocities(robot, J[None], wanted, self_motion)
    scale = max(1.0, float(np.linalg.norm(wanted)))
    tolerances = linear_tolerance * scale, angular_tolerance * scale
    described = {"waypoint": waypoint, "where": where, "units": units}
    _require_attained(robot, J, v, wanted - J @ v, tolerances, described)
    return np.asarray(v)


def _require_attained(
    robot: Robot,
    J: FloatArray,
    v: FloatArray,
    residual: FloatArray,
    tolerances: tuple[float, float],
    described: Mapping[str, Any],
) -> None:
    """Refuse a twist that is not attained, or only with implausibly fast joints.

    Args:
        robot: The robot.
        J: Jacobian, shape (6, d).
        v: Joint velocities [rad/s or m/s], shape (d,).
        residual: Part of the twist that they do not attain, shape (6,).
        tolerances: Tolerances of its linear and angular norms [m/s, rad/s].
        described: Waypoint, location and units for the error.

    Raises:
        SingularityError: The twist is not attained.
    """
    linear, angular = np.linalg.norm(residual.reshape(2, 3), axis=1).tolist()
    is_attained = linear <= tolerances[0] and angular <= tolerances[1]
    U, s, _ = np.linalg.svd(J, full_matrices=False)
    is_singular = is_attained and s[-1] < IMPLAUSIBLE_SINGULAR_VALUE
    fast = _implausibly_fast_joints(robot, v) if is_singular else []
    if is_attained and not fast:
        return
    raise SingularityError(
        direction=(U[:, -1] if fast else residual).tolist(),
        fast_joints=fast,
        smallest_singular_value=float(s[-1]),
        residual=(linear, angular),
        joint_velocity=dict(zip(robot.joint_names, v.tolist(), strict=True)),
        **described,
    )


def _implausibly_fast_joints(robot: Robot, v: FloatArray) -> list[FastJoint]:
    """The joints with velocities above the plausible ones."""
    joints = zip(
        robot.joint_names, robot.joint_units, np.abs(v).tolist(),
        robot.limits.velocity.tolist(), plausible_speeds(robot).tolist(), strict=True,
    )  # fmt: skip
    rows = (FastJoint(name, f"{unit}/s", *numbers) for name, unit, *numbers in joints)
    return [joint for joint in rows if joint.speed > joint.plausible]


def plausible_speeds(robot: Robot) -> FloatArray:
    """Velocity limits, at most `MAX_JOINT_SPEED` [rad/s or m/s], shape (d,)."""
    return np.minimum(robot.limits.velocity, MAX_JOINT_SPEED)


def solve_velocities(
    robot: Robot,
    J: FloatArray,
    twists: FloatArray,
    preferred: FloatArray | None = None,
    mobility: ArrayLike = 1.0,
) -> FloatArray:
    """Find joint velocities for many configurations at once, as `solve_velocity_ik` does for one.

    Args:
        robot: The robot.
        J: Jacobians, shape (n, 6, d).
        twists: Linear [m/s], then angular velocities [rad/s], in base axes: shape (n, 6) or (6,).
        preferred: Joint velocities that self-motion approximates [rad/s or m/s], shape (d,) or
            (n, d).
        mobility: Factor on each joint's scale, shape (n, d), or a number.

    Returns:
        Velocities [rad/s or m/s], shape (n, d). For more than six joints they have minimum norm,
        weighted by the velocity limits.
    """
    scale = joint_scales(robot) * np.atleast_2d(mobility)
    weighted = J * scale[:, None, :]
    self_motion = (
        np.zeros((1, robot.dof)) if preferred is None else np.atleast_2d(preferred / scale)
    )
    wanted = np.broadcast_to(twists, (len(J), 6))[:, :, None] - weighted @ self_motion[:, :, None]
    inverse = _pseudoinverses(weighted)
    w = inverse @ wanted
    w += inverse @ (wanted - weighted @ w)  # removes most rounding errors
    return np.asarray((self_motion + w[:, :, 0]) * scale)


def _pseudoinverses(J: FloatArray) -> FloatArray:
    """Compute J⁺ of Jacobians (n, 6, d), shape (n, d, 6), which is fast far from singularities."""
    across, singular = J.transpose(0, 2, 1), np.ones(len(J), dtype=bool)
    result = np.empty(across.shape)
    if J.shape[2] >= 6:
        with contextlib.suppress(np.linalg.LinAlgError):
            square = J.shape[2] == 6
            result[:] = np.linalg.inv(J) if square else across @ np.linalg.inv(J @ across)
            # the product bounds the condition number
            size = (J * J).sum(axis=(1, 2)) * (result * result).sum(axis=(1, 2))
            singular = ~(size < WELL_CONDITIONED**2)
    if singular.any():
        result[singular] = np.linalg.pinv(J[singular], rcond=RANK_TOLERANCE)
    return result


def pull_to_middle(robot: Robot, q: ArrayLike, rate: float = 1.0) -> FloatArray:
    """Joint velocities towards the middle of the joints' ranges, for `solve_velocity_ik`.

    >>> robot = kw.load_robot("panda")
    >>> q = robot.configurations["home"]
    >>> wanted = kw.kinematics.pull_to_middle(robot, q, rate=0.5)
    >>> middle = (robot.limits.lower + robot.limits.upper) / 2
    >>> np.allclose(wanted, 0.5 * (middle - q))
    True

    Args:
        robot: The robot.
        q: Joint positions [rad or m], shape (d,).
        rate: Fraction of the distance to the middle per second [1/s].

    Returns:
        Joint velocities [rad/s or m/s], zero for joints without limits, shape (d,).

    Raises:
        ArrayError: A number is not finite, or the array has a wrong shape.
    """
    position = checked_array(q, (robot.dof,), "q")
    pull = checked_array(rate, (), "rate")
    limits = position_limits(robot)
    return np.where(np.isfinite(limits).all(axis=0), pull * (range_middles(limits) - position), 0.0)


@cache_per_robot
def joint_scales(robot: Robot) -> FloatArray:
    """Scale of each joint's velocity in the minimum norm, shape (d,); larger ones move more."""
    if not robot.is_redundant:
        return np.ones(robot.dof)
    limit = robot.limits.velocity
    finite = np.isfinite(limit)
    usual = float(np.mean(limit[finite])) if finite.any() else 1.0
    scales = np.where(finite, limit, usual) / usual
    scales /= robot.weights
    scales[robot.is_virtual] = [joint.mobility for joint in robot.virtual_joints]
    return scales
