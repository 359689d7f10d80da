"""Utilisation of limits by joint states: of joints, of the tool and of other frames."""

from __future__ import annotations

from collections.abc import Sequence
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


class LimitName(NamedTuple):
    """Name of a limit, or of another bound of a speed along a path.

    Attributes:
        joint: Name of a joint or a frame; empty for the tool and for other bounds.
        quantity: Limited quantity, or name of the bound.
    """

    joint: str
    quantity: str


class FrameLimit(NamedTuple):
    """Limit of the speed or the acceleration of a frame's origin.

    Attributes:
        frame: Name of a link; empty for the tool.
        quantity: Name of the limited quantity.
        order: 1 for a speed, 2 for an acceleration.
        limit: The limit [m/s or m/s²].
    """

    frame: str
    quantity: str
    order: int
    limit: float


@dataclass(frozen=True, eq=False)
class StateLimits:
    """Limits of joint states, m in total: each magnitude of each joint, then those of frames.

    Attributes:
        joint_names: Names of the joints, length d.
        joints: Their limits.
        robot: The arm with its load; needed for limits of efforts and of frames.
        frames: Limits of frames.
    """

    joint_names: Sequence[str]
    joints: JointLimits
    robot: Robot | None
    frames: Sequence[FrameLimit] = ()

    @property
    def names(self) -> list[LimitName]:
        """Names of the limits, length m."""
        of_joints = [LimitName(joint, name) for name in MAGNITUDES for joint in self.joint_names]
        return of_joints + [LimitName(limit.frame, limit.quantity) for limit in self.frames]

    @property
    def orders(self) -> FloatArray:
        """Order of the highest derivative of positions in each quantity, shape (m,)."""
        of_joints = [JOINT_QUANTITIES[name].order or EFFORT_ORDER for name in MAGNITUDES]
        of_frames = [limit.order for limit in self.frames]
        return np.append(np.repeat(of_joints, len(self.joint_names)), of_frames)

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
        quantities = [
            (
                robot.frame_index(limit.frame) if limit.frame else robot.require_tool(),
                pin.getFrameVelocity if limit.order == 1 else pin.getFrameClassicalAcceleration,
                limit.limit,
            )
            for limit in self.frames
        ]
        for row, state in zip(fractions, zip(q, v, a, strict=True), strict=True):
            pin.forwardKinematics(robot.model, robot.data, *state)
            for k, (frame, read, limit) in enumerate(quantities):
                row[k] = read(robot.model, robot.data, frame, axes).linear / limit
        return fractions

    def utilisation(self, *states: FloatArray) -> FloatArray:
        """Utilisation of each limit, shape (n, m), by states as for `fractions`."""
        return np.asarray(np.linalg.norm(self.fractions(*states), axis=-1))

    def motion_utilisation(self, curve: PiecewisePolynomial, times: FloatArray) -> FloatArray:
        """Utilisation of each limit by a motion at times of any shape, shape (..., m)."""
        states = (curve(times.ravel(), order) for order in range(4))
        return self.utilisation(*states).reshape(*times.shape, -1)
