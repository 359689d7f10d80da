"""All solutions of a pose inside the joint limits, without their turns."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.robot.kinematics.chain.batch import Targets
from knotwork.robot.kinematics.chain.joint_ranges import (
    LIMIT_TOLERANCE,
    clip_to_limits,
    nearest_turns,
    position_limits,
    range_middles,
)
from knotwork.robot.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.robot.kinematics.solutions.enumeration import find_branches
from knotwork.robot.kinematics.solutions.self_motion import sample_self_motion

EDGE_DISTANCE = 1e-2
"""Excess over the limits [rad or m] up to which a solution may have a second one next to it inside
them. Near a singularity rounding moves solutions by as much.
"""


def find_solutions_within_limits(search: PoseSearch, near: FloatArray | None = None) -> FloatArray:
    """Find all solutions of a pose inside the limits, at the turns nearest their middle.

    For an arm of up to six joints these are the solutions that whole turns bring inside. For a
    redundant arm they are samples of its self-motion, dense enough that one is near any solution.

    Args:
        search: The pose, the robot and the tolerances.
        near: Configuration near which more samples of a self-motion are taken, shape (d,).

    Returns:
        Shape (k, d).
    """
    robot, targets = search.robot, Targets.from_poses([search.pose])
    if not robot.is_redundant:
        return turn_solutions_into_limits(search, find_branches(robot, targets)[0])
    return turn_solutions_into_limits(search, sample_self_motion(robot, targets, near)[0])


def turn_solutions_into_limits(search: PoseSearch, solutions: FloatArray) -> FloatArray:
    """Turn solutions by whole turns into the limits, and drop the others, shape (k, d)."""
    if not len(solutions):
        return solutions
    robot, limits = search.robot, position_limits(search.robot)
    centre = range_middles(limits)
    turned = nearest_turns(robot, solutions, centre)
    q = clip_to_limits(turned, limits)
    beyond = np.abs(turned - q).max(axis=1, initial=0.0)
    tip, rotation, _ = joint_axes(robot).compute_poses_and_jacobians(q)
    target = Targets.from_poses([search.pose])
    _, distance, angle = pose_errors(tip, rotation, target.position, target.rotation)
    within = (distance <= search.tolerances[0]) & (angle <= search.tolerances[1])
    inside = beyond <= EDGE_DISTANCE
    for i in np.flatnonzero(inside & ((beyond > LIMIT_TOLERANCE) | ~within)):
        solution = search.solve(q[i], limits)
        inside[i] = solution.converged and np.abs(solution.q - turned[i]).max() <= EDGE_DISTANCE
        q[i] = solution.q
    return np.asarray(q[inside])


def sort_key(q: FloatArray) -> tuple[float, ...]:
    """Key that sorts configurations equally on every machine."""
    return tuple((np.round(q, 5) + 0.0).tolist())
