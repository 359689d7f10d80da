"""The registry of checks, in the order of the report."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.verification.bounded_limits import (
    check_effort_limits,
    check_singularity,
    check_tool_limits,
)
from knotwork.verification.collisions import check_collisions
from knotwork.verification.continuity import check_continuity, check_resolution
from knotwork.verification.event_checks import check_events, report_cycles, report_segments
from knotwork.verification.finding import Finding
from knotwork.verification.freedom_use import report_freedoms
from knotwork.verification.limits import (
    check_joint_limits,
    check_unreachable_accelerations,
    report_unlimited,
)
from knotwork.verification.motion import Motion
from knotwork.verification.path_checks import check_tool_paths, check_uneven_points
from knotwork.verification.waypoint_checks import (
    check_joint_values,
    check_time_span,
    check_tool_poses,
    check_waits,
    report_approach,
)

Check = Callable[[Motion, Scenario, JointSpace], Iterable[Finding]]
"""Function that gives the findings on a motion of a scenario's joints."""

CHECKS: dict[str, Check] = {
    "time_span": check_time_span,
    "tool_at_waypoints": check_tool_poses,
    "joints_at_waypoints": check_joint_values,
    "tool_paths": check_tool_paths,
    "uneven_points": check_uneven_points,
    "freedoms": report_freedoms,
    "waits": check_waits,
    "events": check_events,
    "segments": report_segments,
    "cycles": report_cycles,
    "joint_limits": check_joint_limits,
    "effort_limits": check_effort_limits,
    "missing_limits": report_unlimited,
    "tool_limits": check_tool_limits,
    "collisions": check_collisions,
    "continuity": check_continuity,
    "unreachable_accelerations": check_unreachable_accelerations,
    "resolution": check_resolution,
    "singularity": check_singularity,
    "approach": report_approach,
}
"""Checks by name. `CHECKS["name"] = function` adds a check: its findings are in the report, in its
pages and tables and in the exit code like all others."""

CHECKS_OF_WAYPOINTS = (
    "time_span", "tool_at_waypoints", "joints_at_waypoints", "segments", "approach"
)  # fmt: skip
"""Names of checks whose findings mean nothing without the waypoints of a task."""

_SHIPPED = dict(CHECKS)


def own_checks() -> list[str]:
    """Names of checks that were added, replaced or removed, which other processes don't have.

    >>> own_checks()
    []
    """
    return [name for name in {**_SHIPPED, **CHECKS} if CHECKS.get(name) is not _SHIPPED.get(name)]
