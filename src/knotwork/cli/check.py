"""`knotwork check`: a stored trajectory against a scenario, or a robot's log against a plan."""

from __future__ import annotations

import json
from pathlib import Path

import click

from knotwork.cli.logs import (
    RECORDING,
    LogOptions,
    compared_log,
    log_options,
    looks_recorded,
    planned_scenario,
    recording_hint,
)
from knotwork.cli.parameters import (
    EXIT_CODES,
    FAILED,
    PASSED,
    DecidingArgument,
    GivenPath,
    full_option,
    json_option,
    package_path_option,
    scenario_option,
)
from knotwork.cli.sources import read_checked
from knotwork.cli.terminal import echo


@click.command(epilog=EXIT_CODES)
@click.argument("trajectory", cls=DecidingArgument, type=GivenPath(path_type=Path))
@scenario_option("which it is checked against")
@log_options
@package_path_option
@full_option
@json_option
def check(
    trajectory: Path,
    reference: str | None,
    full: bool,
    as_json: bool,
    log: LogOptions | None,
) -> int:
    """Check a stored TRAJECTORY against a scenario and print the verdict.

    TRAJECTORY is a trajectory.json, a folder with one in it, or another tool's: CSV with headings,
    JSON with joint_names, time and positions, or YAML of a ROS 2 JointTrajectory. Joints are
    matched by name. Between the points of another tool the motion is what a ROS 2 controller
    makes of them: quintics if they have velocities and accelerations, cubics if they have
    velocities, and straight lines otherwise.

    With --log or --against it is the log of a robot: headings of PlotJuggler, ROS bags and RTDE are
    understood, the noise is estimated, and what fails by less than the noise can make is undecided.
    Its clock is set by the plan given with --against, or by planning the scenario. With --against
    the scenario may be left out: it is the plan's, where the report beside the plan says it.
    """
    scenario = None
    reference = reference if reference is not None else planned_scenario(log)
    pieces = 0
    if reference is not None:
        with recording_hint(trajectory, log):
            checked = read_checked(trajectory, reference, log)
        report, scenario = checked.report, checked.scenario
        pieces = len(checked.trajectory.polynomial.x) - 1
    elif log is not None:
        report = compared_log(trajectory, log)
    else:
        raise click.MissingParameter(param_hint="'--scenario' / '-s'", param_type="option")
    if as_json:
        echo(json.dumps(report.to_dict(), indent=1, allow_nan=False))
    else:
        if full:
            from knotwork.cli import report_tables

            report_tables.print_report(report, scenario)
        else:
            from knotwork.cli import short

            short.print_short(report)
            echo(f"the motion: {report.planner}")
            short.print_next(
                with_robot=report.robot is not None, with_scenario=scenario is not None
            )
    if log is None and not report.ok and looks_recorded(trajectory, pieces):
        echo(f"hint: {RECORDING}", err=True)
    return PASSED if report.ok else FAILED
