"""Self-motion of a redundant arm: null-space steps, and the configuration nearest another."""

from __future__ import annotations

import numpy as np
from eigenpy import LDLT  # type: ignore[import-untyped]

from knotwork.arrays import FloatArray
from knotwork.robot.kinematics.chain.joint_ranges import (
    Limits,
    clip_to_limits,
    find_blocked_joints,
    position_limits,
)
from knotwork.robot.kinematics.chain.levenberg_marquardt import PoseSearch, SearchBudget

MAX_NULL_SPACE_STEPS = 30
MIN_STEP = 1e-6
"""Shorter steps end the motion [rad or m]."""
CORRECTION = SearchBudget(iterations=12)
"""Maximum effort of the correction back onto the pose after a null-space step."""


def minimise_by_self_motion(
    search: PoseSearch,
    q: FloatArray,
    near: FloatArray,
    smallest_step: float = MIN_STEP,
    scale: FloatArray | None = None,
) -> tuple[FloatArray, int]:
    """Minimise |W⁻¹(q − near)| over the configurations with the same pose, starting from one.

    This is null-space refinement. Each step is along W(I − (JW)⁺JW) W⁻¹(near − q), which keeps the
    pose to first order. A correction back onto the pose follows.

    Args:
        search: The pose, and the robot.
        q: A solution, shape (d,).
        near: Preferred configuration, shape (d,).
        smallest_step: Length of a step below which the motion ends [rad or m].
        scale: Scale of each joint's motion, the diagonal of W, shape (d,); by default ones.

    Returns:
        A solution not farther than `q`, and the number of iterations.
    """
    limits = position_limits(search.robot)
    scale = np.ones(len(q)) if scale is None else scale
    distance, length, spent = float(np.linalg.norm((q - near) / scale)), 1.0, 0
    step: FloatArray | None = None
    for _ in range(MAX_NULL_SPACE_STEPS):
        if step is None:
            step = null_space_step(search, q, near, limits, scale)
        if length * np.linalg.norm(step) < smallest_step:
            break
        solution = search.solve(clip_to_limits(q + length * step, limits), limits, CORRECTION)
        spent += solution.iterations + 1
        reached = float(np.linalg.norm((solution.q - near) / scale))
        if solution.converged and reached < distance:
            q, distance, step = solution.q, reached, None
            length = min(1.0, 2.0 * length)
        else:
            length *= 0.25
    return q, spent


def null_space_step(
    search: PoseSearch, q: FloatArray, near: FloatArray, limits: Limits, scale: FloatArray
) -> FloatArray:
    """Compute the step W(I − (JW)⁺JW) W⁻¹(near − q), shape (d,).

    Joints at limits that it would violate are fixed.

    Args:
        search: The pose, and the robot.
        q: Joint positions, shape (d,).
        near: Preferred configuration, shape (d,).
        limits: Joint limits.
        scale: Diagonal of W, shape (d,).
    """
    J = search.jacobian(q) * scale
    blocked = np.zeros(len(q), dtype=bool)
    while True:
        wanted = np.where(blocked, 0.0, (near - q) / scale)
        J_free = np.where(blocked, 0.0, J)
        # (I − J⁺J) x = x − Jᵀ (J Jᵀ)⁻¹ J x; the damping is for a singular J only.
        gram = J_free @ J_free.T + 1e-12 * np.eye(6)
        step = scale * (wanted - J_free.T @ LDLT(gram).solve(J_free @ wanted))
        leaves = find_blocked_joints(q, step, limits)
        if not (leaves & ~blocked).any():
            return np.asarray(step)
        blocked |= leaves
