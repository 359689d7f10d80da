"""Waits of a scenario's arm."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from knotwork.scenario.scenario import Scenario
from knotwork.waypoints import CartesianWaypoint, FloatArray

SAME_PLACE_TOLERANCE = 1e-12
"""Poses and joint positions nearer than this [m, rad] are the same."""


def waits(scenario: Scenario, positions: Sequence[FloatArray | None]) -> Iterator[int]:
    """Indices of waypoints at rest that are followed by an equal one without a tool path.

    Args:
        scenario: The scenario.
        positions: Joint positions at its waypoints, shape (d,); `None` where the joints move,
            or for a pose.
    """
    moved = {i for path in scenario.paths for i in range(path.first, path.last)}
    if scenario.free is not None:  # a chosen velocity is not a stop
        speeds = pairwise(scenario.free.speed)
        moved |= {i for i, kinds in enumerate(speeds) if kinds != ("given", "given")}
    places = [
        waypoint.pose.homogeneous
        if isinstance(waypoint, CartesianWaypoint) and not waypoint.twist.vector.any()
        else position
        for waypoint, position in zip(scenario.waypoints, positions, strict=True)
    ]
    stands = [waypoint.standing for waypoint in scenario.waypoints]
    for i, (first, second) in enumerate(pairwise(places)):
        if stands[i] != stands[i + 1]:
            continue
        if i in moved or first is None or second is None or first.shape != second.shape:
            continue
        if np.abs(first - second).max() <= SAME_PLACE_TOLERANCE:
            yield i
