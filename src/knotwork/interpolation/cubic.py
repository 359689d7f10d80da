"""Planner `cubic`: one cubic polynomial an interval, the paper's point of comparison."""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.options import PlannerOptions
from knotwork.interpolation.pieces import to_trajectory
from knotwork.interpolation.specs import checked_options
from knotwork.polynomial.hermite import hermite_coefficients
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
    with np.errstate(over="ignore", invalid="ignore"):
        c = hermite_coefficients(waypoints.time, waypoints.position, waypoints.velocity)
    return to_trajectory(waypoints, NAME, c)
