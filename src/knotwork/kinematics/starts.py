"""Where the search for a pose goes on once it has failed from its start."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

import numpy as np

from knotwork.kinematics.levenberg_marquardt import LocalSolution, PoseSearch
from knotwork.kinematics.restarts import nearest_turns, search_box
from knotwork.kinematics.seeds import seeds
from knotwork.kinematics.valleys import DEEP, VALLEY_RESIDUAL, solutions_in_valleys
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# Where a start is near a solution but its search fails, others from so near find it.
NEARBY = 0.25  # [rad or m]
NEARBY_RESTARTS = 4


def starts_after(
    robot: Robot, pose: Any, near: FloatArray, points: Iterator[FloatArray], nearby: int
) -> Iterator[FloatArray]:
    """Where to search for a pose after a start that failed, shape (d,) each, without end."""
    if nearby:
        yield from spread(robot, near, NEARBY, points, nearby)
    yield from seeds(robot, [pose])[0]
    yield from spread(robot, near, np.inf, points, None)


def in_valleys(
    search: PoseSearch, ended: Iterable[LocalSolution], near: FloatArray
) -> Iterator[FloatArray]:
    """Solutions next to a singularity, where searches ended on the way to them: the nearest first.

    Arms of other than six joints are left to searches from other starts.
    """
    robot = search.robot
    if robot.dof != 6:
        return
    deep = [one.q for one in ended if one.position_error + one.orientation_error < DEEP]
    revolute = np.array([unit == "rad" for unit in robot.joint_units])
    limits = robot.lower_position_limit, robot.upper_position_limit
    solutions = solutions_in_valleys(search, deep, revolute, VALLEY_RESIDUAL)
    turned = [nearest_turns(q, near, *limits, revolute) for q in solutions]
    yield from sorted(turned, key=lambda q: float(np.linalg.norm(q - near)))


def spread(
    robot: Robot, centre: FloatArray, radius: float, points: Iterator[FloatArray], count: int | None
) -> Iterator[FloatArray]:
    """Take points of the box around a configuration, shape (d,) each."""
    corner, opposite = search_box(robot, centre, radius)
    return (corner + point * (opposite - corner) for point in islice(points, count))
