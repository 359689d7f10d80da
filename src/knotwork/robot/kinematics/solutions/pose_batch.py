"""Inverse kinematics of many poses at once, each from its own start."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import checked_array
from knotwork.errors import ArrayError
from knotwork.errors.arguments import require_count, require_number
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.batch import BatchSolution, Targets, solve_batch
from knotwork.robot.kinematics.chain.joint_ranges import position_limits, spread_starts
from knotwork.robot.kinematics.chain.levenberg_marquardt import (
    HASTY_BUDGET,
    TOLERANCE_MARGIN,
    LocalSolution,
    PoseSearch,
)
from knotwork.robot.kinematics.pose_arguments import check_pose

MAX_BATCH_RESTARTS = 600
"""Default of the maximum number of further searches for a pose."""


def solve_pose_ik_batch(
    robot: Robot,
    poses: Iterable[Any],
    start: ArrayLike,
    *,
    tolerance: float = 1e-8,
    max_restarts: int = MAX_BATCH_RESTARTS,
) -> BatchSolution:
    """Find joint positions inside the limits for many poses, in one batch.

    This is faster than single poses from about ten poses on. If a pose fails from its start, it is
    searched for again from other starts. These are the same in every call. Any solution is
    accepted; a close start gives a close solution.

    Args:
        robot: The robot.
        poses: Poses of the TCP in the base frame, n of `pin.SE3`.
        start: Joint positions to search from [rad or m], shape (n, d), or (d,) for all.
        tolerance: Tolerance of position [m] and orientation [rad].
        max_restarts: Maximum number of further searches for a pose.

    Returns:
        Joint positions and errors; `converged` has whether each pose is solved.

    Raises:
        ArrayError: An array is not finite or has a wrong shape.
        InputError: The tolerance is not positive, or the number of searches is negative.
        RobotError: The robot has no tool frame.

    >>> robot = kw.load_robot("ur5")
    >>> home = robot.configuration("home")
    >>> configurations = home + np.linspace(0.0, 0.5, 6)[:, None]
    >>> poses = [robot.forward(q) for q in configurations]
    >>> found = kw.kinematics.solve_pose_ik_batch(robot, poses, start=configurations + 0.01)
    >>> found.converged.all(), float(abs(found.q - configurations).max()) < 1e-6
    (np.True_, True)
    """
    try:
        wanted = list(poses)
    except TypeError as error:
        message = f"poses must be a sequence of pin.SE3, not {poses!r}"
        raise ArrayError(message, value=poses) from error
    for k, pose in enumerate(wanted):
        check_pose(pose, f"poses[{k}]")
    require_number(tolerance, "tolerance", "m, rad", positive=True)
    require_count(max_restarts, "max_restarts", 0)
    n, d = len(wanted), robot.dof
    has_rows = np.asarray(start, dtype=object).ndim > 1
    first = np.broadcast_to(checked_array(start, (n, d) if has_rows else (d,), "start"), (n, d))
    limits, tolerance = position_limits(robot), TOLERANCE_MARGIN * tolerance
    ended = solve_batch(
        robot, Targets.from_poses(wanted), first, tolerance=tolerance, limits=limits, hasty=True
    )
    for i in np.flatnonzero(~ended.converged).tolist():
        search = PoseSearch(robot, wanted[i], tolerance, tolerance)
        starts = spread_starts(robot, limits, max_restarts)
        _search_again(ended, i, (search.solve(begin, limits, HASTY_BUDGET) for begin in starts))
    return ended


def _search_again(ended: BatchSolution, i: int, ends: Iterable[LocalSolution]) -> None:
    """Replace row i of a batch by the first converged end, or else by the nearest one."""
    for end in ends:
        remaining = end.position_error + end.orientation_error
        if end.converged or remaining < ended.position_error[i] + ended.orientation_error[i]:
            ended.q[i], ended.converged[i] = end.q, end.converged
            ended.position_error[i] = end.position_error
            ended.orientation_error[i] = end.orientation_error
        if end.converged:
            break
