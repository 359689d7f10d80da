"""The command `knotwork export`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knotwork.errors import InputError

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.scenario import Scenario
    from knotwork.trajectory import JointTrajectory
    from knotwork.witness import Report

PASSED, FAILED = 0, 1
MOST_FAILURES = 10
FORMATS = ("ros2", "pvt", "csv", "json", "npz", "parquet", "mat", "scipy", "drake")

_EPILOG = """
In MATLAB, for --format mat:
s = load('motion.mat');
pp = mkpp(s.breaks, s.coefs, s.d);
q = ppval(pp, linspace(s.breaks(1), s.breaks(end), 1000));

Exit codes: 0 it is exported, 1 a check fails and nothing is exported, 2 the input is wrong.
"""


class _JointNumbers(click.ParamType[Any]):
    """`JOINT=NUMBER`."""

    name = "joint=number"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        if isinstance(value, tuple):
            return value
        joint, _, number = str(value).rpartition("=")
        try:
            factor = float(number)
        except ValueError:
            factor = None
        if not joint or factor is None:
            self.fail(f"{value!r} is not accepted; give JOINT=NUMBER", param, ctx)
        return joint, factor


@click.command(epilog="\n".join(f"\b\n{part}\n" for part in _EPILOG.strip().split("\n\n")))
@click.argument("motion", metavar="TRAJECTORY|SCENARIO")
@click.option(
    "--format", "-f", "name", required=True, metavar="FORMAT", help=f"{', '.join(FORMATS)}."
)
@click.option(
    "--out",
    "-o",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="File to write; text goes to standard output without it.",
)
@click.option("--force", is_flag=True, help="Replace the file if it exists.")
@click.option(
    "--rate",
    metavar="HZ",
    type=click.FloatRange(min=0, min_open=True),
    help="Samples per second, of csv, json, npz and parquet; by default the scenario's, or 100. "
    "The last sample is at the end exactly.",
)
@click.option(
    "--knots-only", is_flag=True, help="Points that carry the whole motion, in place of samples."
)
@click.option(
    "--accelerations",
    is_flag=True,
    help="Points carry accelerations too; receivers then join them by quintics, not cubics.",
)
@click.option(
    "--fit",
    metavar="TOLERANCE",
    type=float,
    help="Insert points until a motion that points can't carry exactly is met within this, at all "
    "times [rad or m].",
)
@click.option("--goal", is_flag=True, help="ros2: a FollowJointTrajectory goal, not a message.")
@click.option("--degrees", is_flag=True, help="pvt: revolute joints in deg; prismatic stay in m.")
@click.option(
    "--scale",
    type=_JointNumbers(),
    metavar="JOINT=NUMBER",
    multiple=True,
    help="pvt: drive units a rad (deg, m) of a joint; may be repeated.",
)
@click.option(
    "--offset",
    type=_JointNumbers(),
    metavar="JOINT=NUMBER",
    multiple=True,
    help="pvt: the drive's position, in its units, where a joint is at 0; may be repeated.",
)
@click.option("--incremental", is_flag=True, help="pvt: times since the row before.")
@click.option(
    "--scenario",
    "-s",
    "reference",
    metavar="SCENARIO",
    help="For a TRAJECTORY: check it against this first, and take the tool from it.",
)
@click.option("--planner", metavar="NAME", help="For a SCENARIO: planner in place of its own.")
@click.option(
    "--allow-failed", is_flag=True, help="Export a motion although it fails its check, too."
)
def export(
    motion: str,
    name: str,
    out: Path | None,
    force: bool,
    reference: str | None,
    planner: str | None,
    allow_failed: bool,
    scale: tuple[tuple[str, float], ...],
    offset: tuple[tuple[str, float], ...],
    **options: Any,
) -> int:
    """Hand a motion over to what runs it: a stored TRAJECTORY, or a SCENARIO, planned first.

    \b
    ros2     YAML for ros2 topic pub, or with --goal for ros2 action send_goal
    pvt      position-velocity-time table for motion drives, as CSV
    csv, json, npz, parquet
             samples at a rate, or with --knots-only the points that carry
             the motion; with a robot the tool's pose and twist, too
    mat      polynomials for MATLAB's ppval
    scipy    c and x of a PPoly in an npz; trajectory.to_scipy() in Python
    drake    in Python only: trajectory.to_drake()

    TRAJECTORY is a trajectory.json or a folder with one in it, SCENARIO a shipped scenario's name
    or the path of a file. Nothing is written if the motion fails its check.
    """  # noqa: D301
    from knotwork import export as exporting

    form = exporting.get_format(name)
    given = {
        key: value for key, value in options.items() if value is not None and value is not False
    }
    for key, pairs in (("scale", scale), ("offset", offset)):
        if pairs:
            given[key] = _by_joint(pairs, key)
    exporting.checked_options(form, given)
    if not form.file_function:
        raise InputError(
            f"format {name!r} is an object in memory and has no file; make it in Python with "
            f"trajectory.{form.function}()"
        )
    if out is None and form.binary:
        raise InputError(f"format {name!r} is binary: give a file to write with -o FILE")
    target = exporting.checked_target(out, force=force) if out is not None else None
    trajectory, robot, scenario, report = _motion(motion, reference, planner)
    if report is not None and not report.ok:
        _show_failures(report, allow_failed)
        if not allow_failed:
            return FAILED
    if "robot" in form.options and robot is not None:
        given["robot"] = robot
    if "rate" in form.options and scenario is not None and not given.get("knots_only"):
        given.setdefault("rate", scenario.rate)
    content = exporting.content(trajectory, name, **given)
    if target is None:
        click.echo(content, nl=False)
    else:
        exporting.write(target, content, force=force)
    note = _note(trajectory, form.options, given)
    where = f"wrote {out}" if out is not None else ""
    text = "; ".join(part for part in (where, note) if part)
    if text:
        click.echo(text, err=out is None)
    return PASSED


def _by_joint(pairs: tuple[tuple[str, float], ...], what: str) -> dict[str, float]:
    values = dict(pairs)
    if len(values) < len(pairs):
        names = [joint for joint, _ in pairs]
        twice = next(joint for joint in names if names.count(joint) > 1)
        raise InputError(f"--{what} is given twice for joint {twice!r}")
    return values


def _motion(
    motion: str, reference: str | None, planner: str | None
) -> tuple[JointTrajectory, Robot | None, Scenario | None, Report | None]:
    """The trajectory with the robot that it moves, and the verdict on it, as far as known."""
    path = Path(motion)
    stored = path.suffix == ".json" or (path.is_dir() and (path / "trajectory.json").exists())
    if not stored:
        if reference is not None:
            raise InputError(
                f"--scenario belongs to a stored trajectory, and {motion!r} is a scenario itself; "
                "a stored one is a .json file or a folder with a trajectory.json"
            )
        from knotwork.pipeline import plan

        planned = plan(motion, planner=planner)
        return planned.trajectory, planned.space.robot, planned.scenario, planned.report
    if planner is not None:
        raise InputError("--planner belongs to a scenario; the trajectory is planned already")
    from knotwork import storage

    document = storage.read_trajectory_document(path)
    trajectory = storage.trajectory_from_dict(document)
    disagreement = storage.knot_disagreement(document, trajectory)
    if disagreement is not None:
        raise InputError(f"{path}: {disagreement.rpartition(';')[0]}; it has been tampered with")
    if reference is None:
        return trajectory, None, None, None
    from knotwork.joint_space import joint_space
    from knotwork.scenario import load_scenario
    from knotwork.witness import check

    scenario = load_scenario(reference)
    space = joint_space(scenario)
    return trajectory, space.robot, scenario, check(trajectory, scenario, space=space)


def _show_failures(report: Report, allowed: bool) -> None:
    for failure in report.failures[:MOST_FAILURES]:
        click.echo(f"{report.scenario}: {failure}", err=True)
    if len(report.failures) > MOST_FAILURES:
        click.echo(f"and {len(report.failures) - MOST_FAILURES} more", err=True)
    verdict = "exported all the same" if allowed else "not exported (--allow-failed exports it)"
    click.echo(f"{report.scenario} fails its check: {verdict}", err=True)
    sys.stderr.flush()


def _note(trajectory: JointTrajectory, known: tuple[str, ...], given: dict[str, Any]) -> str:
    """How many points it took, where points carry the motion."""
    if "fit" not in known or ("knots_only" in known and not given.get("knots_only")):
        return ""
    from knotwork.export import carry

    points = carry(trajectory, accelerations=bool(given.get("accelerations")), fit=given.get("fit"))
    return points.describe()
