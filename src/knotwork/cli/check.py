"""`knotwork check` and `knotwork report`: check a motion and print the verdict or a page."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from knotwork import planning
from knotwork.cli.logs import (
    LogOptions,
    log_beside_plan,
    log_options,
    planned_scenario,
    read_stated_scenario,
)
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    NonEmptyPath,
    PlanOptions,
    Seconds,
    bundle_options,
    exit_codes,
    full_option,
    html_option,
    json_option,
    motion_options,
    options_by_name,
    package_path_option,
    refuse,
    scenario_option,
)
from knotwork.cli.short_report import print_next, print_short
from knotwork.cli.sources import read_checked, read_motions
from knotwork.cli.terminal import echo, echo_json, echo_line
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import DocumentError, InputError
from knotwork.files.documents import resources
from knotwork.task.scenario import Scenario, load_scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints, read_scenario_joints
from knotwork.verification import Report
from knotwork.verification.recording import compare_log
from knotwork.verification.report import CheckedMotion

LOG_HINT = "for a recording of a robot, which has noise, use --log"

SceneOptions = dict[str, str | None]
"""Robot, scene and limits for the check of a trajectory without a scenario."""


def _scene_options(robot: str | None, scene: str | None, limits: str | None) -> SceneOptions | None:
    if robot is None and scene is None:
        reason = "neither --robot nor --scene is given"
        refuse({"--limits": limits}, reason, "give one of them, or leave out")
        return None
    return {"robot": robot, "scene": scene, "limits": limits}


scene_options = bundle_options("scene_only", _scene_options, (
    click.option("--limits", metavar="YAML|FILE",
            help="Without a scenario: limits in place of the robot's, such as "
            "'{acceleration: 8, jerk: 400}' or a file, in the units of the scene."),
    click.option("--scene", metavar="FILE", type=NonEmptyPath(),
            help="Without a scenario: a scenario file without waypoints: scene, "
            "frames, tool, limits, units."),
    click.option("--robot", metavar="ROBOT",
            help="Without a scenario: the name of a shipped robot, a URDF or a robot file."),
))  # fmt: skip


_WITH_HELP = "Report only the clearance to another robot's motion, with place and time."
_WITH_OPTIONS = (
    ("--delay", "delay", "TIME", Seconds(zero=True), "Delay of the motion of --with."),
    ("--in", "frame", "FRAME", str, "Frame of the base of the robot of --with."),
    ("--motion", "motion", "FILE", str, "Recorded motion of --with; by default it is planned."),
    ("--with", "other", "SCENARIO|PLAN", str, _WITH_HELP),
)


def _other_robot(
    other: str | None, motion: str | None, frame: str | None, delay: float | None
) -> dict[str, Any] | None:
    if other is None:
        unfit = {"--motion": motion, "--in": frame, "--delay": delay}
        refuse(unfit, "--with is not given", "give it, or leave out")
        return None
    if Path(other).is_dir():
        motion, folder = motion or other, other
        other = read_stated_scenario(folder) or ""
        if not other:
            raise InputError(f"{folder} names no scenario; accepted: --with SCENARIO --motion FILE")
    if motion is not None:
        path = Path(motion).absolute()
        motion = str(path / "trajectory.json" if path.is_dir() else path)
    return {
        "scenario": str(resources.find("scenarios", other).absolute()),
        "motion": motion,
        "in": frame,
        "delay": delay or 0.0,
    }


with_options = bundle_options(
    "other",
    _other_robot,
    [
        click.option(flag, key, metavar=metavar, type=kind, help=text)
        for flag, key, metavar, kind, text in _WITH_OPTIONS
    ],
)


@click.command(epilog=exit_codes())
@click.argument("trajectory", type=NonEmptyPath(path_type=Path))
@scenario_option("to check it against")
@scene_options
@log_options
@package_path_option
@full_option
@json_option
@with_options
def check(
    trajectory: Path,
    reference: str | None,
    full: bool,
    as_json: bool,
    log: LogOptions | None,
    other: dict[str, Any] | None,
    scene_only: SceneOptions | None,
) -> int:
    """Check a stored TRAJECTORY against a scenario and print the verdict.

    TRAJECTORY is a trajectory.json, its folder, or another tool's file: CSV with headings,
    JSON or NumPy's npz with joint_names, time and positions, YAML of a ROS 2 JointTrajectory or of
    MoveIt messages with one, or of a PiecewisePolynomial of Drake. Joints are matched by
    name. Other tools' points are interpolated as by a ROS 2 controller: by quintics
    if they have velocities and accelerations, by cubics if they have velocities, and by straight
    lines otherwise.

    With --robot or --scene in place of a scenario, limits, collisions and jumps are checked.

    With --log or --against, TRAJECTORY is the log of a robot: headings of PlotJuggler, ROS bags and
    RTDE are accepted, the noise is estimated, and failures smaller than the noise are undecided.
    The plan given with --against sets the clock; without it the scenario is planned. With --against
    the scenario may be left out if the report in the plan's folder names it.

    With --with, TRAJECTORY may also be a scenario, which is planned; one line reports how close two
    motions come, as in `knotwork check a.yaml --with b.yaml --in left`.
    """
    if other is not None:
        unfit = {"--full": full, "--log or --against": log, **options_by_name(scene_only or {})}
        refuse(unfit, "--with compares two motions")
        return check_together(str(trajectory), reference, other, as_json=as_json)
    if scene_only is not None:
        unfit = {"--scenario": reference, "--log or --against": log}
        refuse(unfit, "--robot and --scene are for a motion without a scenario")
    if reference is None and scene_only is None:
        reference = planned_scenario(trajectory, log)
    report, scenario = _checked_report(trajectory, reference, log, scene_only)
    if as_json:
        echo_json(report.to_dict())
    elif full:
        from knotwork.cli import report_tables

        report_tables.print_report(report, scenario)
    else:
        print_short(report)
        echo(f"motion from {report.origin}")
        if reference is not None and log is None:
            words = [os.path.join(".", trajectory), "-s", reference]  # no shipped scenario
            print_next(words, with_robot=report.robot is not None)
    if log is None and not report.ok and _is_csv(trajectory):
        echo(f"hint: {LOG_HINT}", err=True)
    return PASSED if report.ok else FAILED


def _is_csv(path: Path | str) -> bool:
    return Path(path).suffix.lower() == ".csv"


def _checked_report(
    trajectory: Path, reference: str | None, log: LogOptions | None, scene_only: SceneOptions | None
) -> tuple[Report, Scenario | None]:
    """Report and scenario of the check that the options select; a log may have no scenario."""
    if scene_only is not None:
        try:
            checked = planning.check_without_task(trajectory, **scene_only)
        except DocumentError as error:
            if error.file is None:
                raise DocumentError("command line", error.problems) from error
            raise
        return checked.report, checked.scenario
    if reference is not None:
        try:
            checked = read_checked(trajectory, reference, log)
        except DocumentError as error:
            if log is None and _is_csv(trajectory) and _is_csv(str(error.file)):
                raise InputError(f"{error}\n{LOG_HINT}") from error
            raise
        return checked.report, checked.scenario
    if log is None:
        raise click.MissingParameter(
            param_hint="'--scenario' / '-s', or '--robot'", param_type="option"
        )
    return compare_log(log_beside_plan(trajectory, log)[0], tolerances=log.tolerances), None


def _require_placement(source: str, scenario: Scenario, joints: ScenarioJoints, other: str) -> None:
    """Refuse robots without a known relative placement, unless they are two arms of one URDF."""
    other_joints = read_scenario_joints(load_scenario(other))
    if joints.robot is None or other_joints.robot is None:
        return  # reported by another error
    one_urdf = joints.robot.urdf == other_joints.robot.urdf
    if one_urdf and not set(joints.joint_names) & set(other_joints.joint_names):
        return
    why = "both motions are of the same joints" if one_urdf else "their URDFs are not the same"
    frames = ", ".join(dict.fromkeys([*scenario.frame_placements, "base"]))
    raise InputError(
        f"--with {other}: its robot has no placement, and {why}; accepted: --in with a "
        f"frame of {source}, one of {frames}"
    )


def _checked_motion(
    source: str,
    reference: str | None,
    options: PlanOptions | None = None,
    log: LogOptions | None = None,
) -> CheckedMotion:
    """Read one motion as `read_motions` does, and refuse one without a scenario."""
    motion = read_motions(source, reference, options, log=log, find_scenario=True)[0]
    if isinstance(motion, JointTrajectory):
        raise InputError(f"give the scenario of {source} with --scenario")
    return motion


def check_together(
    source: str, reference: str | None, other: Mapping[str, Any], *, as_json: bool
) -> int:
    """Print in one line how close two motions come, and give the exit code."""
    first = _checked_motion(source, reference)
    if other["in"] is None:
        _require_placement(source, first.scenario, first.joints, other["scenario"])
        other = {**other, "in": "base"}
    nearest = planning.clearance_between(
        first.trajectory, first.scenario, other, joints=first.joints
    )
    word, colour = ("clear:", "green") if nearest.ok else ("TOO NEAR:", "red")
    if as_json:
        echo_json(nearest.to_dict())
    else:
        echo_line(f"{word} {nearest.message}", word, fg=colour, bold=True)
    return PASSED if nearest.ok else FAILED


@click.command(epilog=exit_codes(failed="a check fails (the page is written)"))
@html_option(required=True)
@package_path_option
@log_options
@motion_options("to check it against")
def report(
    source: str,
    out: Path,
    options: PlanOptions,
    reference: str | None,
    log: LogOptions | None,
) -> int:
    """Write a page about a motion to print or send: verdict, tables, plots, 3D view.

    SCENARIO is the name of a shipped scenario or the path of a file; it is planned first.
    TRAJECTORY is any input of `knotwork check`; only a folder of `knotwork plan` needs no
    --scenario. The page is one file and needs no network.
    """
    from knotwork.view.html_report import report_page
    from knotwork.view.picture_files import checked_path

    checked_path("page", out)
    motion = _checked_motion(source, reference, options, log)
    page = report_page(motion)
    for warning in page.warnings:
        echo(f"warning: {warning}", err=True)
    written = page.save(out)
    word = "passed" if motion.report.ok else "FAILED"
    echo(f"{motion.scenario.name}: {word}; wrote {written}")
    return PASSED if motion.report.ok else FAILED
