"""Planners of one polynomial an interval: `cubic`, `quintic`, `septic`, `nonic`.

With position and velocity, acceleration, jerk and snap given at both ends of an interval there is
exactly one polynomial of degree three, five, seven or nine: Eqs. (5) to (8) of the paper, and the
higher degrees that its section 1 names. Neighbours share the values at their waypoint, so a curve
of degree 2k - 1 is C^(k-1) smooth. Positions and velocities come from the waypoints;
accelerations are the options' `accelerations` (zero by default, `"estimated"` or given) with
`end_acceleration` in place of the first and last; jerk and snap are zero.

The caller must know good values: where those preset don't suit the positions and velocities, the
velocity swings between the waypoints. And higher degrees have higher peaks: from rest to rest, with
zeros preset, the peak velocity is 3/2 times the mean one for the cubic, then 15/8, 35/16 and
315/128 times.
"""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.joining import joined
from knotwork.interpolation.options import PlannerOptions
from knotwork.interpolation.presets import preset_accelerations
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.two_point import two_point_coefficients
from knotwork.waypoints import JointWaypoints


def plan_cubic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C1 smooth curve of degree three: positions and velocities are met."""
    return _curve(waypoints, options, 1)


def plan_quintic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of degree five: accelerations are met as well."""
    return _curve(waypoints, options, 2)


def plan_septic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C3 smooth curve of degree seven: the jerk is zero at waypoints."""
    return _curve(waypoints, options, 3)


def plan_nonic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C4 smooth curve of degree nine: jerk and snap are zero at waypoints."""
    return _curve(waypoints, options, 4)


def _curve(
    waypoints: JointWaypoints, options: PlannerOptions, derivatives: int
) -> PiecewisePolynomial:
    given = [waypoints.position, waypoints.velocity]
    if derivatives > 1:
        given.append(preset_accelerations(waypoints, options))
    given += [np.zeros_like(waypoints.position)] * (derivatives - 2)
    return joined(waypoints, two_point_coefficients(waypoints.time, tuple(given)))
