"""The finding for a velocity limit that is exceeded whatever solutions are chosen."""

from __future__ import annotations

from knotwork.task_to_joint import Infeasibility
from knotwork.verification import Finding

FEASIBILITY = "Feasibility"
"""Group of findings that hold whatever motion goes through the joint waypoints."""


def infeasible(found: Infeasibility) -> Finding:
    """The finding for a velocity limit that is exceeded whatever solutions are chosen."""
    return Finding(
        group=FEASIBILITY,
        subject="waypoint",
        name=found.waypoint,
        quantity="joint_velocity_needed",
        verdict="failed",
        message=str(found),
        value=found.velocity,
        limit=found.limit,
        margin=found.limit - found.velocity,
        unit=found.unit,
        time=found.start,
        interval=(found.start, found.end) if found.until else None,
    )
