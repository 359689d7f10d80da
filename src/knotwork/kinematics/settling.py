"""Using the free motion of an arm with joints to spare between its waypoints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.kinematics.candidates import limit_nearness, singular_nearness
from knotwork.kinematics.levenberg_marquardt import PoseSearch
from knotwork.kinematics.nearest import settle_near
from knotwork.kinematics.velocity import smallest_singular_value
from knotwork.robot import Robot
from knotwork.waypoints import CartesianWaypoint, FloatArray

SWEEPS = 3
TOLERANCE = 0.9e-8


def settle_sequence(
    robot: Robot,
    positions: FloatArray,
    waypoints: Sequence[CartesianWaypoint | None],
    near: FloatArray | None,
    origin: FloatArray | None,
) -> FloatArray:
    """Move each waypoint along its free motion to where the way through is shorter.

    Waypoint by waypoint, and again: towards the middle between its neighbours, or towards `near`.
    A move is kept if it shortens the weighted travel to the neighbours; the weight makes it stay
    away from limits and singularities.

    Args:
        robot: The robot.
        positions: Joint positions at all waypoints [rad or m], shape (n, d).
        waypoints: Those that may be moved; `None` for those that may not.
        near: Configuration to be near instead, or `None`.
        origin: Configuration before the first waypoint, or `None`.

    Returns:
        Joint positions with the same tool poses, shape (n, d).
    """
    limit = robot.velocity_limit
    speed = np.where(np.isfinite(limit), limit, 1.0)
    q = positions.copy()

    def weight(one: FloatArray) -> float:
        smallest = np.array([smallest_singular_value(robot, one)])
        return float(1.0 + limit_nearness(robot, one[None])[0] + singular_nearness(smallest)[0])

    weights = [weight(one) for one in q]

    def travel(one: FloatArray, w: float, beside: list[tuple[FloatArray, float]]) -> float:
        return sum(
            float(np.linalg.norm((one - other) / speed)) * 0.5 * (w + v) for other, v in beside
        )

    for _ in range(SWEEPS):
        moved = 0.0
        for i, waypoint in enumerate(waypoints):
            if waypoint is None:
                continue
            if near is not None:
                beside = [(near, 1.0)]
            else:
                beside = [(q[k], weights[k]) for k in (i - 1, i + 1) if 0 <= k < len(q)]
                if i == 0 and origin is not None:
                    beside.insert(0, (origin, 1.0))
            search = PoseSearch(robot, waypoint.pose, TOLERANCE, TOLERANCE)
            goal = np.mean([other for other, _ in beside], axis=0)
            found, _ = settle_near(search, q[i], goal, 1e-4)
            w = weight(found)
            if travel(found, w, beside) < travel(q[i], weights[i], beside) - 1e-6:
                moved = max(moved, float(np.abs(found - q[i]).max()))
                q[i], weights[i] = found, w
        if moved < 1e-3:
            break
    return q
