"""Planner `cubic`: one cubic polynomial an interval, which the paper sets itself against."""

from __future__ import annotations

from knotwork.errors import InputError
from knotwork.interpolation.options import PlannerOptions
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import JointWaypoints

NAME = "cubic"


def plan(waypoints: JointWaypoints, options: PlannerOptions | None = None) -> JointTrajectory:
    """Plan a C1 smooth motion of degree three: its acceleration jumps at the waypoints.

    Each interval's cubic meets position and velocity at its ends, Eqs. (5), (6).

    Args:
        waypoints: Positions and velocities, n >= 2.
        options: None but the defaults can be honoured.

    Raises:
        InputError: Knots or end accelerations are asked for.
    """
    options = options or PlannerOptions()
    if not options.is_default:
        asked = "end accelerations" if options.end_acceleration is not None else "a choice of knots"
        raise InputError(
            f"planner {NAME!r} can't honour {asked}: its cubics are fixed by the waypoints; "
            "leave the option out or use planner 'modified-hermite'"
        )
    return JointTrajectory.from_knots(
        waypoints.joint_names,
        waypoints.time,
        waypoints.position,
        waypoints.velocity,
        joint_units=waypoints.joint_units,
        planner=NAME,
        waypoint_times=waypoints.time,
    )
