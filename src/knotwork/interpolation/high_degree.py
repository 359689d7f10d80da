"""Planners `quintic`, `septic`, `nonic`: one polynomial an interval, higher derivatives preset.

With position and velocity, acceleration, jerk and snap given at both ends of an interval there is
exactly one polynomial of degree five, seven or nine. Neighbours share the values at their waypoint,
so they join smoothly; the caller must know good values. Higher degrees have higher peaks: from rest
to rest, with zeros preset, the peak velocity is 15/8, 35/16 and 315/128 times the mean one; for the
cubic it is 3/2 times.

Source: Eqs. (7), (8) of the paper; degrees seven and nine as its section 1 names them.
"""

from __future__ import annotations

from knotwork.interpolation.joining import joined
from knotwork.interpolation.options import PlannerOptions
from knotwork.interpolation.presets import preset_accelerations, preset_rows
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.hermite import two_point_coefficients
from knotwork.waypoints import JointWaypoints


def plan_quintic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of degree five: positions, velocities and accelerations are met.

    Eqs. (7), (8) in each interval. It can't find good accelerations by itself: where those preset
    don't suit the positions and velocities, the velocity swings between the waypoints.

    Args:
        waypoints: Positions and velocities, n >= 2.
        options: `accelerations` at the waypoints: zero by default, `"estimated"` (see
            `knotwork.interpolation.presets.estimated_accelerations`) or given;
            `end_acceleration` in place of the first and last of them.

    Raises:
        OptionError: An option has the wrong shape.
    """
    return _curve(waypoints, options, 3)


def plan_septic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C3 smooth curve of degree seven: jerks are met as well.

    Peaks of velocity and acceleration are higher than the quintic's. Options are those of the
    quintic, and `jerks` at the waypoints, zero by default.
    """
    return _curve(waypoints, options, 4)


def plan_nonic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C4 smooth curve of degree nine: jerks and snaps are met as well.

    Peaks of velocity and acceleration are higher still than those of degree seven. Options are
    those of degree seven, and `snaps` at the waypoints, zero by default.
    """
    return _curve(waypoints, options, 5)


def _curve(
    waypoints: JointWaypoints, options: PlannerOptions, conditions: int
) -> PiecewisePolynomial:
    derivatives = (
        waypoints.position,
        waypoints.velocity,
        preset_accelerations(waypoints, options),
        preset_rows("jerks", options.jerks, waypoints),
        preset_rows("snaps", options.snaps, waypoints),
    )
    return joined(waypoints, two_point_coefficients(waypoints.time, derivatives[:conditions]))
