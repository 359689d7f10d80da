"""Solutions of a redundant arm at a pose: configurations spread over its self-motion."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.chain.batch import Targets, solve_batch
from knotwork.robot.kinematics.chain.joint_ranges import (
    joint_distances,
    position_limits,
    spread_starts,
)

SELF_MOTION_STARTS = 96
"""Number of starts all over the range of the joints."""
SAMPLE_ITERATIONS = 18
"""Maximum number of steps from each start."""
NEARBY_STARTS = 16
"""Number of additional starts near a configuration."""
NEARBY_DISTANCE = 0.25
"""Maximum distance of these starts in each joint [rad or m]."""


def sample_self_motion(
    robot: Robot, targets: Targets, near: FloatArray | None = None
) -> list[FloatArray]:
    """Find solutions all over the self-motion of a redundant arm, inside its limits.

    Args:
        robot: The robot.
        targets: n poses.
        near: Configuration near which more solutions are searched for, shape (d,).

    Returns:
        For each pose solutions, shape (b, d).
    """
    n, limits = len(targets), position_limits(robot)
    begin = spread_starts(robot, limits, SELF_MOTION_STARTS)
    if near is not None:
        close = spread_starts(robot, limits, NEARBY_STARTS, centre=near, radius=NEARBY_DISTANCE)
        begin = np.vstack([begin, close])
    owner = np.repeat(np.arange(n), len(begin))
    ended = solve_batch(
        robot,
        targets.take(owner),
        np.tile(begin, (n, 1)),
        tolerance=1e-10,
        limits=limits,
        max_iterations=SAMPLE_ITERATIONS,
        hasty=True,
    )
    return [ended.q[(owner == i) & ended.converged] for i in range(n)]


def choose_farthest_apart(robot: Robot, solutions: FloatArray, count: int) -> FloatArray:
    """Choose configurations one by one, each as far as possible from those chosen before.

    Args:
        robot: The robot.
        solutions: Candidates, shape (n, d); the first is chosen first.
        count: Maximum number of configurations.
    """
    revolute, chosen = joint_axes(robot).is_revolute, np.zeros(0, dtype=int)
    distance = np.full(len(solutions), np.inf)
    while len(chosen) < count and distance.max(initial=0.0) > 1e-4:
        chosen = np.append(chosen, np.argmax(np.round(distance, 9)))
        distance = np.minimum(distance, joint_distances(solutions, solutions[chosen[-1]], revolute))
    return np.asarray(solutions[chosen])
