"""The command `knotwork export`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    PlanOptions,
    exit_codes,
    given_options,
    package_path_option,
    scenario_option,
)
from knotwork.cli.sources import read_motions
from knotwork.cli.terminal import echo, echo_data
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files import export as exporting
from knotwork.files.export import MotionPoints
from knotwork.files.export.formats import FORMATS, Format, checked_options, get_format
from knotwork.files.export.labels import events_path, events_text
from knotwork.files.foreign import is_foreign
from knotwork.verification import Finding, Report, check
from knotwork.verification.brief import finding_lines
from knotwork.verification.report import CheckedMotion

_EXPORT_EPILOG = f"""
Formats:
{chr(10).join(f"{name:8} {file_format.summary}" for name, file_format in FORMATS.items())}

In MATLAB, for --format mat:
s = load('motion.mat');
pp = mkpp(s.breaks, s.coefs, s.d);
q = ppval(pp, linspace(s.breaks(1), s.breaks(end), 1000));
"""
_EXIT_CODES = exit_codes("the motion is exported", "a check fails, and nothing is exported")


MAX_EXPORT_FAILURES = 10
"""Maximum number of kinds of failures that are listed."""
UNMET_BY_CUBIC_FITS = ("acceleration_jump", "acceleration_change", "joint_acceleration", "jerk")
"""Quantities that fail if cubics join points of a smoother motion, at any density of points.

