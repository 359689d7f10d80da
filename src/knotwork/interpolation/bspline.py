"""Planners `bspline` and `bspline-velocity`: cubic B-splines on single and on double knots.

Both curves are kept as polynomials between the waypoints; a B-spline is the same curve in another
basis. Each interior knot of multiplicity r leaves a cubic B-spline with C^(3-r) smoothness there:
single knots at the waypoints allow for the positions and two end conditions, double knots for
the positions and all velocities. With double knots both it and the cubic Hermite spline of planner
`cubic` are of the space of all C1 piecewise cubics, in which positions and velocities fix one
curve. So `bspline-velocity`, which the paper names, is made by `cubic`.

Source: C. de Boor, A Practical Guide to Splines, chapters IV (complete cubic spline) and IX.
"""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.joining import joined
from knotwork.interpolation.options import PlannerOptions
from knotwork.interpolation.tridiagonal import cubic_pieces, solve_accelerations
from knotwork.polynomial import PiecewisePolynomial
from knotwork.waypoints import JointWaypoints


def plan_bspline(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of degree three through the positions, as a cubic B-spline.

    The complete (clamped) cubic spline: positions at all waypoints and velocities at both ends
    are met. It can't meet velocities at inner waypoints; they follow from continuous acceleration.
    Among all curves through these positions with these end velocities, it has the minimum integral
    of squared acceleration.

    Args:
        waypoints: Positions and velocities, n >= 2; inner velocities are not used.
        options: Not used.
    """
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    # h0/3 a0 + h0/6 a1 = s0 - v0 at the start, its mirror image at the end, and
    # h₋/6 a₋ + (h₋ + h₊)/3 a + h₊/6 a₊ = s₊ - s₋ between
    h = np.diff(t)
    slope = np.diff(y, axis=0) / h[:, None]
    diagonal = (np.append(0.0, h) + np.append(h, 0.0)) / 3.0
    rhs = np.diff(np.concatenate((v[:1], slope, v[-1:])), axis=0)
    return joined(waypoints, cubic_pieces(t, y, solve_accelerations(diagonal, h / 6.0, rhs)))
