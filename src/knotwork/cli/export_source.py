"""What `knotwork export` exports: a motion, what it is for as far as known, and the verdicts."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from knotwork.cli.sources import (
    echo_failures,
    is_trajectory,
    read_checked,
    read_unchecked,
    refuse,
    refuse_planning,
)
from knotwork.errors import InputError

if TYPE_CHECKING:
    from knotwork.cli.sources import CheckedFile
    from knotwork.export import Format, Points
    from knotwork.pipeline import Plan
    from knotwork.robot import Robot
    from knotwork.trajectory import JointTrajectory
    from knotwork.verification.report import Defect, Jump, LimitUse, Requirement

MOST_FAILURES = 10


@dataclass(frozen=True, eq=False)
class Source:
    """A motion to export.

    Attributes:
        trajectory: The motion.
        asked: What it is for, and what the check of it found, if known.
    """

    trajectory: JointTrajectory
    asked: Plan | CheckedFile | None = None

    @property
    def robot(self) -> Robot | None:
        """What moves the tool, if known."""
        return self.asked.space.robot if self.asked is not None else None


def read_source(motion: str, reference: str | None, planner: str | None) -> Source:
    """Plan a scenario, or read a stored trajectory and check it against its scenario if told.

    Raises:
        InputError: An option belongs to the other of the two, the motion is another tool's file,
            or it can't be planned or read.
    """
    if not is_trajectory(motion):
        refuse({"--scenario": reference}, f"{motion!r} is a scenario itself")
        from knotwork.pipeline import plan

        planned = plan(motion, planner=planner)
        return Source(planned.trajectory, planned)
    refuse_planning(motion, planner=planner)
    from knotwork.foreign import is_foreign

    if is_foreign(motion):
        raise InputError(
            f"{motion!r} holds samples or points, and export does not make others of them: it "
            "takes a scenario, or the trajectory.json that plan writes; such files can be "
            f"checked, with knotwork check {motion} --scenario SCENARIO"
        )
    if reference is None:
        return Source(read_unchecked(motion, strict=True))
    checked = read_checked(motion, reference)
    return Source(checked.trajectory, checked)


def passes(source: Source, allowed: bool) -> bool:
    """Say if the motion fails its check, and whether it is to be exported."""
    if source.asked is None or source.asked.report.ok:
        return True
    report = source.asked.report
    verdict = "exported all the same" if allowed else "not exported (--allow-failed exports it)"
    lines = [f"{report.scenario}: {failure}" for failure in report.failures]
    _show(lines, f"{report.scenario} fails its check: {verdict}")
    return allowed


def points_pass(source: Source, points: Points, form: Format, allowed: bool) -> bool:
    """Say if what a receiver makes of fitted points fails the check, and whether they are exported.

    They are checked as the motion is. A fit by cubics always has jumps of the acceleration, and is
    off in it: that is said, but does not stop the export.
    """
    if points.exact or source.asked is None:
        return True
    from knotwork.verification import check

    asked = source.asked
    report = check(points.trajectory, asked.scenario, space=asked.space)
    if report.ok:
        return True
    failures = [one for one in report.failures if one not in asked.report.failures]
    if points.with_acceleration or not all(map(_of_acceleration, failures)):
        verdict = ("not exported (--allow-failed exports them)", "exported all the same")[allowed]
    else:
        verdict, allowed = "exported, because a fit by cubics can't do better", True
    said = [f"the {points.count} points of --fit fail the check: {verdict}"]
    if not points.with_acceleration:
        if "accelerations" in form.options:
            said.append("--accelerations sends accelerations too")
        said.append("a planner of cubics needs no --fit")
    lines = [f"{report.scenario}: the points of --fit: {failure}" for failure in failures]
    _show(lines, f"{report.scenario}: {'; '.join(said)}")
    return allowed


def _of_acceleration(failure: Requirement | LimitUse | Jump | Defect) -> bool:
    """Whether the acceleration jumps, or is not the one asked for at a waypoint."""
    from knotwork.verification.report import Jump, Requirement

    if isinstance(failure, Jump):
        return failure.quantity == "acceleration"
    return isinstance(failure, Requirement) and failure.quantity == "joint_acceleration"


def _show(lines: list[str], verdict: str) -> None:
    echo_failures(lines, MOST_FAILURES, "and")
    click.echo(verdict, err=True)
    sys.stderr.flush()
