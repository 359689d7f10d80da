"""The motion for `knotwork export`, its scenario if known, and the verdicts."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from knotwork.cli.parameters import PlanOptions
from knotwork.cli.sources import CheckedFile, read_motions
from knotwork.cli.terminal import echo
from knotwork.errors import InputError
from knotwork.export import Format, Points
from knotwork.files.foreign import is_foreign
from knotwork.planning import Plan
from knotwork.spline.trajectory import JointTrajectory
from knotwork.verification import Finding, check
from knotwork.verification.checks import UNMET_BY_CUBIC_FITS
from knotwork.verification.worst import failure_lines

MOST_EXPORT_FAILURES = 10


def read_motion(
    source: str, reference: str | None, planner: str | None
) -> tuple[JointTrajectory, Plan | CheckedFile | None]:
    """Plan a scenario, or read a stored trajectory and check it against a given scenario.

    Returns:
        The motion, and its scenario with the findings of the check, if known.

    Raises:
        InputError: An option does not fit the source, the motion is another tool's file,
            or it can't be planned or read.
    """
    if is_foreign(source):
        raise InputError(
            f"{source!r} has samples or points, which export does not convert: it "
            "takes a scenario, or the trajectory.json that plan writes; such files can be "
            f"checked, with knotwork check {source} --scenario SCENARIO"
        )
    motion = read_motions(source, reference, PlanOptions(planner), strict=True)[0]
    return (motion, None) if isinstance(motion, JointTrajectory) else (motion.trajectory, motion)


def passes(asked: Plan | CheckedFile | None, allowed: bool) -> bool:
    """Report a failed check, and return whether to export the motion."""
    if asked is None or asked.report.ok:
        return True
    report = asked.report
    verdict = "exported all the same" if allowed else "not exported (--allow-failed exports it)"
    _show(report.failures, f"{report.scenario}: ", f"{report.scenario} fails its check: {verdict}")
    return allowed


def points_pass(
    asked: Plan | CheckedFile | None, points: Points, form: Format, allowed: bool
) -> bool:
    """Report fitted points that fail the check, and return whether to export them.

    The check is that of the motion. A fit by cubics always has errors and jumps of the
    acceleration: these are listed, but do not prevent the export.
    """
    if points.exact or asked is None:
        return True
    report = check(points.trajectory, asked.scenario, space=asked.space)
    if report.ok:
        return True
    failures = [finding for finding in report.failures if finding not in asked.report.failures]
    cubic = all(failure.quantity in UNMET_BY_CUBIC_FITS for failure in failures)
    if points.with_acceleration or not cubic:
        verdict = ("not exported (--allow-failed exports them)", "exported all the same")[allowed]
    else:
        verdict, allowed = "exported, because a fit by cubics always has these errors", True
    notes = [f"the {points.count} points of --fit fail the check: {verdict}"]
    if not points.with_acceleration:
        if "accelerations" in form.options:
            notes.append("--accelerations sends accelerations too")
        notes.append("a planner of cubics needs no --fit")
    whose = f"{report.scenario}: the points of --fit: "
    _show(failures, whose, f"{report.scenario}: {'; '.join(notes)}")
    return allowed


def _show(failures: Sequence[Finding], whose: str, verdict: str) -> None:
    for failure in failure_lines(failures, MOST_EXPORT_FAILURES):
        echo(f"{whose}{failure}", err=True)
    echo(verdict, err=True)
    sys.stderr.flush()
