"""Many poses at once, each from a start of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.kinematics.batch import BatchSolution, Targets, solve_batch
from knotwork.kinematics.enumeration import joint_axes
from knotwork.kinematics.pose import check_pose
from knotwork.kinematics.restarts import low_discrepancy, search_box
from knotwork.robot import Robot
from knotwork.waypoints import read_only

MAX_RESTARTS = 100
# Searches aim at a little less than the tolerance, so that rounding can't carry one across.
MARGIN = 0.9


def solve_many(
    robot: Robot,
    poses: Sequence[Any],
    start: ArrayLike,
    *,
    tolerance: float = 1e-8,
    max_restarts: int = MAX_RESTARTS,
) -> BatchSolution:
    """Find joint positions inside the limits for many poses, in one batch.

    Faster than one pose after the other from some ten poses on. What fails from its start is
    searched for again from other points, the same ones every time. Any solution is an answer;
    from a start close by that is the one close by.

    Args:
        robot: The robot.
        poses: Poses of the TCP in the base frame, n of `pin.SE3`.
        start: Joint positions to search from [rad or m], shape (n, d), or (d,) for all.
        tolerance: Of the position [m] and of the orientation [rad].
        max_restarts: Further searches for a pose at most.

    Returns:
        Joint positions and errors; `converged` says which poses are solved.

    Raises:
        WaypointDataError: An array is not finite or of another shape, or the tolerance is not
            positive.
        RobotError: The robot has no tool frame.
    """
    n, d = len(poses), robot.dof
    for pose in poses:
        check_pose(pose, tolerance, tolerance)
    given = np.asarray(start)
    first = read_only(given if given.ndim == 2 else np.tile(given, (n, 1)), (n, d), "start")
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    corner, opposite = search_box(robot, np.zeros(d), np.inf)
    chain, targets = joint_axes(robot), Targets.of(poses)
    points = low_discrepancy(d)
    q = np.minimum(np.maximum(first, lower), upper)
    position, orientation = np.full(n, np.inf), np.full(n, np.inf)
    todo, iterations = np.arange(n), 0
    starts = q.copy()
    for _ in range(max_restarts + 1):
        if not todo.size:
            break
        found = solve_batch(
            chain,
            targets.take(todo),
            starts,
            tolerance=MARGIN * tolerance,
            lower=lower,
            upper=upper,
        )
        iterations += found.iterations
        nearer = found.converged | (
            found.position_error + found.orientation_error < position[todo] + orientation[todo]
        )
        rows = todo[nearer]
        q[rows] = found.q[nearer]
        position[rows] = found.position_error[nearer]
        orientation[rows] = found.orientation_error[nearer]
        todo = todo[~found.converged]
        starts = np.tile(corner + next(points) * (opposite - corner), (len(todo), 1))
    converged = np.maximum(position, orientation) <= MARGIN * tolerance
    return BatchSolution(q, position, orientation, converged, iterations)
