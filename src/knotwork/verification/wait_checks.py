"""Motion of joints during waits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.errors.plain_text import waypoint_text
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding
from knotwork.verification.waypoint_checks import worst_joint


def waits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare joint positions during each wait with those at its start, over all time."""
    tolerances = space.tolerances["joint_position"]
    for i in space.waits:
        waypoint = scenario.waypoints[i]
        start = max(waypoint.time, motion.start_time)
        end = min(scenario.waypoints[i + 1].time, motion.end_time)
        if end <= start:
            continue
        shifted = cut_curve(motion.curve, start, end)
        c = np.array(shifted.c)
        c[-1] -= motion.curve(start)
        extrema = PiecewisePolynomial(c, shifted.x).extrema()
        worst = worst_joint(extrema.peak, tolerances)
        distance, tolerance = float(extrema.peak[worst]), float(tolerances[worst])
        unit = space.joint_units[worst]
        yield Finding.at_most(
            group="Waits",
            subject="wait",
            name=waypoint.name,
            quantity="movement",
            fact=f"{waypoint_text(waypoint.name)}: the arm must be at rest from {start:.3f} s to "
            f"{end:.3f} s, and {space.joint_names[worst]} moves by "
            f"{scenario.units.text(distance, unit, '.3g')}, tolerance "
            f"{scenario.units.text(tolerance, unit, '.3g')}",
            value=distance,
            limit=tolerance,
            unit=unit,
            time=float(extrema.peak_time[worst]),
            interval=(start, end),
        )
