"""Joint velocities at a waypoint with chosen joint positions (eq 4)."""

from __future__ import annotations

from typing import cast

import numpy as np

from knotwork.kinematics.chain.velocity import pull_to_middle, solve_velocity_ik
from knotwork.kinematics.following.continuation import velocity_on_path
from knotwork.planning.task_to_joint.dependent_waypoints import PathTrack
from knotwork.planning.task_to_joint.free_poses import FreedomChains
from knotwork.scenario import Scenario
from knotwork.waypoints import CartesianWaypoint, FloatArray


def velocity_at(
    scenario: Scenario, chains: FreedomChains, track: PathTrack | None, index: int, q: FloatArray
) -> FloatArray:
    """Joint velocities for the tool's twist at a waypoint [rad/s or m/s], shape (d,).

    Args:
        scenario: The task.
        chains: The robot with the virtual joints of each pose.
        track: Track of the path of the waypoint, if it is on one.
        index: Index of the waypoint, which is given by a pose.
        q: Joint positions at the waypoint [rad or m], shape (d,).

    Raises:
        SingularityError: The twist is unattainable.
    """
    target, rate = cast(CartesianWaypoint, scenario.waypoints[index]), scenario.task.pull_to_middle
    chain = chains.for_waypoint(target) if track is None else track.chain
    robot, q = chain.robot, q[chain.columns]
    if track is not None:
        pull = track.pull(target.time, q)
        return chain.scatter(velocity_on_path(robot, track.path.motion, q, target.time, pull))

    def solve(preferred: FloatArray | None) -> FloatArray:
        return solve_velocity_ik(
            robot,
            q,
            target.twist,
            preferred=preferred,
            waypoint=target.name,
            where=target.where,
            units=scenario.units,
        )

    v = solve(None)
    if not rate or not v.any():
        return chain.scatter(v)
    self_motion = solve(pull_to_middle(robot, q, rate)) - v
    return chain.scatter(v + _largest_fraction(v, self_motion, robot.velocity_limit) * self_motion)


def _largest_fraction(v: FloatArray, change: FloatArray, limit: FloatArray) -> float:
    """The largest fraction of a change, up to 1, that keeps every velocity within its limit."""
    margin = np.maximum(np.where(change > 0, limit - v, limit + v), 0.0)
    return float((margin / np.maximum(np.abs(change), 1e-300)).min(initial=1.0, where=change != 0))
