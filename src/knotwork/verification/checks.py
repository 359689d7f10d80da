"""The registry of checks, in the order of the report."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.verification.bounded_limits import effort_limits, singularity, tool_limits
from knotwork.verification.checked_motion import Motion
from knotwork.verification.collisions import collisions
from knotwork.verification.continuity import continuity, cycles, resolution
from knotwork.verification.event_checks import events, parts
from knotwork.verification.finding import Finding
from knotwork.verification.freedom_use import freedoms_used
from knotwork.verification.limits import joint_limits, missing_limits, unreachable_accelerations
from knotwork.verification.path_checks import tool_paths, uneven_points
from knotwork.verification.waypoint_checks import (
    approach,
    joints_at_waypoints,
    time_span,
    tool_at_waypoints,
    waits,
)

Check = Callable[[Motion, Scenario, JointSpace], Iterable[Finding]]
"""Function that gives the findings on a motion of a scenario's joints."""

CHECKS: dict[str, Check] = {
    "time_span": time_span,
    "tool_at_waypoints": tool_at_waypoints,
    "joints_at_waypoints": joints_at_waypoints,
    "tool_paths": tool_paths,
    "uneven_points": uneven_points,
    "freedoms": freedoms_used,
    "waits": waits,
    "events": events,
    "segments": parts,
    "cycles": cycles,
    "joint_limits": joint_limits,
    "effort_limits": effort_limits,
    "missing_limits": missing_limits,
    "tool_limits": tool_limits,
    "collisions": collisions,
    "continuity": continuity,
    "unreachable_accelerations": unreachable_accelerations,
    "resolution": resolution,
    "singularity": singularity,
    "approach": approach,
}
"""Checks by name. `CHECKS["name"] = function` adds a check: its findings are in the report, in its
pages and tables and in the exit code like all others."""

_SHIPPED = dict(CHECKS)


def own_checks() -> list[str]:
    """Names of checks that were added, replaced or removed, which other processes don't have.

    >>> own_checks()
    []
    """
    return [name for name in {**_SHIPPED, **CHECKS} if CHECKS.get(name) is not _SHIPPED.get(name)]


UNMET_BY_CUBIC_FITS = ("acceleration_jump", "joint_acceleration", "jerk")
"""Quantities that fail if cubics join points of a smoother motion, at any density of points.

The acceleration jumps, so the jerk is unbounded.
"""
