"""What `knotwork export` exports: a motion, what it is for as far as known, and the verdicts."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from knotwork.errors import DocumentError, InputError

if TYPE_CHECKING:
    from knotwork.documents import Document
    from knotwork.export import Format, Points
    from knotwork.joint_space import JointSpace
    from knotwork.robot import Robot
    from knotwork.scenario import Scenario
    from knotwork.trajectory import JointTrajectory
    from knotwork.verification import Report
    from knotwork.verification.report import Defect, Jump, LimitUse, Requirement

MOST_FAILURES = 10
TABLES = (".csv", ".tsv", ".txt")


@dataclass(frozen=True, eq=False)
class Source:
    """A motion to export.

    Attributes:
        trajectory: The motion.
        scenario: What it is for, if known.
        space: The scenario's joints and robot.
        report: What the check of the motion found.
    """

    trajectory: JointTrajectory
    scenario: Scenario | None = None
    space: JointSpace | None = None
    report: Report | None = None

    @property
    def robot(self) -> Robot | None:
        """What moves the tool, if known."""
        return self.space.robot if self.space is not None else None


def read_source(motion: str, reference: str | None, planner: str | None) -> Source:
    """Plan a scenario, or read a stored trajectory and check it against its scenario if told.

    Raises:
        InputError: An option belongs to the other of the two, the motion is another tool's file,
            or it can't be planned or read.
    """
    path = Path(motion)
    if path.suffix.lower() in TABLES:
        raise _foreign(motion)
    stored = path.suffix == ".json" or (path.is_dir() and (path / "trajectory.json").exists())
    return _stored(path, reference, planner) if stored else _planned(motion, reference, planner)


def _foreign(motion: str | Path) -> InputError:
    return InputError(
        f"{str(motion)!r} holds samples or points, of which export makes nothing: it takes a "
        "scenario, or the trajectory.json that plan writes; such files can be checked, with "
        f"knotwork check {motion} --scenario SCENARIO"
    )


def _planned(motion: str, reference: str | None, planner: str | None) -> Source:
    if reference is not None:
        raise InputError(
            f"--scenario belongs to a stored trajectory, and {motion!r} is a scenario itself; "
            "a stored one is a .json file or a folder with a trajectory.json"
        )
    from knotwork.pipeline import plan

    try:
        planned = plan(motion, planner=planner)
    except DocumentError as error:
        if _holds_points(error.file):
            raise _foreign(motion) from error
        raise
    return Source(planned.trajectory, planned.scenario, planned.space, planned.report)


def _holds_points(file: Path | str | None) -> bool:
    """Whether a file that is no scenario is a trajectory of another tool."""
    from knotwork import documents
    from knotwork.foreign.reading import holds_points

    try:
        return file is not None and holds_points(documents.read(Path(file)))
    except DocumentError:
        return False


def _stored(path: Path, reference: str | None, planner: str | None) -> Source:
    if planner is not None:
        raise InputError("--planner belongs to a scenario; the trajectory is planned already")
    from knotwork import storage
    from knotwork.foreign.reading import holds_points

    document: Document = storage.read_trajectory_document(path)
    if holds_points(document):
        raise _foreign(path)
    trajectory = storage.trajectory_from_dict(document)
    disagreement = storage.knot_disagreement(document, trajectory)
    if disagreement is not None:
        raise InputError(f"{path}: {disagreement.rpartition(';')[0]}; it has been tampered with")
    if reference is None:
        return Source(trajectory)
    from knotwork.joint_space import joint_space
    from knotwork.scenario import load_scenario
    from knotwork.verification import check

    scenario = load_scenario(reference)
    space = joint_space(scenario)
    return Source(trajectory, scenario, space, check(trajectory, scenario, space=space))


def passes(source: Source, allowed: bool) -> bool:
    """Say if the motion fails its check, and whether it is to be exported."""
    report = source.report
    if report is None or report.ok:
        return True
    verdict = "exported all the same" if allowed else "not exported (--allow-failed exports it)"
    _show([str(failure) for failure in report.failures], report, f"fails its check: {verdict}")
    return allowed


def points_pass(source: Source, points: Points, form: Format, allowed: bool) -> bool:
    """Say if what a receiver makes of fitted points fails the check, and whether they are exported.

    It is checked as the motion is, and as the file will be. That the
    acceleration is off and jumps is what a fit by cubics is: it is said, and no hindrance.
    """
    if points.exact or source.scenario is None:
        return True
    from knotwork.verification import check

    report = check(points.trajectory, source.scenario, space=source.space)
    if report.ok:
        return True
    known = source.report.failures if source.report is not None else ()
    failures = [failure for failure in report.failures if failure not in known]
    lost = [failure for failure in failures if not _of_acceleration(failure)]
    lines = [str(failure) for failure in failures]
    if points.with_acceleration or lost:
        allowance = "exported all the same" if allowed else "not exported"
        verdict = f"{allowance}{'' if allowed else ' (--allow-failed exports them)'}"
    else:
        verdict, allowed = "exported, because a fit by cubics can't do better", True
    ways = []
    if not points.with_acceleration:
        if "accelerations" in form.options:
            ways.append("--accelerations carries accelerations too")
        ways.append("a planner of cubics needs no --fit")
    what = f"the {points.count} points of --fit fail the check"
    _show(lines, report, "; ".join((f"{what}: {verdict}", *ways)), of=": the points of --fit")
    return allowed


def _of_acceleration(failure: Requirement | LimitUse | Jump | Defect) -> bool:
    """Whether the acceleration jumps, or is not the one asked for at a waypoint."""
    from knotwork.verification.report import Jump, Requirement

    if isinstance(failure, Jump):
        return failure.quantity == "acceleration"
    return isinstance(failure, Requirement) and failure.quantity == "joint_acceleration"


def _show(lines: list[str], report: Report, verdict: str, of: str = "") -> None:
    for line in lines[:MOST_FAILURES]:
        click.echo(f"{report.scenario}{of}: {line}", err=True)
    if len(lines) > MOST_FAILURES:
        click.echo(f"and {len(lines) - MOST_FAILURES} more", err=True)
    click.echo(f"{report.scenario}{':' if of else ''} {verdict}", err=True)
    sys.stderr.flush()
