"""Planner `modified-hermite`: the paper's method."""

from __future__ import annotations

from knotwork.interpolation.hermite import ModifiedHermiteSpline, end_accelerations
from knotwork.interpolation.options import PlannerOptions
from knotwork.interpolation.specs import checked_options
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import JointWaypoints

NAME = "modified-hermite"


def plan(waypoints: JointWaypoints, options: PlannerOptions | None = None) -> JointTrajectory:
    """Plan a C2 smooth motion of degree three through positions and velocities.

    Modified cubic Hermite interpolation on rebuilt knots, Eqs. (30), (31), (34), (39).

    Args:
        waypoints: Positions and velocities, n >= 2.
        options: Where the knots sit (`knots`) and the accelerations at both ends
            (`end_acceleration`).

    Raises:
        KnotError: Knots given by hand don't suit the waypoints.
        OptionError: Another option is not as it must be, or is one of another planner.
    """
    options = checked_options(NAME, options)
    ends = end_accelerations(options.end_acceleration, waypoints.position.shape[1:], NAME)
    spline = ModifiedHermiteSpline(
        waypoints.time,
        waypoints.position,
        waypoints.velocity,
        knots=options.knots,
        end_acceleration=ends,
    )
    return JointTrajectory(
        waypoints.joint_names,
        spline,
        joint_units=waypoints.joint_units,
        planner=NAME,
        waypoint_times=waypoints.time,
    )