The acceleration jumps, so the jerk is unbounded.
"""


def _parse_joint_numbers(
    context: click.Context, parameter: click.Parameter, pairs: Any
) -> dict[str, float]:
    """Read `JOINT=NUMBER`, each joint once."""
    numbers: dict[str, float] = {}
    for pair in pairs:
        joint, _, text = pair.rpartition("=")
        try:
            number = float(text)
        except ValueError:
            joint, number = "", 0.0
        if not joint:
            raise click.BadParameter(f"{pair!r} is not accepted; give JOINT=NUMBER")
        if joint in numbers:
            raise InputError(f"{parameter.opts[0]} is given twice for joint {joint!r}")
        numbers[joint] = number
    return numbers


_UNWRAPPED = "\n".join(f"\b\n{part}\n" for part in _EXPORT_EPILOG.strip().split("\n\n"))


@click.command(epilog=f"{_UNWRAPPED}\n{_EXIT_CODES}")
@click.argument("motion", metavar="TRAJECTORY|SCENARIO")
@click.option(
    "--format",
    "-f",
    "name",
    required=True,
    metavar="FORMAT",
    help=f"{', '.join(FORMATS)}.",
)
@click.option(
    "--out",
    "-o",
    metavar="FILE",
    help="File to write; text goes to standard output without it.",
)
@click.option("--force", is_flag=True, help="Replace the file if it exists.")
@click.option(
    "--rate",
    metavar="HZ",
    type=click.FloatRange(min=0, min_open=True),
    help="Samples per second for csv, json, npz, parquet and mujoco; by default the scenario's or "
    "100. The last sample is exactly at the end.",
)
@click.option(
    "--lead",
    metavar="S",
    type=click.FloatRange(min=0),
    help="mujoco: kv/kp of the position actuators [s], lead time of their controls; 0 by default.",
)
@click.option(
    "--knots-only", is_flag=True, help="Points that define the whole motion, in place of samples."
)
@click.option(
    "--accelerations",
    is_flag=True,
    help="Include accelerations at the points; receivers then use quintics, not cubics.",
)
@click.option(
    "--tolerance",
    "--fit",
    "tolerance",
    metavar="TOLERANCE",
    type=float,
    help="Insert points until the interpolated motion is within this distance of the true one at "
    "all times [rad or m]. For krl, rapid and ls, which have straight lines, it is 0.001 by "
    "default. Without --accelerations the acceleration jumps at the points, and they fail the "
    "check of a scenario with continuity: 2, the default.",
)
@click.option("--goal", is_flag=True, help="ros2: a FollowJointTrajectory goal, not a message.")
@click.option("--degrees", is_flag=True, help="pvt: revolute joints in deg; prismatic stay in m.")
@click.option(
    "--scale",
    callback=_parse_joint_numbers,
    metavar="JOINT=NUMBER",
    multiple=True,
    help="pvt: drive units per rad (deg, m) of a joint; may be repeated.",
)
@click.option(
    "--offset",
    callback=_parse_joint_numbers,
    metavar="JOINT=NUMBER",
    multiple=True,
    help="pvt: position of the drive, in its units, at joint position 0; may be repeated.",
)
@click.option("--incremental", is_flag=True, help="pvt: times since the previous row.")
@click.option(
    "--labels",
    is_flag=True,
    help="Include the names of segments: as columns of text in tables, else in a second file. "
    "They are always included if there are events.",
)
@click.option("--without-events", is_flag=True, help="Leave out the switched signals.")
@package_path_option
@scenario_option("for the check before export and for the tool")
@click.option("--planner", metavar="NAME", help="For a SCENARIO: planner in place of its own.")
@click.option("--allow-failed", is_flag=True, help="Export a motion even if it fails its check.")
def export(
    motion: str,
    name: str,
    out: str | None,
    force: bool,
    reference: str | None,
    planner: str | None,
    allow_failed: bool,
    labels: bool,
    without_events: bool,
    **options: Any,
) -> int:
    """Export a motion: a stored TRAJECTORY, or a SCENARIO, planned first.

    TRAJECTORY is a trajectory.json or its folder, SCENARIO a shipped scenario's name
    or the path of a file. Samples have a fixed rate; with a robot they include the tool's pose and
    twist. Nothing is written if the motion fails its check, or if a receiver's motion through the
    points of --tolerance fails it in more than acceleration and jerk.
    """
    file_format = get_format(name)
    chosen = given_options(options)
    checked_options(file_format, chosen)
    if out is None and file_format.binary:
        raise InputError(f"format {name!r} is binary: give a file to write with -o FILE")
    if out is not None:
        exporting.checked_target(out, force=force)
    trajectory, checked = read_motion(motion, reference, planner)
    if without_events:
        trajectory = replace(trajectory, events=())
    if file_format.tabular and labels:
        chosen["labels"] = True
    needs_side_file = bool(trajectory.events or labels) and not file_format.events
    if needs_side_file and out is None:
        raise InputError(
            f"format {name!r} can't hold the events and segments of the motion; give a file "
            "with -o FILE, and they go into a second file, or --without-events"
        )
    if checked is not None and not checked.report.ok:
        print_failed_check(checked.report, allow_failed)
        if not allow_failed:
            return FAILED
    result = _content(file_format, trajectory, checked, chosen, allow_failed)
    if result is None:
        return FAILED
    content, note = result
    if out is None:
        echo_data(content)
        if note:
            echo(note, err=True)
        return PASSED
    side_content = events_text(trajectory) if needs_side_file else None
    exporting.write(out, content, force=force, side_content=side_content)
    files = f"{out} and {events_path(Path(out))}" if needs_side_file else out
    echo("; ".join(filter(None, (f"wrote {files}", note))))
    return PASSED


def _content(
    file_format: Format,
    trajectory: JointTrajectory,
    checked: CheckedMotion | None,
    chosen: dict[str, Any],
    allowed: bool,
) -> tuple[str | bytes, str] | None:
    """The content and a note on its accuracy, or `None` if its points fail the check."""
    motion: Any = trajectory
    chosen = dict(chosen)
    if file_format.straight or file_format.takes_points(chosen):
        tolerance = chosen.pop("tolerance", None)
        if file_format.straight:
            options = exporting.STRAIGHT[file_format.name]
            motion = exporting.straight_points(trajectory, **options, tolerance=tolerance)
        else:
            accelerations = chosen.get("accelerations", False)
            motion = exporting.motion_points(
                trajectory, accelerations=accelerations, tolerance=tolerance
            )
            if not accept_points(checked, motion, allowed):
                return None
    elif file_format.tabular and checked is not None:
        chosen.setdefault("rate", checked.scenario.task.rate)
    note = "" if motion is trajectory else motion.describe()
    robot = checked.joints.robot if checked is not None else None
    if file_format.tabular:
        table = exporting.motion_table(motion, robot=robot, **chosen)
        return exporting.content(table, file_format.name), table.note
    if "robot" in file_format.options:
        chosen["robot"] = robot
    return exporting.content(motion, file_format.name, **chosen), note


def read_motion(
    source: str, reference: str | None, planner: str | None
) -> tuple[JointTrajectory, CheckedMotion | None]:
    """Plan a scenario, or read a stored trajectory and check it against a given scenario.

    Returns:
        The motion, and its scenario with the findings of the check, if known.

    Raises:
        InputError: An option does not fit the source, the motion is another tool's file,
            or it can't be planned or read.
    """
    if is_foreign(source):
        raise InputError(
            f"{source!r} has samples or points, which export does not convert; accepted: a "
            "scenario, or the trajectory.json that plan writes. Samples and points can be checked: "
            f"knotwork check {source} --scenario SCENARIO"
        )
    motion = read_motions(source, reference, PlanOptions(planner))[0]
    return (motion, None) if isinstance(motion, JointTrajectory) else (motion.trajectory, motion)


def print_failed_check(report: Report, allowed: bool) -> None:
    """Print the failures of a motion, and whether it is exported."""
    verdict = "exported all the same" if allowed else "not exported (--allow-failed exports it)"
    verdict = f"{report.scenario} fails its check: {verdict}"
    _print_verdict(report.failures, f"{report.scenario}: ", verdict)


def accept_points(checked: CheckedMotion | None, points: MotionPoints, allowed: bool) -> bool:
    """Check fitted points, print their failures, and return whether to export the points.

    A fit by cubics always has errors and jumps of the acceleration. They are listed, but do not
    prevent the export.
    """
    if points.exact or checked is None:
        return True
    report = check(points.trajectory, checked.scenario, joints=checked.joints)
    if report.ok:
        return True
    failures = [finding for finding in report.failures if finding not in checked.report.failures]
    cubic = all(failure.quantity in UNMET_BY_CUBIC_FITS for failure in failures)
    if points.with_acceleration or not cubic:
        verdict = ("not exported (--allow-failed exports them)", "exported all the same")[allowed]
    else:
        verdict, allowed = "exported, because a fit by cubics always has these errors", True
    verdict = f"the {points.count} points of --tolerance fail the check: {verdict}"
    whose = f"{report.scenario}: the points of --tolerance: "
    _print_verdict(failures, whose, f"{report.scenario}: {verdict}")
    return allowed


def _print_verdict(failures: Sequence[Finding], whose: str, verdict: str) -> None:
    """Print failures, each after the text `whose` on their origin, and the verdict."""
    for failure in finding_lines(failures, MAX_EXPORT_FAILURES):
        echo(f"{whose}{failure}", err=True)
    echo(verdict, err=True)
    sys.stderr.flush()
