"""Motion of joints during waits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.errors.plain_text import waypoint_text
from knotwork.polynomial.refined import cut_curve
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.finding import Finding, judged
from knotwork.verification.motion import Motion
from knotwork.verification.waypoints import furthest_off


def waits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Compare joint positions during each wait with those at its start, over all time."""
    tolerances = np.array([scenario.tolerances.joint_position[unit] for unit in space.joint_units])
    for i in space.waits:
        waypoint = scenario.waypoints[i]
        start = max(waypoint.time, motion.start_time)
        end = min(scenario.waypoints[i + 1].time, motion.end_time)
        if end <= start:
            continue
        found = cut_curve(motion.curve, start, end).extrema()
        begin = motion.curve(start)
        moved = np.maximum(found.maximum - begin, begin - found.minimum)
        upwards = found.maximum - begin >= begin - found.minimum
        times = np.where(upwards, found.maximum_time, found.minimum_time)
        worst = furthest_off(moved, tolerances)
        distance, tolerance = float(moved[worst]), float(tolerances[worst])
        unit = space.joint_units[worst]
        yield Finding(
            group="Waits",
            subject="wait",
            name=waypoint.name,
            quantity="movement",
            verdict=judged(bool((moved <= tolerances).all())),
            message=f"{waypoint_text(waypoint.name)}: the arm is to stand still from {start:.3f} s "
            f"to {end:.3f} s, and {space.joint_names[worst]} moves by "
            f"{scenario.units.text(distance, unit, '.3g')}, tolerance "
            f"{scenario.units.text(tolerance, unit, '.3g')}",
            value=distance,
            limit=tolerance,
            margin=tolerance - distance,
            unit=unit,
            time=float(times[worst]),
            interval=(start, end),
        )
