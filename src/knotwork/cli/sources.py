"""Input of the commands: a scenario to plan, or a trajectory file of any tool."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from knotwork import planning
from knotwork.cli.logs import (
    LogOptions,
    checked_log,
    log_beside_plan,
    planned_scenario,
    smoothed_log,
)
from knotwork.cli.parameters import PlanOptions, options_by_name, refuse
from knotwork.cli.progress_display import show_planning
from knotwork.cli.terminal import echo, print_note
from knotwork.curves.interpolation import get_planner
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files.documents import resources
from knotwork.files.foreign import is_foreign, is_trajectory, read_trajectory
from knotwork.files.storage import changed_since_report
from knotwork.planning import Plan
from knotwork.planning.check_trajectory import check_with_task
from knotwork.robot import Robot
from knotwork.verification.brief import finding_lines
from knotwork.verification.report import AnyMotion, CheckedMotion

MAX_NOTED_FAILURES = 3
"""Maximum number of kinds of failures that are listed; the others are counted."""


def read_motions(
    source: str,
    reference: str | None,
    options: PlanOptions | None = None,
    compare: list[str] | None = None,
    *,
    robot: Robot | None = None,
    log: LogOptions | None = None,
    find_scenario: bool = False,
) -> list[AnyMotion]:
    """Plan a scenario, or read a trajectory and check it if its scenario is given.

    Args:
        source: A scenario's name, or the path of a scenario or trajectory.
        reference: Scenario of a trajectory.
        options: Planning options of a scenario.
        compare: Other planners for a scenario; their plans follow the first plan.
        robot: Robot of a trajectory without a scenario, if known.
        log: Options of a log. The plan with which the log is compared follows it.
        find_scenario: Take the scenario that the report of a plan states.

    Raises:
        InputError: An option does not apply to the source, or the motion can't be planned or
            read.
    """
    options = options if options is not None else PlanOptions()
    if not _is_trajectory(source, reference):
        if source in resources.names("scenarios") or Path(source).exists():  # else missing
            unfit = {"--robot": robot, "--scenario": reference, "--log or --against": log}
            refuse(unfit, f"{source} is a scenario itself")
        return list(_plan_all(source, options, compare or []))
    planning_options = options_by_name({"compare": compare, **asdict(options)})
    refuse(planning_options, f"{source} is a trajectory, which is planned already")
    if reference is None and robot is None and (find_scenario or log is not None):
        reference = planned_scenario(source, log)
    if reference is not None:
        refuse({"--robot": robot}, "the scenario names the robot")
        against = [] if log is None or log.against is None else [log.against]
        checked = read_checked(source, reference, log)
        return [checked, *(read_checked(plan, reference) for plan in against)]
    if log is None:
        return [read_unchecked(source, robot)]
    if robot is not None and log.against is None:
        return [smoothed_log(source, robot.joint_names, robot.joint_units, log).trajectory]
    alignment, plan = log_beside_plan(source, log)
    return [alignment.trajectory, plan]


def read_checked(path: str | Path, reference: str, log: LogOptions | None = None) -> CheckedMotion:
    """Read a trajectory of any tool, or a log, and check it against its scenario.

    Raises:
        InputError: A file can't be read, or the trajectory has other joints.
    """
    if log is not None:
        return checked_log(path, reference, log)
    if fault := changed_since_report(Path(path)):
        print_note(f"{path} {fault}")
    return check_with_task(path, reference)


def _is_trajectory(source: str, reference: str | None) -> bool:
    """Whether a source is a trajectory. If its scenario is given, every file but YAML is one."""
    if source in resources.names("scenarios"):
        return False
    if reference is not None and Path(source).suffix.lower() not in (".yaml", ".yml"):
        return True
    return is_trajectory(source)


def read_unchecked(path: str, robot: Robot | None) -> JointTrajectory:
    """Read a trajectory without its scenario.

    Raises:
        InputError: The file can't be read, or it contradicts itself or the report in its folder.
    """
    names, units = (robot.joint_names, robot.joint_units) if robot is not None else ((), ())
    if robot is None and is_foreign(path):
        raise InputError(
            f"{path} needs its scenario: give --scenario, or for `view` its robot with --robot"
        )
    owner = f"robot {robot.name!r}" if robot is not None else "the scenario"
    trajectory, defects = read_trajectory(path, names, units, owner=owner)
    if defects:
        raise InputError(f"{path}: {defects[0]}")
    fault = changed_since_report(Path(path))
    if fault is not None:
        accepted = "the files of one plan, or --scenario in a command that checks"
        raise InputError(f"{path} {fault}; accepted: {accepted}")
    return trajectory


def _plan_all(source: str, options: PlanOptions, planners: list[str]) -> list[Plan]:
    """Plan a scenario with its own planner and with others, each planner once."""
    for name in planners:
        get_planner(name)
    with show_planning(source) as progress:
        first = planning.plan(source, progress=progress, **asdict(options))
    plans = [first]
    for name in dict.fromkeys(planners):
        if name == plans[0].scenario.planner:
            continue
        try:
            with show_planning(f"{source}, {name}") as progress:
                plans.append(planning.plan(source, planner=name, progress=progress))
        except InputError as error:
            raise InputError(f"planner {name!r} can't be compared here: {error}") from error
    return plans


def checked_motions(motions: Iterable[AnyMotion]) -> list[CheckedMotion]:
    """The motions that were checked against a scenario."""
    return [motion for motion in motions if not isinstance(motion, JointTrajectory)]


def print_failures(motions: Iterable[AnyMotion]) -> None:
    """Print failed checks and their first failures on standard error."""
    for motion in checked_motions(motions):
        report = motion.report
        if not report.ok:
            motion_name = f"{report.scenario}, {motion.trajectory.origin}"
            print_note(f"{motion_name}: the check FAILS")
            for failure in finding_lines(report.failures, MAX_NOTED_FAILURES):
                echo(f"  {failure}", err=True)
