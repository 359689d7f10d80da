"""Where the arm of a scenario waits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.scenario.model import Scenario
from knotwork.waypoints import CartesianWaypoint

if TYPE_CHECKING:
    from knotwork.scenario.joint_space import JointState

SAME = 1e-12
"""Poses and joint positions nearer than this [m, rad] are one."""


def waits(scenario: Scenario, targets: Sequence[JointState | None]) -> Iterator[int]:
    """Indices of waypoints at rest that are followed by an equal one, but by no tool path."""
    moved = {i for path in scenario.paths for i in range(path.first, path.last)}
    if scenario.free is not None:  # a velocity that is chosen is no stop
        speeds = pairwise(scenario.free.speed)
        moved |= {i for i, kinds in enumerate(speeds) if kinds != ("given", "given")}
    for i, (one, next_one) in enumerate(pairwise(scenario.waypoints)):
        here, there = targets[i], targets[i + 1]
        if i in moved:
            continue
        if isinstance(one, CartesianWaypoint) and isinstance(next_one, CartesianWaypoint):
            gap = one.pose.homogeneous - next_one.pose.homogeneous
            moving = [*one.twist.vector, *next_one.twist.vector]
        elif here is not None and there is not None:
            gap = here.position - there.position
            moving = [*here.velocity, *there.velocity]
        else:
            continue
        if np.abs(gap).max() <= SAME and not np.any(moving):
            yield i
