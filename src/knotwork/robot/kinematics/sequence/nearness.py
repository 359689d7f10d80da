"""Nearness of configurations to position limits and singularities."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.chain.joint_ranges import Limits, arm_limits

LIMIT_MARGIN = 0.2
"""Distance from a limit below which travel has a higher weight: larger by 1 at 0 [rad or m]."""
SINGULAR_MARGIN = 0.05
"""Singular value below which travel has a higher weight: larger by 1 at a singularity."""


def limit_nearness(q: FloatArray, limits: Limits) -> FloatArray:
    """Nearness of configurations (n, d) to position limits, shape (n,).

    0 outside `LIMIT_MARGIN`, 1 on or beyond a limit, and quadratic between.
    """
    nearest = np.minimum(q - limits[0], limits[1] - q).min(axis=1)
    return np.asarray(np.clip(1.0 - nearest / LIMIT_MARGIN, 0.0, 1.0) ** 2)


def singular_nearness(J: FloatArray) -> FloatArray:
    """Nearness of configurations to singularities, from their Jacobians (n, 6, d), shape (n,).

    0 if the smallest singular value is above `SINGULAR_MARGIN`, 1 if it is zero, quadratic between.
    """
    # The smaller of J Jᵀ and Jᵀ J; its smallest eigenvalue is the square of the singular value.
    gram = J @ J.transpose(0, 2, 1) if J.shape[2] > 6 else J.transpose(0, 2, 1) @ J
    smallest = np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[:, 0], 0.0))
    return np.asarray(np.maximum(0.0, 1.0 - smallest / SINGULAR_MARGIN) ** 2)


def travel_weights(robot: Robot, q: FloatArray) -> FloatArray:
    """Factors on travel at configurations (n, d): above 1 near limits and singularities, (n,)."""
    jacobians = joint_axes(robot).jacobians(q)
    return 1.0 + limit_nearness(q, arm_limits(robot)) + singular_nearness(jacobians)
