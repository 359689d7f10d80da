"""Where the search for a pose goes on once it has failed from its start."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_ranges import nearest_turns, search_box
from knotwork.kinematics.chain.levenberg_marquardt import LocalSolution, PoseSearch
from knotwork.kinematics.solutions.near_singular import (
    DEEP,
    MOST_STEPS,
    VALLEY_RESIDUAL,
    solutions_outward,
)
from knotwork.kinematics.solutions.seeds import seeds
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# Where a start is near a solution but its search fails, others from so near find it.
NEARBY = 0.25  # [rad or m]
NEARBY_RESTARTS = 4
# Valleys that are followed when all else has failed; many may be the same.
MOST_FOLLOWED = 24


def starts_after(
    robot: Robot, pose: Any, near: FloatArray, points: Iterator[FloatArray], nearby: int
) -> Iterator[FloatArray]:
    """Where to search for a pose after a start that failed, shape (d,) each, without end."""
    if nearby:
        yield from spread(robot, near, NEARBY, points, nearby)
    yield from seeds(robot, [pose])[0]
    yield from spread(robot, near, np.inf, points, None)


def in_valleys(
    search: PoseSearch,
    ended: Iterable[LocalSolution],
    near: FloatArray,
    most_steps: int = MOST_STEPS,
) -> Iterator[FloatArray]:
    """Solutions next to a singularity, where searches ended on the way to them.

    From each in turn the solutions along its valley as they come, those last that limits put more
    than half a turn away. Arms of fewer than six joints are left to searches from other starts.

    Args:
        search: The pose, and the robot.
        ended: Where searches ended.
        near: Configuration that whole turns are to be near to, shape (d,).
        most_steps: How many steps to follow each valley either way.
    """
    robot = search.robot
    if robot.dof < 6:
        return
    revolute = np.array([unit == "rad" for unit in robot.joint_units])
    limits = robot.lower_position_limit, robot.upper_position_limit
    deep = (one.q for one in ended if one.miss < DEEP)
    far: list[FloatArray] = []
    for start in islice(deep, MOST_FOLLOWED):
        for q in solutions_outward(search, start, VALLEY_RESIDUAL, most_steps):
            turned = nearest_turns(q, near, *limits, revolute)
            if np.abs(turned - near).max() > np.pi:
                far.append(turned)
            else:
                yield turned
    yield from far


def spread(
    robot: Robot, centre: FloatArray, radius: float, points: Iterator[FloatArray], count: int | None
) -> Iterator[FloatArray]:
    """Take points of the box around a configuration, shape (d,) each."""
    corner, opposite = search_box(robot, centre, radius)
    return (corner + point * (opposite - corner) for point in islice(points, count))
