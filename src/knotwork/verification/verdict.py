"""The check of a trajectory against its scenario.

The check is independent of planning. From the trajectory and the scenario alone it recomputes the
tool's pose and velocity at each waypoint, limits of joints, tool and links over all time, and
continuity.
"""

from __future__ import annotations

from collections.abc import Sequence

from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace, joint_space
from knotwork.spline.trajectory import JointTrajectory
from knotwork.verification.checked_motion import Motion
from knotwork.verification.checks import CHECKS
from knotwork.verification.finding import Finding
from knotwork.verification.report import Report
from knotwork.verification.waypoint_checks import motion_finding


def check(
    trajectory: JointTrajectory,
    scenario: Scenario,
    *,
    space: JointSpace | None = None,
    defects: Sequence[str] = (),
    known: Sequence[Finding] = (),
) -> Report:
    """Check a trajectory against a scenario, by every check in `knotwork.verification.CHECKS`.

    Position, velocity, acceleration and jerk limits hold over all time: their extrema are exact.
    Each finding has its kind of proof.

    Args:
        trajectory: The motion, with joints in any order.
        scenario: The task.
        space: The scenario's joints and robot, if already loaded.
        defects: Texts of known faults of the trajectory; each fails the report.
        known: Additional findings for the report.

    Raises:
        InputError: The trajectory has other joints than the scenario, the scenario's robot can't
            be loaded, or its times are free.

    >>> plan = kw.plan("paper_case")
    >>> kw.check(plan.trajectory, plan.scenario).ok
    True
    """
    if scenario.free is not None:
        raise InputError(
            f"{scenario.name} leaves times or speeds free, so it does not say what the motion has "
            "to do when; accepted: scenario.yaml, which plan --out writes beside the trajectory, "
            "or what plan --freeze writes"
        )
    space = space if space is not None else joint_space(scenario)
    motion = Motion(trajectory, space)
    faults = [motion_finding("defect", message, ok=False) for message in defects]
    findings = [item for run in CHECKS.values() for item in run(motion, scenario, space)]
    return Report(
        scenario=scenario.name,
        robot=space.robot.name if space.robot is not None else None,
        planner=trajectory.planner,
        start_time=trajectory.start_time,
        end_time=trajectory.end_time,
        findings=(*faults, *known, *findings),
        units=scenario.units,
    )
