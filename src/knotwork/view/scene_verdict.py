"""The verdict of the check as a scene has it, as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from knotwork.robot import Robot
from knotwork.units import Units
from knotwork.verification import Finding, Report
from knotwork.verification.brief import facts, in_short
from knotwork.verification.worst import alike, and_more


def verdict(report: Report | None, robot: Robot, first_joint: int) -> dict[str, Any]:
    """The findings of the check; the robot's joints are counted from `first_joint`."""
    if report is None:
        nothing: dict[str, Any] = {"failures": [], "tried": [], "facts": {}, "contacts": []}
        return {"ok": None, "summary": "", "duration": "", "failed": 0, **nothing}
    return {
        "ok": report.ok,
        "summary": report.summary,
        "duration": f"{report.end_time - report.start_time:.5g} s",
        "facts": facts(report.groups),
        "failed": len(report.failures),
        "failures": [failure(several, report.units) for several in alike(report.failures)],
        "tried": [str(item) for item in report.tried],
        "contacts": _contacts(report, robot, first_joint),
    }


def failure(several: Sequence[Finding], units: Units) -> dict[str, Any]:
    """The worst of failures that are alike: in a line, its remedy, all that is known, and when."""
    worst, *others = several
    return {
        "line": f"{in_short(worst, units)}{and_more(len(others))}",
        "remedy": worst.remedy,
        "fact": worst.fact,
        "at": worst.at,
    }


def _contacts(report: Report, robot: Robot, first_joint: int) -> list[dict[str, Any]]:
    """From when to when two bodies are too near: joints that carry links, and other bodies."""
    found = []
    for one in report.failures:
        links = [name for name in one.bodies if robot.model.existBodyName(name)]
        frames = [robot.model.frames[robot.model.getBodyId(name)] for name in links]
        joints = [first_joint + frame.parentJoint for frame in frames]
        things = [name for name in one.bodies if name not in links]
        if one.bodies:
            found.append({"spans": one.spans, "joints": joints, "things": things})
    return found
