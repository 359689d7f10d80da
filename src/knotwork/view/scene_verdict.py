"""The verdict of the check as plain data for a scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from knotwork.errors.plain_text import waypoint_text
from knotwork.robot import Robot
from knotwork.task.scenario import Scenario
from knotwork.units import Units
from knotwork.verification import Finding, Report
from knotwork.verification.brief import failure_text, group_alike, highlights_by_group
from knotwork.verification.motion import describe_time
from knotwork.view.base_joints import base_joints
from knotwork.view.shown_motion import ShownMotion


def check_results(shown: ShownMotion) -> dict[str, Any]:
    """Summary, failures and contacts of the check; empty if there was none."""
    report = shown.report
    if report is None:
        nothing: dict[str, Any] = {"failures": [], "highlights": {}, "contacts": []}
        return {"ok": None, "summary": "", "duration": "", **nothing}
    return {
        "ok": report.ok,
        "summary": report.summary,
        "duration": f"{report.end_time - report.start_time:.5g} s",
        "highlights": highlights_by_group(report.groups),
        "failures": failures(report, shown.scenario),
        "contacts": _contacts(report, shown.robot),
    }


def failures(report: Report, scenario: Scenario) -> list[dict[str, Any]]:
    """Describe all failures: the worst of each kind first, then the others in order of time.

    Each has a short `line`, a `remedy`, the whole `fact`, the time to look `at` [s], and further
    times in `also`. The remedy of the first collision lists those that planning has tried.
    """
    kinds = group_alike(report.failures)
    others = [failure for _, *more in kinds for failure in more]
    ordered = [
        *(worst for worst, *_ in kinds),
        *sorted(others, key=lambda failure: failure.shown_time or 0.0),
    ]
    failure_texts = [_failure(failure, report.units, scenario) for failure in ordered]
    collisions = (i for i, failure in enumerate(ordered) if failure.bodies and not failure.remedy)
    first = next(collisions, 0)
    for text in map(str, report.tried if failure_texts else ()):
        remedy = failure_texts[first]["remedy"]
        failure_texts[first]["remedy"] = f"{remedy}; {text}" if remedy else text
    return failure_texts


def _failure(finding: Finding, units: Units, scenario: Scenario) -> dict[str, Any]:
    of_waypoint = finding.subject == "waypoint"
    named = replace(finding, name=waypoint_text(finding.name)) if of_waypoint else finding
    line, at = failure_text(named, units), finding.shown_time
    if not of_waypoint and at is not None and (finding.short_fact or finding.value is not None):
        middle = sum(finding.interval) / 2 if finding.interval else at
        time = at if finding.time is not None else middle
        line += f", {describe_time(scenario, time)}"
    further = [
        {
            "line": f"also {low:.3f} to {high:.3f} s, {describe_time(scenario, (low + high) / 2)}",
            "at": low,
        }
        for low, high in finding.intervals
        if at is None or not low <= at <= high
    ]
    return {"line": line, "remedy": finding.remedy, "fact": finding.fact, "at": at, "also": further}


def _contacts(report: Report, robot: Robot) -> list[dict[str, Any]]:
    """Contacts with their time intervals, the joints of touching links, and other bodies."""
    contacts = []
    first_joint = base_joints(robot).count
    for failure in report.failures:
        links = [name for name in failure.bodies if robot.model.existBodyName(name)]
        frames = [robot.model.frames[robot.model.getBodyId(name)] for name in links]
        joints = [first_joint + frame.parentJoint for frame in frames]
        others = [name for name in failure.bodies if name not in links]
        if failure.bodies:
            contacts.append({"spans": failure.intervals, "joints": joints, "bodies": others})
    return contacts
