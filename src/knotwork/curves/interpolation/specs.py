"""Guarantees, limitations and supported options of each planner.

This module loads no planner, so that names and specs are available at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from knotwork.curves.interpolation.options import PlannerOptions
from knotwork.errors import OptionError


@dataclass(frozen=True)
class PlannerSpec:
    """Description of a planner.

    >>> spec = kw.interpolation.PLANNER_SPECS["quintic"]
    >>> spec.degree, spec.continuity
    (5, 2)

    Attributes:
        name: The name in scenarios and on the command line.
        summary: Short description.
        continuity: Order k of its C^k smoothness, guaranteed for all waypoints.
        degree: Largest degree of its polynomials, for any number of waypoints.
        guarantees: Guarantees of the motion.
        limitations: Limitations of the motion.
        entry_point: Module in `knotwork.curves.interpolation`, and function, that make the curve.
        supports: Names of the `PlannerOptions` that it supports.
    """

    name: str
    summary: str
    continuity: int
    degree: int
    guarantees: str
    limitations: str
    entry_point: str
    supports: tuple[str, ...] = ()


_ALL_PLANNERS = (
    PlannerSpec(
        "modified-hermite",
        "the paper's: modified cubic Hermite interpolation on rebuilt knots",
        continuity=2,
        degree=3,
        guarantees="positions and velocities at all waypoints; end accelerations if requested",
        limitations="does not choose the accelerations at inner waypoints",
        supports=("knots", "end_acceleration", "chosen"),
        entry_point="modified_hermite:plan_modified_hermite",
    ),
    PlannerSpec(
        "cubic",
        "one cubic polynomial per interval, Eqs. (5), (6)",
        continuity=1,
        degree=3,
        guarantees="positions and velocities at all waypoints",
        limitations="acceleration jumps at inner waypoints",
        entry_point="waypoint_polynomials:plan_cubic",
    ),
    PlannerSpec(
        "quintic",
        "one quintic polynomial per interval, Eqs. (7), (8)",
        continuity=2,
        degree=5,
        guarantees="positions, velocities and preset accelerations at all waypoints",
        limitations="does not find good accelerations: with bad presets the velocity fluctuates",
        supports=("accelerations", "end_acceleration"),
        entry_point="waypoint_polynomials:plan_quintic",
    ),
    PlannerSpec(
        "septic",
        "one polynomial of degree seven per interval",
        continuity=3,
        degree=7,
        guarantees="positions, velocities, preset accelerations and zero jerk at all waypoints",
        limitations="does not keep peaks low: the more is preset, the higher they are",
        supports=("accelerations", "end_acceleration"),
        entry_point="waypoint_polynomials:plan_septic",
    ),
    PlannerSpec(
        "nonic",
        "one polynomial of degree nine per interval",
        continuity=4,
        degree=9,
        guarantees="positions, velocities, preset accelerations, zero jerk and snap "
        "at all waypoints",
        limitations="does not keep peaks low: the more is preset, the higher they are",
        supports=("accelerations", "end_acceleration"),
        entry_point="waypoint_polynomials:plan_nonic",
    ),
    PlannerSpec(
        "parabolic-blend",
        "straight lines with parabolic transitions at the waypoints (LSPB)",
        continuity=1,
        degree=2,
        guarantees="positions and velocities at both ends; constant acceleration in transitions",
        limitations="cuts the corners of inner waypoints; acceleration jumps",
        entry_point="straight_lines:plan_blends",
    ),
    PlannerSpec(
        "bspline",
        "cubic B-spline through the positions, clamped at both ends",
        continuity=2,
        degree=3,
        guarantees="positions at all waypoints, velocities at both ends",
        limitations="ignores velocities at inner waypoints",
        entry_point="waypoint_polynomials:plan_bspline",
    ),
    PlannerSpec(
        "bspline-velocity",
        "cubic B-spline on double knots; the same curve as 'cubic'",
        continuity=1,
        degree=3,
        guarantees="positions and velocities at all waypoints",
        limitations="acceleration jumps at inner waypoints",
        entry_point="waypoint_polynomials:plan_cubic",
    ),
    PlannerSpec(
        "3-5-3",
        "cubic in the first and last interval, quintics between",
        continuity=2,
        degree=5,
        guarantees="positions and velocities at all waypoints",
        limitations="not for three waypoints; with over four, poor inner accelerations",
        supports=("accelerations",),
        entry_point="waypoint_polynomials:plan_353",
    ),
    PlannerSpec(
        "4-3-4",
        "quartic in the first and last interval, cubics between; a quintic for two waypoints",
        continuity=2,
        degree=5,
        guarantees="positions at all waypoints, velocities and accelerations at both ends",
        limitations="ignores velocities at inner waypoints",
        supports=("end_acceleration",),
        entry_point="waypoint_polynomials:plan_434",
    ),
    PlannerSpec(
        "trapezoidal",
        "trapezoidal velocity in each interval, a stop at each waypoint (vendors' PTP)",
        continuity=1,
        degree=2,
        guarantees="positions at all waypoints; joints in phase, so straight in joint space",
        limitations="stops at each waypoint; acceleration jumps",
        entry_point="straight_lines:plan_trapezoids",
    ),
)

PLANNER_SPECS: Mapping[str, PlannerSpec] = MappingProxyType(
    {spec.name: spec for spec in _ALL_PLANNERS}
)
"""Descriptions of all planners, by name."""


def check_supported(planner: str, options: PlannerOptions) -> None:
    """Check that a planner supports the options.

    Raises:
        OptionError: The planner does not support an option.
    """
    for option in options.requested:
        if option not in PLANNER_SPECS[planner].supports:
            others = ", ".join(n for n, spec in PLANNER_SPECS.items() if option in spec.supports)
            raise OptionError(option, f"is not supported; leave it out, or use one of: {others}")
