"""Planner `cubic`: one cubic polynomial an interval, which the paper sets itself against."""

from __future__ import annotations

from knotwork.interpolation.catalogue import checked_options
from knotwork.interpolation.options import PlannerOptions
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import JointWaypoints

NAME = "cubic"


def plan(waypoints: JointWaypoints, options: PlannerOptions | None = None) -> JointTrajectory:
    """Plan a C1 smooth motion of degree three: its acceleration jumps at the waypoints.

    Each interval's cubic meets position and velocity at its ends, Eqs. (5), (6).

    Args:
        waypoints: Positions and velocities, n >= 2.
        options: Limits only; there is nothing to choose.

    Raises:
        InputError: An option is asked for; the waypoints alone fix the cubics.
    """
    checked_options(NAME, options)
    return JointTrajectory.from_knots(
        waypoints.joint_names,
        waypoints.time,
        waypoints.position,
        waypoints.velocity,
        joint_units=waypoints.joint_units,
        planner=NAME,
        waypoint_times=waypoints.time,
    )
