"""Where a task has the arm stand still."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from knotwork.joint_space import JointSpace
from knotwork.scenario import Scenario
from knotwork.waypoints import CartesianWaypoint

SAME = 1e-12
"""Poses and joint positions nearer than this [m, rad] are one."""


def waits(scenario: Scenario, space: JointSpace) -> tuple[int, ...]:
    """Waypoints at which the arm stands still until the next one, by index."""
    found = []
    for i, (one, next_one) in enumerate(pairwise(scenario.waypoints)):
        if isinstance(one, CartesianWaypoint) and isinstance(next_one, CartesianWaypoint):
            gap = one.pose.homogeneous - next_one.pose.homogeneous
            moving = [*one.twist.vector, *next_one.twist.vector]
        else:
            states = space.targets[i], space.targets[i + 1]
            if states[0] is None or states[1] is None:
                continue
            gap = states[0].position - states[1].position
            moving = [*states[0].velocity, *states[1].velocity]
        if np.abs(gap).max() <= SAME and not np.any(moving):
            found.append(i)
    return tuple(found)
