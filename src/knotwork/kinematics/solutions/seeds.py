"""Configurations of an arm whose poses are known, to search from those that are near."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from knotwork.kinematics.chain.joint_ranges import low_discrepancy, search_box
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# Making the table takes some milliseconds, once for an arm.
TABLE_SIZE = 512
# How many of the table are searched from. More than a few nearest ones share what keeps a search
# from succeeding, such as a limit; then points from everywhere do better.
NEAREST = 2

_tables: WeakKeyDictionary[Robot, tuple[FloatArray, FloatArray]] = WeakKeyDictionary()


def seeds(robot: Robot, poses: Sequence[Any]) -> FloatArray:
    """Give configurations whose poses are nearest given poses, the nearest first.

    How far apart poses are is measured by |p − p*|² + |R − R*|²/2, a metre counting as a radian.

    Args:
        robot: The robot.
        poses: Poses of the TCP in the base frame, n of `pin.SE3`.

    Returns:
        Shape (n, 2, d).
    """
    if robot not in _tables:
        _tables[robot] = _table(robot)
    q, features = _tables[robot]
    # |p|² − 2 p·p* − tr(RᵀR*): the square above but for what all have in common.
    wanted = np.array(
        [[1.0, *(-2.0 * pose.translation), *-pose.rotation.ravel()] for pose in poses]
    )
    apart = wanted @ features.T
    rows, nearest = np.arange(len(apart)), []
    for _ in range(NEAREST):  # faster than to sort; of equals the first
        nearest.append(apart.argmin(axis=1))
        apart[rows, nearest[-1]] = np.inf
    return np.asarray(q[np.stack(nearest, axis=1)])


def _table(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Configurations, shape (k, d), and of their poses |p|², p and R, shape (k, 13)."""
    points = low_discrepancy(robot.dof)
    corner, opposite = search_box(robot, np.zeros(robot.dof), np.inf)
    q = np.array([corner + next(points) * (opposite - corner) for _ in range(TABLE_SIZE)])
    features = np.empty((TABLE_SIZE, 13))
    for row, configuration in zip(features, q, strict=True):
        pose = robot.forward(configuration)
        row[0] = pose.translation.dot(pose.translation)
        row[1:4] = pose.translation
        row[4:] = pose.rotation.ravel()
    return q, features
