"""The joint velocities that keep the tool on a path, and Newton's method that brings it back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from knotwork.kinematics.chain.joint_ranges import limits_of, middle
from knotwork.kinematics.chain.velocity import joint_scales, solve_velocities
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.waypoints import FloatArray

# The tool is brought back onto the path to within this [m, rad].
ON_PATH = 1e-11
CORRECTIONS = 6


class Pull(NamedTuple):
    """Where self-motion is pulled to.

    Attributes:
        rate: How fast [1/s].
        posture: Joint positions [rad or m], shape (d,).
        most: The norm of velocities, as parts of this, is below 1 [rad/s or m/s], shape (d,).
    """

    rate: float
    posture: FloatArray
    most: FloatArray


class JointField:
    """The joint velocities that follow a path: eq (4), and a pull to the middle of the ranges.

    Args:
        robot: The arm.
        pull: For an arm of more than six joints, how fast self-motion pulls its joints to the
            middle of their ranges [1/s]; or to which posture.
    """

    def __init__(self, robot: Robot, pull: float | Pull = 0.0) -> None:
        self.robot, self.axes, self.scale = robot, joint_axes(robot), joint_scales(robot)
        if isinstance(pull, Pull):
            self.pull, self.middle = np.full(robot.dof, pull.rate), pull.posture
            self.most = pull.most
            return
        self.most = np.full(robot.dof, np.inf)
        limits = limits_of(robot)
        self.pull = np.where(np.isfinite(limits).all(axis=0), pull if robot.dof > 6 else 0.0, 0.0)
        self.pull[robot.virtual] = [one.pull for one in robot.virtual_joints]
        self.middle = middle(limits)

    def velocities(self, q: FloatArray, twist: FloatArray, share: ArrayLike = 1.0) -> FloatArray:
        """Joint velocities [rad/s or m/s], shape (n, d).

        Args:
            q: Joint positions [rad or m], shape (n, d).
            twist: Of the tool, in base axes [m/s, rad/s], shape (n, 6) or (6,).
            share: Part of its full speed that the tool has, so that self-motion rests where the
                tool does; a number, or shape (n,).
        """
        rest = None
        if self.pull.any():
            rest = self.pull * (self.middle - q)
            if np.isfinite(self.most).any():
                beyond = np.linalg.norm(rest / self.most, axis=1, keepdims=True)
                rest = rest / np.sqrt(1.0 + beyond**2)
            rest = np.multiply.outer(share, np.ones(1)) * rest
        return solve_velocities(self.robot, self.axes.jacobians(q), twist, rest)[0]

    def smallest(self, q: FloatArray) -> FloatArray:
        """Smallest singular values, shape (n,); NaN where positions are."""
        known = np.isfinite(q).all(axis=1)
        result = np.full(len(q), np.nan)
        J = self.axes.jacobians(q[known]) * self.scale
        result[known] = np.linalg.svd(J, compute_uv=False)[:, -1]
        return result

    def corrected(
        self, q: FloatArray, position: FloatArray, rotation: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bring the tool to a pose by Newton's method.

        Args:
            q: Joint positions near it [rad or m], shape (n, d).
            position: Of the pose [m], shape (3,) or (n, 3).
            rotation: Of the pose, shape (3, 3) or (n, 3, 3).

        Returns:
            Joint positions, shape (n, d), and the error left [m, rad], shape (n,).
        """
        place = np.broadcast_to(position, (len(q), 3)).T
        target = np.broadcast_to(rotation, (len(q), 3, 3)).transpose(2, 1, 0)
        error = np.full(len(q), np.inf)
        for _ in range(CORRECTIONS):
            tip, turned, J = self.axes.placed(q)
            twist, _, _ = pose_errors(tip, turned, place, target)
            before, error = error, np.abs(twist).max(axis=0)
            # stop where it is on the path, and where rounding lets it come no nearer
            if (error <= ON_PATH).all() or not (error < 0.5 * before).any():
                break
            q = q + solve_velocities(self.robot, J.transpose(2, 0, 1), twist.T)[0]
        return q, error
