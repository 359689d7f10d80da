"""The joint velocities that keep the tool on a path, and Newton's method that brings it back."""

from __future__ import annotations

import contextlib

import numpy as np
from numpy.typing import ArrayLike

from knotwork.kinematics.chain.joint_ranges import limits_of, middle
from knotwork.kinematics.chain.velocity import joint_scales
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.waypoints import FloatArray

# The tool is brought back onto the path to within this [m, rad].
ON_PATH = 1e-11
CORRECTIONS = 6
# A square Jacobian is inverted where its condition number is below this.
WELL_CONDITIONED = 1e7


class JointField:
    """The joint velocities that follow a path: eq (4), and a pull to the middle of the ranges.

    Args:
        robot: The arm.
        pull: For an arm of more than six joints, how fast self-motion pulls its joints to the
            middle of their ranges [1/s].
    """

    def __init__(self, robot: Robot, pull: float = 0.0) -> None:
        self.axes, self.scale = joint_axes(robot), joint_scales(robot)
        limits = limits_of(robot)
        self.pull = np.where(np.isfinite(limits).all(axis=0), pull, 0.0)
        self.middle = middle(limits)

    def velocities(self, q: FloatArray, twist: FloatArray, share: ArrayLike = 1.0) -> FloatArray:
        """Joint velocities [rad/s or m/s], shape (n, d).

        Args:
            q: Joint positions [rad or m], shape (n, d).
            twist: Of the tool, in base axes [m/s, rad/s], shape (n, 6) or (6,).
            share: Part of its full speed that the tool has, so that self-motion rests where the
                tool does; a number, or shape (n,).
        """
        J = self.axes.jacobians(q) * self.scale
        w, across = _solved(J, np.broadcast_to(twist, (len(q), 6)))
        if across is not None and self.pull.any():
            free = np.multiply.outer(np.asarray(share), np.ones(1)) * self.pull
            free = free * (self.middle - q) / self.scale
            w += free - np.einsum("nkd,nk->nd", across, np.einsum("nkd,nd->nk", across, free))
        return np.asarray(w * self.scale)

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
            q = q + _solved(J.transpose(2, 0, 1) * self.scale, twist.T)[0] * self.scale
        return q, error


def _solved(J: FloatArray, twist: FloatArray) -> tuple[FloatArray, FloatArray | None]:
    """Least joint velocities for twists, shape (n, d), and a basis of what moves the tool.

    The basis is `None` where each Jacobian is square and far from singular: all joints move it.
    """
    if J.shape[1] == J.shape[2]:
        with contextlib.suppress(np.linalg.LinAlgError):
            inverse = np.linalg.inv(J)
            # the product bounds the condition number
            size = (J * J).sum(axis=(1, 2)) * (inverse * inverse).sum(axis=(1, 2))
            if (size < WELL_CONDITIONED**2).all():
                return (inverse @ twist[:, :, None])[:, :, 0], None
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    part = np.einsum("nik,ni->nk", U, twist)
    part *= np.where(s > 1e-12 * s[:, :1], 1.0 / np.maximum(s, 1e-300), 0.0)
    return np.einsum("nkd,nk->nd", Vt, part), Vt
