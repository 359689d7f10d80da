"""The finding for a velocity limit that is exceeded whatever solutions are chosen."""

from __future__ import annotations

from knotwork.errors.plain_text import one_line
from knotwork.planning.task_to_joint import Infeasibility
from knotwork.units import Units, readable
from knotwork.verification import Finding

FEASIBILITY = "Feasibility"
"""Group of findings that hold for every motion through the joint waypoints."""


def infeasible(limit: Infeasibility, units: Units) -> Finding:
    """The finding for a velocity limit that is exceeded whatever solutions are chosen."""
    needed, _ = units.shown(limit.velocity, limit.unit)
    allowed = units.text(limit.limit, limit.unit, ".4g")
    why = "on average" if limit.until else "for the tool's velocity"
    return Finding(
        group=FEASIBILITY,
        subject="waypoint",
        name=limit.waypoint,
        quantity="joint_velocity_needed",
        verdict="failed",
        fact=limit.fact,
        value=limit.velocity,
        limit=limit.limit,
        margin=limit.limit - limit.velocity,
        unit=limit.unit,
        time=None if limit.until else limit.start,
        label=f"{one_line(limit.joint)} needs {readable(needed)} of {allowed} {why}",
        remedy=limit.remedy,
        interval=(limit.start, limit.end) if limit.until else None,
    )
