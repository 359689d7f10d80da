"""The check: does a trajectory do what its scenario asks for?

It knows nothing of how the trajectory was made. From the trajectory and the scenario alone it
recomputes the tool's pose and velocity at each waypoint, limits of joints, tool and links over all
time, and continuity.
"""

from __future__ import annotations

from collections.abc import Sequence

from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace, joint_space
from knotwork.trajectory import JointTrajectory
from knotwork.verification.checks import CHECKS
from knotwork.verification.finding import Finding
from knotwork.verification.motion import Motion
from knotwork.verification.report import Report
from knotwork.verification.waypoints import motion_finding


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
    Each finding says how it was found.

    Args:
        trajectory: The motion; its joints in any order.
        scenario: The task.
        space: The scenario's joints and robot, if they have been loaded already.
        defects: Faults of the trajectory known beforehand, in words; each fails the report.
        known: Findings made beforehand, which the report is to have too.

    Raises:
        InputError: The trajectory is not of the scenario's joints, the scenario's robot can't be
            loaded, or its times are free.

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
    found = [one for look in CHECKS.values() for one in look(motion, scenario, space)]
    return Report(
        scenario=scenario.name,
        robot=space.robot.name if space.robot is not None else None,
        planner=trajectory.planner,
        start_time=trajectory.start_time,
        end_time=trajectory.end_time,
        findings=(*faults, *known, *found),
        units=scenario.units,
    )
