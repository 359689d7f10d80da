"""Utilisation of limits by joint states: of joints, of the tool and of other frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES, JointLimits

if TYPE_CHECKING:
    from knotwork.robot import Robot

EFFORT_ORDER = 2
"""Order of the highest derivative of positions that efforts depend on."""


class LimitedQuantity(NamedTuple):
    """A limited quantity, or another bound of a speed along a path.

    Attributes:
        joint: Name of a joint or a frame; empty for the tool and for other bounds.
        quantity: Name of the quantity or the bound.
        order: Order of the highest derivative of positions in it; 0 for other bounds.
    """

    joint: str
    quantity: str
    order: int = 0


TOOL_SPEED = LimitedQuantity("", "tool speed", 1)


@dataclass(frozen=True, eq=False)
class StateLimits:
    """Limits of joint states, m in total: each magnitude of each joint, then those of frames.

    Attributes:
        joint_names: Names of the joints, length d.
        joints: Their limits.
        robot: The arm with its load; needed for limits of efforts and of frames.
        frames: Limits of the speed or acceleration of links' origins and the tool [m/s or m/s²].
    """

    joint_names: Sequence[str]
    joints: JointLimits
    robot: Robot | None
    frames: Mapping[LimitedQuantity, float]

    @property
    def quantities(self) -> list[LimitedQuantity]:
        """The limited quantities, length m."""
        of_joints = [
            LimitedQuantity(joint, name, JOINT_QUANTITIES[name].order or EFFORT_ORDER)
            for name in MAGNITUDES
            for joint in self.joint_names
        ]
        return [*of_joints, *self.frames]

    def fractions(self, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
        """Quantities divided by their limits, as vectors; those of joints have one component.

        Args:
            q: Joint positions, shape (n, d).
            v: Joint velocities, shape (n, d).
            a: Joint accelerations, shape (n, d).
            j: Joint jerks, shape (n, d).

        Returns:
            Vectors, shape (n, m, 3).
        """
        effort = np.zeros_like(q)
        if self.robot is not None and np.isfinite(self.joints.effort).any():
            import pinocchio as pin

            model, data = self.robot.model, self.robot.data
            effort = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
        of_joints = np.hstack((v, a, j, effort)) / np.hstack(list(self.joints.values()))
        along_axis = of_joints[..., None] * np.array([1.0, 0.0, 0.0])
        return np.concatenate((along_axis, self._of_frames(q, v, a)), axis=1)

    def _of_frames(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        fractions = np.zeros((len(q), len(self.frames), 3))
        if self.robot is None or not self.frames:
            return fractions
        import pinocchio as pin

        robot, axes = self.robot, pin.LOCAL_WORLD_ALIGNED
        read = {1: pin.getFrameVelocity, 2: pin.getFrameClassicalAcceleration}
        frames = [
            robot.frame_index(limited.joint) if limited.joint else robot.require_tool()
            for limited in self.frames
        ]
        for row, state in zip(fractions, zip(q, v, a, strict=True), strict=True):
            pin.forwardKinematics(robot.model, robot.data, *state)
            for k, (limited, limit) in enumerate(self.frames.items()):
                motion = read[limited.order](robot.model, robot.data, frames[k], axes)
                row[k] = motion.linear / limit
        return fractions

    def utilisation(self, curve: PiecewisePolynomial, times: FloatArray) -> FloatArray:
        """Utilisation of each limit by a motion at times of any shape, shape (..., m)."""
        states = (curve(times.ravel(), order) for order in range(4))
        sizes = np.linalg.norm(self.fractions(*states), axis=-1)
        return np.asarray(sizes.reshape(*times.shape, -1))
