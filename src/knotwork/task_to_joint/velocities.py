"""Joint velocities at a waypoint with chosen joint positions (eq 4)."""

from __future__ import annotations

import numpy as np

from knotwork.kinematics.chain.velocity import pull_to_middle, solve_velocity_ik
from knotwork.kinematics.following.continuation import velocity_on_path
from knotwork.scenario import Scenario
from knotwork.task_to_joint.dependent_waypoints import DependentWaypoints
from knotwork.waypoints import CartesianWaypoint, FloatArray


def velocity_at(
    scenario: Scenario,
    dependent: DependentWaypoints,
    index: int,
    q: FloatArray,
    given: FloatArray | None,
) -> FloatArray:
    """Joint velocities for the tool's twist at a waypoint [rad/s or m/s], shape (d,).

    Args:
        scenario: The task.
        dependent: Self-motion targets along paths, and the virtual joints.
        index: Index of the waypoint.
        q: Joint positions at the waypoint [rad or m], shape (d,).
        given: Joint velocities where the waypoint gives them, else `None`.

    Raises:
        SingularityError: The twist is unattainable.
    """
    target, rate = scenario.waypoints[index], scenario.task.pull_to_middle
    if given is not None or not isinstance(target, CartesianWaypoint):
        return np.array(given)
    for path in scenario.paths:
        if path.first <= index <= path.last:
            chain = dependent.chain(path)
            own, time = q[chain.columns], target.time
            pull = dependent.pull(path, time, own)
            return chain.put(velocity_on_path(chain.robot, path.motion, own, time, pull))
    chain = dependent.chains.at(target)
    robot, q = chain.robot, q[chain.columns]

    def solved(preferred: FloatArray | None) -> FloatArray:
        return solve_velocity_ik(
            robot,
            q,
            target.twist,
            preferred=preferred,
            waypoint=target.name,
            where=target.where,
            units=scenario.units,
        )

    v = solved(None)
    if not rate or not v.any():
        return chain.put(v)
    more = solved(pull_to_middle(robot, q, rate)) - v
    return chain.put(v + _largest_fraction(v, more, robot.velocity_limit) * more)


def _largest_fraction(v: FloatArray, more: FloatArray, limit: FloatArray) -> float:
    """The largest fraction of `more`, up to 1, that keeps every velocity within its limit."""
    room = np.where(more > 0, limit - v, limit + v)
    parts = np.where(more != 0, np.maximum(room, 0.0) / np.maximum(np.abs(more), 1e-300), np.inf)
    return float(min(1.0, parts.min()))
