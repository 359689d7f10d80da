"""The registry of checks, in the order of the report."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification.bounded_limits import (
    check_effort_limits,
    check_singularity,
    check_tool_limits,
)
from knotwork.verification.collisions import check_collisions
from knotwork.verification.continuity import check_continuity, check_rounding
from knotwork.verification.event_checks import check_events, report_cycles, report_segments
from knotwork.verification.finding import Finding
from knotwork.verification.freedom_use import report_freedoms
from knotwork.verification.limits import (
    check_acceleration_spike,
    check_joint_limits,
    report_missing_limits,
)
from knotwork.verification.motion import Motion
from knotwork.verification.path_checks import check_curve_between_points, check_tool_paths
from knotwork.verification.waypoint_checks import (
    check_joints_at_waypoints,
    check_time_span,
    check_tool_at_waypoints,
    check_waits,
    report_no_start,
)

Check = Callable[[Motion, Scenario, ScenarioJoints], Iterable[Finding]]
"""Function from a motion, its scenario and its joints to findings."""


@dataclass(frozen=True)
class NeedsTask:
    """A check that is left out where a motion is checked without its task."""

    check: Check

    def __call__(
        self, motion: Motion, scenario: Scenario, joints: ScenarioJoints
    ) -> Iterable[Finding]:
        """The findings of the check."""
        return self.check(motion, scenario, joints)


CHECKS: dict[str, Check] = {
    "time_span": NeedsTask(check_time_span),
    "tool_at_waypoints": NeedsTask(check_tool_at_waypoints),
    "joints_at_waypoints": NeedsTask(check_joints_at_waypoints),
    "tool_paths": check_tool_paths,
    "curve_between_points": check_curve_between_points,
    "freedoms": report_freedoms,
    "waits": check_waits,
    "events": check_events,
    "segments": NeedsTask(report_segments),
    "cycles": report_cycles,
    "joint_limits": check_joint_limits,
    "effort_limits": check_effort_limits,
    "missing_limits": report_missing_limits,
    "tool_limits": check_tool_limits,
    "collisions": check_collisions,
    "continuity": check_continuity,
    "acceleration_spike": check_acceleration_spike,
    "rounding": check_rounding,
    "singularity": check_singularity,
    "no_start": NeedsTask(report_no_start),
}
"""Checks by name, in the order of the report.

The name serves to replace or remove a check; reports do not show it. `CHECKS["name"] = function`
adds one. Its findings are in the report, in pages and tables and in the exit code like all others.
"""

_SHIPPED = dict(CHECKS)


def changed_checks() -> list[str]:
    """Names of checks that were added, replaced or removed in this process only.

    >>> changed_checks()
    []
    """
    return [name for name in {**_SHIPPED, **CHECKS} if CHECKS.get(name) is not _SHIPPED.get(name)]
