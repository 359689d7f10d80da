"""Utilisation of limits by joint states: of joints, of the tool and of other frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES, JointLimits
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.robot import Robot

EFFORT_ORDER = 2
"""Order of the highest derivative of positions that efforts depend on."""


class LimitedQuantity(NamedTuple):
    """A limited quantity, or another bound of a speed along a path.

    Attributes:
        subject: Name of a joint or a frame; empty for the tool and for other bounds.
        quantity: Name of the quantity or the bound.
        order: Order of the highest derivative of positions in it; 0 for other bounds.
    """

    subject: str
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
        robot = self.robot
        effort = np.zeros_like(q)
        if robot is not None and np.isfinite(self.joints.effort).any():
            states = zip(q, v, a, strict=True)
            effort = np.array([pin.rnea(robot.model, robot.data, *state) for state in states])
        limits = np.hstack([self.joints[name] for name in MAGNITUDES])
        fractions = np.zeros((len(q), len(limits) + len(self.frames), 3))
        fractions[:, : len(limits), 0] = np.hstack((v, a, j, effort)) / limits
        if robot is not None:
            for k, (limited, limit) in enumerate(self.frames.items(), len(limits)):
                fractions[:, k] = _rates_of_frame(robot, limited, q, v, a) / limit
        return fractions

    def utilisation(self, curve: PiecewisePolynomial, times: FloatArray) -> FloatArray:
        """Utilisation of each limit by a motion at times of any shape, shape (..., m)."""
        states = (curve(times.ravel(), order) for order in range(4))
        sizes = np.linalg.norm(self.fractions(*states), axis=-1)
        return np.asarray(sizes.reshape(*times.shape, -1))


def limits_of(problem: TimingProblem) -> StateLimits:
    """All limits of a timing problem but those of positions."""
    robot = None if problem.dynamics is None else problem.dynamics.robot
    frames = {TOOL_SPEED: problem.tool_speed} if np.isfinite(problem.tool_speed) else {}
    return StateLimits(problem.joint_names, problem.limits, robot, frames)


def _rates_of_frame(
    robot: Robot, limited: LimitedQuantity, q: FloatArray, v: FloatArray, a: FloatArray
) -> FloatArray:
    """Velocities or accelerations of a frame's origin, shape (n, 3)."""
    frame = robot.frame_index(limited.subject) if limited.subject else robot.require_tool()
    read = pin.getFrameVelocity if limited.order == 1 else pin.getFrameClassicalAcceleration
    rates = np.empty((len(q), 3))
    for row, state in zip(rates, zip(q, v, a, strict=True), strict=True):
        pin.forwardKinematics(robot.model, robot.data, *state)
        row[:] = read(robot.model, robot.data, frame, pin.LOCAL_WORLD_ALIGNED).linear
    return rates
