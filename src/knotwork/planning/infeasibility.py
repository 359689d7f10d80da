"""The finding for a velocity limit that is exceeded whatever solutions are chosen."""

from __future__ import annotations

from knotwork.errors.plain_text import to_one_line
from knotwork.planning.task_to_joint import Infeasibility
from knotwork.units import Units, readable
from knotwork.verification import Finding

FEASIBILITY = "Feasibility"
"""Group of findings that hold for every motion through the joint waypoints."""


def infeasible(limit: Infeasibility, units: Units) -> Finding:
    """The finding for a velocity limit that is exceeded whatever solutions are chosen."""
    needed = units.shown(limit.velocity, limit.unit)[0]
    allowed = units.text(limit.limit, limit.unit, ".4g")
    if limit.until:
        why, place = "on average", f"from {limit.waypoint!r} to {limit.until!r}"
        duration = limit.end - limit.start
        remedy = (
            f"{duration / limit.fraction:.4g} s or more is sufficient for the mean, and they have "
            f"{duration:.4g} s"
        )
    else:
        why, place = "for the tool's velocity", f"at {limit.waypoint!r}"
        remedy = f"{limit.fraction:.3g} of that velocity is feasible"
    return Finding(
        group=FEASIBILITY,
        subject="waypoint",
        name=limit.waypoint,
        quantity="joint_velocity_needed",
        verdict="failed",
        fact=f"{place} {limit.joint} needs {units.text(limit.velocity, limit.unit, '.4g')} {why}, "
        f"and its limit is {allowed}",
        value=limit.velocity,
        limit=limit.limit,
        margin=limit.limit - limit.velocity,
        unit=limit.unit,
        time=None if limit.until else limit.start,
        label=f"{to_one_line(limit.joint)} needs {readable(needed)} of {allowed} {why}",
        remedy=remedy,
        interval=(limit.start, limit.end) if limit.until else None,
    )
