"""The finding for a velocity limit that is exceeded whatever solutions are chosen."""

from __future__ import annotations

from knotwork.errors.plain_text import one_line
from knotwork.task_to_joint import Infeasibility
from knotwork.units import Units, readable
from knotwork.verification import Finding

FEASIBILITY = "Feasibility"
"""Group of findings that hold whatever motion goes through the joint waypoints."""


def infeasible(found: Infeasibility, units: Units) -> Finding:
    """The finding for a velocity limit that is exceeded whatever solutions are chosen."""
    needed, _ = units.shown(found.velocity, found.unit)
    allowed = units.text(found.limit, found.unit, ".4g")
    why = "on average" if found.until else "for the tool's velocity"
    return Finding(
        group=FEASIBILITY,
        subject="waypoint",
        name=found.waypoint,
        quantity="joint_velocity_needed",
        verdict="failed",
        fact=found.sentence.removesuffix(f"; {found.remedy}"),
        value=found.velocity,
        limit=found.limit,
        margin=found.limit - found.velocity,
        unit=found.unit,
        time=None if found.until else found.start,
        label=f"{one_line(found.joint)} needs {readable(needed)} of {allowed} {why}",
        remedy=found.remedy,
        interval=(found.start, found.end) if found.until else None,
    )
