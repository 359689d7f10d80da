"""Planner `cubic`: one cubic polynomial an interval, the paper's point of comparison."""

from __future__ import annotations

from knotwork.interpolation.joining import joined
from knotwork.interpolation.options import PlannerOptions
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.hermite import two_point_coefficients
from knotwork.waypoints import JointWaypoints


def plan(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C1 smooth curve of degree three: its acceleration jumps at the waypoints.

    Each interval's cubic meets position and velocity at its ends, Eqs. (5), (6).

    Args:
        waypoints: Positions and velocities, n >= 2, which alone fix the cubics.
        options: Limits only; there is nothing to choose.
    """
    ends = waypoints.position, waypoints.velocity
    return joined(waypoints, two_point_coefficients(waypoints.time, ends))
