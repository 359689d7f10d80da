"""Utilisation of limits by joint states: of joints, of the tool and of other frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

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
from knotwork.robot.many_states import frame_rates, joint_efforts

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
        robot, states = self.robot, (q, values["velocity"], values["acceleration"])
        values["effort"] = np.zeros_like(q)
        if robot is not None and np.isfinite(self.joint_limits.effort).any():
            values["effort"] = joint_efforts(robot.model, *states)
        of_joints = np.hstack([values[name] / self.joint_limits[name] for name in MAGNITUDES])
        ratios = np.zeros((*of_joints.shape, 3))
        ratios[..., 0] = of_joints
        if robot is None or not self.frame_limits:
            return ratios
        frames = [
            (robot.link_index(x.subject) if x.subject else robot.require_tool(), x.order)
            for x in self.frame_limits
        ]
        limits = np.array([*self.frame_limits.values()])
        of_frames = frame_rates(robot.model, frames, *states) / limits[:, None]
        return np.concatenate((ratios, of_frames), axis=1)

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
