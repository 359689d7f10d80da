"""Utilisation of limits by joint states: of joints, of the tool and of other frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.joint_quantities import (
    FRAME_ORDERS,
    MAGNITUDES,
    MOTION_QUANTITIES,
    RATE_QUANTITIES,
    JointLimits,
)
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.robot import Robot

EFFORT_ORDER = 2
"""Order of the highest derivative of positions that efforts depend on."""


class LimitedQuantity(NamedTuple):
    """A limited quantity.

    Attributes:
        subject: Name of a joint or a link; empty for the tool.
        quantity: Name of the quantity.
    """

    subject: str
    quantity: str

    @property
    def order(self) -> int:
        """Order of the highest derivative of positions in it."""
        if self.quantity in MOTION_QUANTITIES:
            return MOTION_QUANTITIES.index(self.quantity)
        return FRAME_ORDERS.get(self.quantity, EFFORT_ORDER)


TOOL_SPEED = LimitedQuantity("", "tool_speed")


@dataclass(frozen=True, eq=False)
class StateLimits:
    """Limits of joint states, m in total: each magnitude of each joint, then those of frames.

    Attributes:
        joint_names: Names of the joints, length d.
        joint_limits: Their limits.
        robot: The arm with its load; needed for limits of efforts and of frames.
        frame_limits: Limits of the speed or acceleration of links' origins and the tool [m/s or
            m/s²].
    """

    joint_names: Sequence[str]
    joint_limits: JointLimits
    robot: Robot | None
    frame_limits: Mapping[LimitedQuantity, float]

    @property
    def quantities(self) -> list[LimitedQuantity]:
        """The limited quantities, length m."""
        of_joints = (
            LimitedQuantity(joint, name) for name in MAGNITUDES for joint in self.joint_names
        )
        return [*of_joints, *self.frame_limits]

    def ratios(self, q: FloatArray, *rates: FloatArray) -> FloatArray:
        """Quantities divided by their limits, as vectors; those of joints have one component.

        Args:
            q: Joint positions, shape (n, d).
            rates: The first of `RATE_QUANTITIES` of the joints, shape (n, d); the others are zero.

        Returns:
            Vectors, shape (n, m, 3).
        """
        values = dict(zip_longest(RATE_QUANTITIES, rates, fillvalue=np.zeros_like(q)))
        states = list(zip(q, values["velocity"], values["acceleration"], strict=True))
        robot = self.robot
        values["effort"] = np.zeros_like(q)
        if robot is not None and np.isfinite(self.joint_limits.effort).any():
            efforts = [pin.rnea(robot.model, robot.data, *state) for state in states]
            values["effort"] = np.array(efforts)
        of_joints = np.hstack([values[name] / self.joint_limits[name] for name in MAGNITUDES])
        ratios = np.zeros((*of_joints.shape, 3))
        ratios[..., 0] = of_joints
        if robot is None or not self.frame_limits:
            return ratios
        of_frames = _rates_of_frames(robot, list(self.frame_limits), states)
        limits = np.array(list(self.frame_limits.values()))
        return np.concatenate((ratios, of_frames / limits[:, None]), axis=1)

    def utilisation(self, curve: PiecewisePolynomial, times: FloatArray) -> FloatArray:
        """Utilisation of each limit by a motion at times of any shape, shape (..., m)."""
        states = (curve(times.ravel(), order) for order in range(len(MOTION_QUANTITIES)))
        sizes = np.linalg.norm(self.ratios(*states), axis=-1)
        return np.asarray(sizes.reshape(*times.shape, -1))


def problem_state_limits(problem: TimingProblem) -> StateLimits:
    """All limits of a timing problem but those of positions."""
    robot = None if problem.dynamics is None else problem.dynamics.robot
    frames = {TOOL_SPEED: problem.tool_speed} if np.isfinite(problem.tool_speed) else {}
    return StateLimits(problem.joint_names, problem.limits, robot, frames)


def _rates_of_frames(
    robot: Robot, frames: Sequence[LimitedQuantity], states: Sequence[Sequence[FloatArray]]
) -> FloatArray:
    """Velocities or accelerations of frames' origins, shape (n, len(frames), 3).

    Args:
        robot: The arm.
        frames: The frames, with the order of their limited rate.
        states: Position, velocity and acceleration of the joints at n times, shape (d,) each.
    """
    readers = {1: pin.getFrameVelocity, 2: pin.getFrameClassicalAcceleration}
    wanted = [
        (
            robot.frame_index(limited.subject) if limited.subject else robot.require_tool(),
            readers[limited.order],
        )
        for limited in frames
    ]
    rates = np.empty((len(states), len(frames), 3))
    for row, state in zip(rates, states, strict=True):
        pin.forwardKinematics(robot.model, robot.data, *state)
        for k, (frame, read) in enumerate(wanted):
            row[k] = read(robot.model, robot.data, frame, pin.LOCAL_WORLD_ALIGNED).linear
    return rates
