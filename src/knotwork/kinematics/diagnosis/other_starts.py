"""Other joint positions at the beginning of a tool path with which it can be followed."""

from __future__ import annotations

import numpy as np

from knotwork.errors import InputError
from knotwork.kinematics.following.continuation import continue_along
from knotwork.kinematics.following.joint_field import Pull
from knotwork.kinematics.geometry.configuration_flags import configuration_flags, describe_flags
from knotwork.kinematics.solutions.branches import solve_pose_ik_all
from knotwork.robot import Robot
from knotwork.tool_paths import TimedPath
from knotwork.waypoints import FloatArray

# Number of starts that are reported, the nearest ones.
REPORTED = 3
# Number of samples of the self-motion of a redundant arm.
SPREAD = 8
# Joint positions that agree to this many digits after the point are equal.
DIGITS = 9


def other_starts(robot: Robot, path: TimedPath, start: FloatArray, pull: Pull) -> FloatArray:
    """Starts that lead along a path, the nearest first, of each branch one; shape (k, d).

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        start: Joint positions to be near [rad or m], shape (d,).
        pull: See `JointField`.
    """
    try:
        branches = solve_pose_ik_all(robot, path.pose(path.start_time), spread=SPREAD)
    except InputError:
        return np.empty((0, robot.dof))
    own = np.array([branch.q for branch in branches])
    found = continue_along(robot, path, own, path.breaks, pull=pull)
    turns = np.concatenate([branch.turns for branch in branches])
    back = np.repeat(np.arange(len(own)), [len(branch.turns) for branch in branches])
    rows = np.flatnonzero(found.free(robot, back, turns - own[back]))
    gap = np.abs(turns[rows] - start)
    farthest = np.round(gap.max(axis=1), DIGITS)  # rounding must not order what is as far
    rows = rows[np.lexsort((gap.sum(axis=1), farthest))]
    _, first = np.unique(back[rows], return_index=True)
    return np.asarray(turns[rows[np.sort(first)][:REPORTED]])


def described_starts(robot: Robot, starts: FloatArray) -> str:
    """The branches of starts in words, or their joint positions where an arm has no branches."""
    texts = []
    for q, flags in zip(starts, configuration_flags(robot, starts), strict=True):
        numbers = f"[{', '.join(f'{value:.3f}' for value in q)}]"
        texts.append(f"{describe_flags(robot, flags)} {numbers}".lstrip())
    return "; or ".join(texts)
