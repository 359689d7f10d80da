"""Where to search for solutions at the very limits: from solutions outside, pulled inside."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import FULL_TURN, low_discrepancy, nearest_turns
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.kinematics.chain.null_space import free_motion
from knotwork.kinematics.solutions.enumeration import joint_axes
from knotwork.waypoints import FloatArray

# Searches that ignore the limits, made at once, and how many of what they find is pulled inside.
SEARCHES = 600
MOST_PULLED = 60
# Pulls of an arm with joints to spare; each goes most of the way.
PULLS = 8


def pulled_inside(search: PoseSearch, near: FloatArray) -> Iterator[FloatArray]:
    """Find solutions beyond the joint limits, and take them to where they are least beyond.

    A solution with several joints exactly at their limits is a corner that searches inside the
    limits seldom run into, but those that ignore them pass on all sides of it. An arm with joints
    to spare is moved along its free motion towards the limits.

    Args:
        search: The pose, and the robot.
        near: Configuration that whole turns are to be near to, shape (d,).

    Yields:
        Configurations inside the limits to search from, shape (d,), the least changed first.
    """
    robot = search.robot
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    nowhere = np.full(robot.dof, np.inf)
    solutions = _beyond_limits(search, near)
    beyond = np.maximum(np.maximum(lower - solutions, solutions - upper), 0.0).sum(axis=1)
    for row in np.argsort(np.round(beyond, 9), kind="stable")[:MOST_PULLED]:
        q = solutions[row]
        inside = np.minimum(np.maximum(q, lower), upper)
        for _ in range(PULLS if robot.dof > 6 else 0):
            step = free_motion(search, q, inside, -nowhere, nowhere)
            moved = search.solve(q + step, -nowhere, nowhere)
            if not moved.converged:
                break
            q = moved.q
            inside = np.minimum(np.maximum(q, lower), upper)
        yield inside


def _beyond_limits(search: PoseSearch, near: FloatArray) -> FloatArray:
    """Solutions whatever the limits, at the turns that are least outside, shape (k, d)."""
    robot = search.robot
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    points = low_discrepancy(robot.dof)
    revolute = joint_axes(robot).revolute
    first = np.where(revolute, near - np.pi, np.maximum(lower, near - np.pi))
    width = np.where(revolute, FULL_TURN, np.minimum(upper - first, FULL_TURN))
    starts = first + np.array([next(points) for _ in range(SEARCHES)]) * width
    target = Targets.of([search.pose]).take(np.zeros(SEARCHES, dtype=int))
    found = solve_batch(joint_axes(robot), target, starts, tolerance=1e-8)
    solutions = [nearest_turns(q, near, lower, upper, revolute) for q in found.q[found.converged]]
    return np.array(solutions).reshape(-1, robot.dof)
