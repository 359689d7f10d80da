"""Planner `modified-hermite`: the paper's method."""

from __future__ import annotations

from knotwork.interpolation.hermite import ModifiedHermiteSpline, end_accelerations
from knotwork.interpolation.options import PlannerOptions
from knotwork.polynomial import PiecewisePolynomial
from knotwork.waypoints import JointWaypoints


def plan(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of degree three through positions and velocities.

    Modified cubic Hermite interpolation on rebuilt knots, Eqs. (30), (31), (34), (39). Waypoints
    whose acceleration is known are met with it, and divide the curve into sections that don't
    depend on one another. Runs whose motion was chosen are sections, too.

    Args:
        waypoints: Positions and velocities, n >= 2, and accelerations where they are known.
        options: Where the knots sit (`knots`), the accelerations at both ends
            (`end_acceleration`), and the runs that were chosen (`chosen`).

    Raises:
        KnotError: Knots given by hand don't suit the waypoints.
        OptionError: End accelerations, or chosen runs, are not as they must be.
    """
    if options.chosen is not None:
        from knotwork.interpolation.chosen_knots import with_chosen_runs

        return with_chosen_runs(waypoints, options)
    return ModifiedHermiteSpline(
        waypoints.time,
        waypoints.position,
        waypoints.velocity,
        knots=options.knots,
        end_acceleration=end_accelerations(options.end_acceleration, waypoints.position.shape[1:]),
        acceleration=waypoints.acceleration,
    )
