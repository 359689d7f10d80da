"""Self-motion of a redundant arm: null-space steps, and the configuration nearest another."""

from __future__ import annotations

import numpy as np
from eigenpy import LDLT  # type: ignore[import-untyped]

from knotwork.kinematics.chain.joint_ranges import Limits, clip, held_joints, limits_of
from knotwork.kinematics.chain.levenberg_marquardt import Effort, PoseSearch
from knotwork.waypoints import FloatArray

MAX_NULL_SPACE_STEPS = 30
# Shorter steps end the motion [rad or m].
SMALLEST_STEP = 1e-6
# Effort of the correction back onto the pose after a null-space step.
CORRECTION = Effort(iterations=12)


def nearest_by_self_motion(
    search: PoseSearch, q: FloatArray, near: FloatArray, smallest_step: float = SMALLEST_STEP
) -> tuple[FloatArray, int]:
    """Minimise |q − near| over the configurations with the same pose, starting from one.

    This is null-space refinement. Each step is along (I − J⁺J)(near − q), which keeps the pose to
    first order. A correction back onto the pose follows.

    Args:
        search: The pose, and the robot.
        q: A solution, shape (d,).
        near: Preferred configuration, shape (d,).
        smallest_step: Steps shorter than this end the motion [rad or m].

    Returns:
        A solution not farther than `q`, and the number of iterations.
    """
    limits = limits_of(search.robot)
    distance, length, spent = float(np.linalg.norm(q - near)), 1.0, 0
    step: FloatArray | None = None
    for _ in range(MAX_NULL_SPACE_STEPS):
        if step is None:
            step = null_space_step(search, q, near, limits)
        if length * np.linalg.norm(step) < smallest_step:
            break
        solution = search.solve(clip(q + length * step, limits), limits, CORRECTION)
        spent += solution.iterations + 1
        reached = float(np.linalg.norm(solution.q - near))
        if solution.converged and reached < distance:
            q, distance, step = solution.q, reached, None
            length = min(1.0, 2.0 * length)
        else:
            length *= 0.25
    return q, spent


def null_space_step(
    search: PoseSearch, q: FloatArray, near: FloatArray, limits: Limits
) -> FloatArray:
    """The step (I − J⁺J)(near − q), shape (d,). Joints at limits that it would violate are fixed.

    Args:
        search: The pose, and the robot.
        q: Joint positions, shape (d,).
        near: Preferred configuration, shape (d,).
        limits: Joint limits.
    """
    J = search.jacobian(q)
    held = np.zeros(len(q), dtype=bool)
    while True:
        wanted = np.where(held, 0.0, near - q)
        J_free = np.where(held, 0.0, J)
        # (I − J⁺J) x = x − Jᵀ (J Jᵀ)⁻¹ J x; the damping is for a singular J only.
        gram = J_free @ J_free.T + 1e-12 * np.eye(6)
        step: FloatArray = wanted - J_free.T @ LDLT(gram).solve(J_free @ wanted)
        leaves = held_joints(q, step, limits)
        if not (leaves & ~held).any():
            return step
        held |= leaves
