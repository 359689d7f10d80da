"""Joint velocities that keep the tool on a path, and Newton's method that projects back onto it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.tool_paths import TimedPath
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.robot.kinematics.chain.joint_ranges import position_limits, range_middles
from knotwork.robot.kinematics.chain.velocity import joint_scales, solve_velocities

PROJECTION_TOLERANCE = 1e-11
"""Tolerance of the projection onto the path [m, rad]."""
PROJECTION_ROUNDS = 6
"""Maximum number of Newton steps of the projection."""


GUIDE_RATE = 8.0
"""Exponent n: over the whole path, self-motion approaches its guide by a factor of e⁻ⁿ."""


SLOWING_RANGE = 0.95
"""Fraction of the range of a virtual joint that slows, beyond which its mobility is minimal."""
MIN_MOBILITY = 8e-9
"""Minimum mobility of virtual joints that slow at their limits."""


class Guide(NamedTuple):
    """A curve of postures that self-motion follows along a path.

    Attributes:
        postures: Joint positions [rad or m] over arc length [m], twice continuously differentiable.
    """

    postures: PiecewisePolynomial

    def posture(self, s: ArrayLike, nu: int = 0) -> FloatArray:
        """Postures at arc lengths, or their derivatives, shape (..., d)."""
        x = self.postures.x
        return np.asarray(self.postures(np.clip(s, x[0], x[-1]), nu))

    def offset(self, turns: FloatArray) -> Guide:
        """The guide with each joint turned by an angle [rad], shape (d,)."""
        c = self.postures.c.copy()
        c[-1] += turns
        return Guide(PiecewisePolynomial(c, self.postures.x))

    def rate(self, s: ArrayLike, q: FloatArray, nu: int = 0) -> FloatArray:
        """Joint motion per length of the path that follows the guide, or its derivative over s."""
        x = self.postures.x
        off = self.posture(s, nu) - (0.0 if nu else q)
        return np.asarray(self.posture(s, nu + 1) + GUIDE_RATE / (x[-1] - x[0]) * off)


SelfMotionTarget = float | Guide


class JointField:
    """Joint velocities that follow a path (eq 4), with a target for self-motion.

    Args:
        robot: The arm.
        target: Target of the self-motion, for an arm of more than six joints: a guide to follow, or
            the rate at which joints move to the middle of their ranges [1/s].
        speed: The full speed of the path [m/s].
    """

    def __init__(self, robot: Robot, target: SelfMotionTarget = 0.0, speed: float = 1.0) -> None:
        self.robot, self.axes, self.scale = robot, joint_axes(robot), joint_scales(robot)
        self.speed = speed
        self.guide = target if isinstance(target, Guide) else None
        limits = position_limits(robot)
        rate = 0.0 if isinstance(target, Guide) or not robot.is_redundant else target
        self.rates_to_middle = np.where(np.isfinite(limits).all(axis=0), rate, 0.0)
        self.middle = range_middles(limits)
        span = np.full(robot.dof, np.inf)
        for joint, virtual in enumerate(
            robot.virtual_joints, robot.dof - len(robot.virtual_joints)
        ):
            span[joint] = virtual.upper - virtual.lower if virtual.slows_at_limits else np.inf
        self.slows = bool(np.isfinite(span).any())
        self.per_slowing_distance = 2.0 / (SLOWING_RANGE * span)  # from the middle of the range

    def velocities(
        self,
        q: FloatArray,
        twist: FloatArray,
        speed_fraction: ArrayLike = 1.0,
        arc_length: ArrayLike = 0.0,
    ) -> FloatArray:
        """Joint velocities [rad/s or m/s], shape (n, d).

        Args:
            q: Joint positions [rad or m], shape (n, d).
            twist: Twist of the tool in base axes [m/s, rad/s], shape (n, 6) or (6,).
            speed_fraction: Speed of the tool relative to its full speed, a number or shape (n,). It
                makes self-motion stop with the tool.
            arc_length: Arc length [m], a number or shape (n,).
        """
        return self._solve(q, twist, self._self_motion(q, speed_fraction, arc_length))

    def accelerations_at_fixed_joints(
        self,
        q: FloatArray,
        twist_rate: FloatArray,
        speed: FloatArray,
        tangential_acceleration: FloatArray,
        arc_length: FloatArray,
    ) -> FloatArray:
        """Derivative of the velocities over time at constant q [rad/s² or m/s²], shape (n, d).

        Velocities are linear in the twist and in self-motion, so this is their solution for the
        derivatives of both.

        Args:
            q: Joint positions [rad or m], shape (n, d).
            twist_rate: Derivative of the twist of the tool [m/s², rad/s²], shape (n, 6).
            speed: Speed of the tool [m/s], shape (n,).
            tangential_acceleration: Derivative of the speed [m/s²], shape (n,).
            arc_length: Arc length [m], shape (n,).
        """
        change = self._self_motion(q, tangential_acceleration / self.speed, arc_length)
        if change is not None and self.guide is not None:
            change = change + _to_column(speed**2) * self.guide.rate(arc_length, q, 1)
        return self._solve(q, twist_rate, change)

    def _self_motion(
        self, q: FloatArray, speed_fraction: ArrayLike, arc_length: ArrayLike
    ) -> FloatArray | None:
        """Joint velocities that self-motion approximates, shape (n, d), or `None` without any."""
        if self.guide is not None:
            return _to_column(speed_fraction) * self.speed * self.guide.rate(arc_length, q)
        if self.rates_to_middle.any():
            return _to_column(speed_fraction) * self.rates_to_middle * (self.middle - q)
        return None

    def _solve(
        self, q: FloatArray, twist: FloatArray, self_motion: FloatArray | None
    ) -> FloatArray:
        J, mobility = self.axes.jacobians(q), self._mobility(q)
        return solve_velocities(self.robot, J, twist, self_motion, mobility)

    def _mobility(self, q: FloatArray) -> ArrayLike:
        """Mobility of the joints: that of virtual ones may decrease towards their limits."""
        if not self.slows:
            return 1.0
        decrease = ((q - self.middle) * self.per_slowing_distance) ** 4
        return np.asarray(np.maximum(np.maximum(1.0 - decrease, 0.0) ** 3, MIN_MOBILITY))

    def arc_lengths(self, path: TimedPath, time: FloatArray) -> FloatArray:
        """Arc lengths at times [m], shape (k,); zeros where nothing depends on them."""
        return np.zeros(time.shape) if self.guide is None else path.arc_length(time)

    def smallest_singular_values(self, q: FloatArray) -> FloatArray:
        """Smallest singular values, shape (n,). They are NaN where positions are NaN."""
        finite = np.isfinite(q).all(axis=1)
        result = np.full(len(q), np.nan)
        J = self.axes.jacobians(q[finite]) * self.scale
        result[finite] = np.linalg.svd(J, compute_uv=False)[:, -1]
        return result

    def project(
        self, q: FloatArray, position: FloatArray, rotation: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bring the tool to a pose by Newton's method.

        Args:
            q: Joint positions near the pose [rad or m], shape (n, d).
            position: Position of the pose [m], shape (3,) or (n, 3).
            rotation: Rotation of the pose, shape (3, 3) or (n, 3, 3).

        Returns:
            Joint positions, shape (n, d), and the remaining error [m, rad], shape (n,).
        """
        goal = np.broadcast_to(position, (len(q), 3)).T
        target = np.broadcast_to(rotation, (len(q), 3, 3)).transpose(2, 1, 0)
        error = np.full(len(q), np.inf)
        for _ in range(PROJECTION_ROUNDS):
            tip, turned, J = self.axes.compute_poses_and_jacobians(q)
            twist, _, _ = pose_errors(tip, turned, goal, target)
            before, error = error, np.abs(twist).max(axis=0)
            # end on the path, or where rounding prevents progress
            if (error <= PROJECTION_TOLERANCE).all() or not (error < 0.5 * before).any():
                break
            J = J.transpose(2, 0, 1)
            q = q + solve_velocities(self.robot, J, twist.T, mobility=self._mobility(q))
        return q, error


def _to_column(value: ArrayLike) -> FloatArray:
    """Write a number, or one for each configuration, as a column."""
    return np.asarray(value, dtype=float)[..., np.newaxis]
