"""What commands are given: a scenario to plan, or a file with a trajectory of any tool."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knotwork.errors import InputError

if TYPE_CHECKING:
    from knotwork.joint_space import JointSpace
    from knotwork.pipeline import Plan
    from knotwork.robot import Robot
    from knotwork.scenario import Scenario
    from knotwork.trajectory import JointTrajectory
    from knotwork.verification import Report

# What a failed check says before it only counts.
MOST_FAILURES = 3


@dataclass(frozen=True, eq=False)
class CheckedFile:
    """A trajectory from a file, checked against its scenario; it can be shown as a plan can.

    Attributes:
        trajectory: The motion.
        scenario: What it is to do.
        space: The scenario's joints and robot.
        report: What the check found.
        joint_waypoints: `None`, because a file does not say them.
    """

    trajectory: JointTrajectory
    scenario: Scenario
    space: JointSpace
    report: Report
    joint_waypoints: None = None


def is_trajectory(source: str) -> bool:
    """Whether the path of a trajectory is given, and not a scenario."""
    from knotwork import foreign, resources

    return source not in resources.names("scenarios") and foreign.is_trajectory(source)


def read_checked(path: str | Path, reference: str) -> CheckedFile:
    """Read a trajectory of any tool and check it against its scenario.

    Raises:
        InputError: One of them can't be read, or the trajectory is of other joints.
    """
    from knotwork.foreign import read_trajectory
    from knotwork.joint_space import joint_space
    from knotwork.scenario import load_scenario
    from knotwork.verification import check

    scenario = load_scenario(reference)
    space = joint_space(scenario)
    span = (float(scenario.times[0]), float(scenario.times[-1]))
    trajectory, defects = read_trajectory(path, space.joint_names, space.joint_units, span=span)
    report = check(trajectory, scenario, space=space, defects=defects)
    return CheckedFile(trajectory, scenario, space, report)


def read_unchecked(
    path: str | Path, robot: Robot | None = None, *, strict: bool = False
) -> JointTrajectory:
    """Read a trajectory without its scenario; that of another tool needs its robot.

    Args:
        path: Of the file or folder.
        robot: What it moves, if known.
        strict: Refuse what contradicts itself, which otherwise is only said on standard error.

    Raises:
        InputError: It can't be read, or is another tool's and no robot is given.
    """
    from knotwork.foreign import is_foreign, read_trajectory

    names, units = (robot.joint_names, robot.joint_units) if robot is not None else ((), ())
    if robot is None and is_foreign(path):
        raise InputError(
            f"{path} holds points or samples, and does not say all of the joints they are for; "
            "give the scenario they are for with --scenario"
        )
    trajectory, defects = read_trajectory(path, names, units)
    for defect in defects:
        if strict:
            raise InputError(f"{path}: {defect}")
        click.echo(f"note: {path}: {defect}", err=True)
    return trajectory


def refuse(options: dict[str, Any], reason: str) -> None:
    """Refuse those options that are given.

    Raises:
        InputError: One is.
    """
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise InputError(f"{reason}: leave out {', '.join(given)}")


def refuse_planning(source: str, **options: Any) -> None:
    """Refuse options of planning for a trajectory.

    Raises:
        InputError: One is given.
    """
    given = {f"--{name}": value for name, value in options.items()}
    refuse(given, f"{source} is a trajectory, which is planned already")


def planned(source: str, planner: str | None, knots: Any, others: list[str]) -> list[Plan]:
    """Plan a scenario with its planner and with others; each planner once."""
    from knotwork import pipeline
    from knotwork.interpolation import get_planner

    for name in others:
        get_planner(name)
    plans = [pipeline.plan(source, planner=planner, knots=knots)]
    for name in dict.fromkeys(others):
        if name == plans[0].scenario.planner:
            continue
        try:
            plans.append(pipeline.plan(source, planner=name))
        except InputError as error:
            raise InputError(f"planner {name!r} can't be compared here: {error}") from error
    for plan in plans:
        report_failure(f"{plan.scenario.name}, {plan.scenario.planner}", plan.report)
    return plans


def report_failure(which: str, report: Report) -> None:
    """Say on standard error if a check has failed, and what first."""
    if report.ok:
        return
    click.echo(f"note: {which}: the check FAILS", err=True)
    echo_failures([f"  {failure}" for failure in report.failures], MOST_FAILURES, "  and")


def echo_failures(lines: list[str], most: int, rest: str) -> None:
    """Write lines to standard error, and of more than some only how many more there are."""
    for line in lines[:most]:
        click.echo(line, err=True)
    if len(lines) > most:
        click.echo(f"{rest} {len(lines) - most} more", err=True)
