"""How near limits and singularities configurations are."""

from __future__ import annotations

import numpy as np

from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import FloatArray

# Nearer than this to a limit [rad or m] or with a singular value below, travel counts for more, up
# to twice as much on a limit, and likewise on a singularity.
LIMIT_MARGIN = 0.2
SINGULAR_MARGIN = 0.05


def limit_nearness(robot: Robot, q: FloatArray) -> FloatArray:
    """How near configurations (n, d) are to position limits, shape (n,).

    0 far, 1 on or beyond one: the square of how much of `LIMIT_MARGIN` is used up. Virtual joints,
    which nothing moves, do not count.
    """
    room = np.minimum(q - robot.lower_position_limit, robot.upper_position_limit - q)
    nearest = room[:, ~robot.virtual].min(axis=1)
    return np.asarray(np.clip(1.0 - nearest / LIMIT_MARGIN, 0.0, 1.0) ** 2)


def singular_nearness(J: FloatArray) -> FloatArray:
    """How near configurations of Jacobians (n, 6, d) are to singularities, shape (n,).

    0 far, 1 on one: the square of how far below `SINGULAR_MARGIN` the smallest singular value is.
    """
    # Of J Jᵀ or Jᵀ J the smaller; its smallest eigenvalue is the square of what is asked for.
    gram = J @ J.transpose(0, 2, 1) if J.shape[2] > 6 else J.transpose(0, 2, 1) @ J
    smallest = np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[:, 0], 0.0))
    return np.asarray(np.maximum(0.0, 1.0 - smallest / SINGULAR_MARGIN) ** 2)


def weights(robot: Robot, q: FloatArray, J: FloatArray | None = None) -> FloatArray:
    """Factor of the travel at configurations (n, d): 1, and more near limits and singularities.

    Their Jacobians (n, 6, d) are taken where they are given.
    """
    J = joint_axes(robot).jacobians(q) if J is None else J
    return 1.0 + limit_nearness(robot, q) + singular_nearness(J)
