"""Configurations of an arm whose poses are known, to search from those that are near."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_ranges import limits_of, starts
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, kept_with
from knotwork.waypoints import FloatArray

TABLE_SIZE = 512
# How many of the table are searched from. More than a few nearest ones share what keeps a search
# from succeeding, such as a limit; then points from everywhere do better.
NEAREST = 2


@kept_with
def _table(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Configurations, and the features of their poses."""
    q = starts(robot, limits_of(robot), TABLE_SIZE)
    tip, rotation, *_ = joint_axes(robot).forward(q)
    return q, np.vstack([(tip**2).sum(axis=0), tip, rotation.reshape(9, -1)])


def seeds(robot: Robot, poses: Sequence[Any]) -> FloatArray:
    """Give configurations whose poses are nearest given poses, the nearest first.

    How far apart poses are is measured by |p − p*|² + |R − R*|²/2, a metre counting as a radian.

    Args:
        robot: The robot.
        poses: Poses of the TCP in the base frame, n of `pin.SE3`.

    Returns:
        Shape (n, 2, d).
    """
    q, features = _table(robot)
    # |p|² − 2 p·p* − tr(RᵀR*): the square above but for what all have in common.
    wanted = np.array(
        [[1.0, *(-2.0 * pose.translation), *-pose.rotation.T.ravel()] for pose in poses]
    )
    apart = wanted @ features
    rows, nearest = np.arange(len(apart)), []
    for _ in range(NEAREST):  # faster than to sort; of equals the first
        nearest.append(apart.argmin(axis=1))
        apart[rows, nearest[-1]] = np.inf
    return np.asarray(q[np.stack(nearest, axis=1)])
