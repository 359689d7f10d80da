"""Missing limits of a robot, and accelerations that no arm reaches."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.joint_quantities import JOINT_QUANTITIES, MAGNITUDES, rate_unit
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion, place_of_time
from knotwork.verification.finding import Finding

NO_LIMIT = "No limit known"
MAX_ACCELERATION = 1e3
"""Acceleration that no arm reaches [rad/s² or m/s²], for joints without a limit."""


def missing_limits(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report missing limits of a robot, with the peaks of the motion."""
    if space.robot is None:
        return
    parts, short = [], []
    for quantity in MAGNITUDES:
        missing = np.flatnonzero(np.isinf(space.limits[quantity]))
        if not missing.size or (quantity == "effort" and space.robot.base_moves):
            continue
        order, subject, peak, place = JOINT_QUANTITIES[quantity].order, quantity, "", ""
        if missing.size < len(space.joint_names):
            subject += " of " + ", ".join(space.joint_names[i] for i in missing)
        if order is not None:
            extrema = motion.curve.extrema(order)
            i = int(missing[extrema.peak[missing].argmax()])
            unit = JOINT_QUANTITIES[quantity].units[space.joint_units[i]]
            peak = f" (peak {scenario.units.text(float(extrema.peak[i]), unit, '.4g')}"
            place = f", {space.joint_names[i]} at {extrema.peak_time[i]:.6g} s)"
        parts.append(f"{subject}{peak}{place}")
        short.append(f"{quantity}{peak})" if peak else quantity)
    if parts:
        yield Finding(
            NO_LIMIT, "motion", "", "missing_limits", "information",
            f"no limit is known for {space.robot.name} of {', '.join(parts)}",
            brief=", ".join(short),
        )  # fmt: skip


def unreachable_accelerations(
    motion: Motion, scenario: Scenario, space: JointSpace
) -> Iterator[Finding]:
    """Find accelerations above `MAX_ACCELERATION` of a robot's joints without a limit."""
    if space.robot is None:
        return
    extrema = motion.curve.extrema(2)
    unlimited = np.isinf(space.limits["acceleration"])
    for i in np.flatnonzero(unlimited & ~(extrema.peak <= MAX_ACCELERATION)):
        name, unit = space.joint_names[i], rate_unit(space.joint_units[i], 2)
        value, time = float(extrema.peak[i]), float(extrema.peak_time[i])
        reached, allowed = (scenario.units.text(x, unit) for x in (value, MAX_ACCELERATION))
        yield Finding.at_most(
            "Continuity", "joint", name, "acceleration_spike",
            f"joint {name!r}: acceleration peaks at {reached} at {time:.6g} s, "
            f"{place_of_time(scenario, time)}; without a limit, no more than {allowed} is accepted",
            value, MAX_ACCELERATION, unit=unit, time=time,
        )  # fmt: skip
