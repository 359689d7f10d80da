"""Moving an arm with joints to spare along its free motion, nearest to a configuration."""

from __future__ import annotations

import numpy as np
from eigenpy import LDLT  # type: ignore[import-untyped]

from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.waypoints import FloatArray

MAX_STEPS = 30
# A free motion of less is not worth another step [rad or m].
SMALLEST_STEP = 1e-6
# Steps back onto the pose that a step along the free motion may take.
CORRECTION_ITERATIONS = 12


def settle_near(
    search: PoseSearch, q: FloatArray, near: FloatArray, smallest_step: float = SMALLEST_STEP
) -> tuple[FloatArray, int]:
    """Minimise |q − near| over the configurations with the same pose, from one of them.

    Each step goes along (I − J⁺J)(near − q), which leaves the pose alone to first order, and then
    back onto the pose. Joints at a limit that the step would leave are held.

    Args:
        search: The pose, and the robot.
        q: A solution, shape (d,).
        near: Where to be near, shape (d,).
        smallest_step: Steps shorter than this end it [rad or m].

    Returns:
        A solution no farther than `q`, and the number of iterations spent.
    """
    lower, upper = search.robot.lower_position_limit, search.robot.upper_position_limit
    distance, length, spent = float(np.linalg.norm(q - near)), 1.0, 0
    step: FloatArray | None = None
    for _ in range(MAX_STEPS):
        if step is None:
            step = free_motion(search, q, near, lower, upper)
        if length * np.linalg.norm(step) < smallest_step:
            break
        candidate = np.minimum(np.maximum(q + length * step, lower), upper)
        found = search.solve(candidate, lower, upper, CORRECTION_ITERATIONS)
        spent += found.iterations + 1
        reached = float(np.linalg.norm(found.q - near))
        if found.converged and reached < distance:
            q, distance, step = found.q, reached, None
            length = min(1.0, 2.0 * length)
        else:
            length *= 0.25
    return q, spent


def free_motion(
    search: PoseSearch, q: FloatArray, near: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Give the step (I − J⁺J)(near − q), joints held that it would take beyond limits, shape (d,).

    Args:
        search: The pose, and the robot.
        q: Joint positions, shape (d,).
        near: Where to go, shape (d,).
        lower: Limits, shape (d,).
        upper: Likewise.
    """
    J = search.jacobian(q)
    held = np.zeros(len(q), dtype=bool)
    while True:
        wanted = np.where(held, 0.0, near - q)
        free = np.where(held, 0.0, J)
        # (I − J⁺J) x = x − Jᵀ (J Jᵀ)⁻¹ J x; the damping is for a singular J only.
        gram = free @ free.T + 1e-12 * np.eye(6)
        step: FloatArray = wanted - free.T @ LDLT(gram).solve(free @ wanted)
        leaves = ((q <= lower) & (step < 0)) | ((q >= upper) & (step > 0))
        if not (leaves & ~held).any():
            return step
        held |= leaves
