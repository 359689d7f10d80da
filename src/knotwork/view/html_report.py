"""A report as one self-contained page, to be read, printed or sent."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.files.documents import read_text
from knotwork.joint_quantities import MOTION_QUANTITIES, rate_unit
from knotwork.units import Units
from knotwork.verification import Finding, Report
from knotwork.verification.brief import (
    finding_kind,
    group_alike,
    highlights_by_group,
    representatives,
    requirement_counts,
    value_text,
)
from knotwork.verification.finding import REMEDIES_TRIED
from knotwork.verification.report import CheckedMotion
from knotwork.view.joint_plots import plot_joints
from knotwork.view.page import Page, asset, iframe, render_template, scene_page
from knotwork.view.picture_files import inline_svg, night_colours
from knotwork.view.scene_data import scene_of
from knotwork.view.scene_verdict import failures
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.tool_plots import plot_tool

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_ROBOT = (
    "the scenario names no robot, so there is no arm to show: this report has only joint plots"
    "; name a robot in the scenario to see it move"
)
MAX_ROWS = 6
"""Maximum number of rows with failures, and with the tightest other findings."""
MAX_USE = 100.0
"""Utilisation of a limit above which it is not printed in percent."""
_VERDICTS = {"met": "ok", "failed": "FAIL", "information": "not required"}
"""Words for verdicts on the page; others are printed as they are."""


def report_page(motion: CheckedMotion) -> Page:
    """Put the report of a motion on a page.

    Without a robot the page has plots but no 3D view, and gives the reason.

    >>> report_page(kw.plan("paper_case")).save("report.html").name
    'report.html'

    Args:
        motion: The motion with its report.
    """
    report, scenario, robot = motion.report, motion.scenario, motion.joints.robot
    plots = [("Joints over time", plot_joints(motion))]
    scene: Page | None = None
    if robot is not None:
        if robot.tcp_frame_id is not None:
            plots.append(("The tool over time", plot_tool(motion)))
        scene = scene_page(scene_of(motion), embedded=True, autoplay=False)
    parts = {"style": asset("report.css"), "night": night_colours(), "script": asset("report.js")}
    parts["scene"] = iframe(scene.html, height="100%", name="3D view") if scene else ""
    warnings = scene.warnings if scene is not None else (NO_ROBOT,)
    text = render_template(
        "report.html",
        parts,
        scenario=scenario,
        report=report,
        robot=robot,
        trajectory=motion.trajectory,
        summary=report.summary,
        highlights=highlights_by_group(report.groups),
        failures=failures(report, scenario),
        most_use=MAX_USE,
        tightest=_tightest_rows(report),
        verdicts=_VERDICTS,
        units=report.units,
        number=partial(_number, report.units),
        groups=_groups(report),
        gauges=_gauges(motion, [figure for _, figure in plots]),
        plots=[(name, _picture(figure)) for name, figure in plots],
        warnings=warnings,
        source=read_text(scenario.source) if scenario.source is not None else None,
    )
    return Page(f"{scenario.name}: report", text, warnings)


def _tightest_rows(report: Report) -> list[Finding]:
    """The worst failures, then the tightest finding of each other kind."""
    measured = [finding for finding in report.failures if finding.value is not None]
    failing = [worst for worst, *_ in group_alike(measured)][:MAX_ROWS]
    unused = [finding for group in report.groups.values() for finding in representatives(group)]
    rows: dict[tuple[str, str, str], Finding] = {}
    for finding in (*failing, *report.notable[:MAX_ROWS], *unused):
        rows.setdefault(finding_kind(finding), finding)
    return list(rows.values())


def _groups(report: Report) -> list[dict[str, Any]]:
    """Findings by group as data for the template, without remedies, which are above."""
    groups = []
    for title, findings in report.groups.items():
        shown = [finding for finding in findings if finding.quantity != REMEDIES_TRIED]
        if not shown:
            continue
        numbers = [finding for finding in shown if finding.value is not None]
        rows = [finding for finding in numbers if finding.limit is not None or finding.is_decided]
        met, required = requirement_counts(shown)
        group = {
            "title": title,
            "rows": rows,
            "met": f"{met} of {required} met" if required else "",
            "ok": all(finding.ok for finding in shown),
            "vectors": any(finding.requested is not None for finding in rows),
            "free": [value_text(item, report.units) for item in numbers if item not in rows],
            "sentences": [str(finding) for finding in shown if finding.value is None],
        }
        groups.append(group)
    return groups


def _picture(figure: Figure) -> dict[str, str]:
    """Make a figure an element of the page, with data on its panels for the script.

    Returns:
        `drawing`, the element; and `axes`, JSON with the place of each panel in the drawing, from
        its upper left corner, and its ranges of times and values.
    """
    from markupsafe import Markup

    axes = []
    for i, axis in enumerate(figure.axes):
        axis.set_gid(f"panel:{i}")
        box, (start, end), (low, high) = axis.get_position(), axis.get_xlim(), axis.get_ylim()
        area = {"left": box.x0, "top": 1.0 - box.y1, "width": box.width, "height": box.height}
        span = {"start": float(start), "end": float(end), "low": float(low), "high": float(high)}
        axes.append({**area, **span})
    drawing = inline_svg(figure)
    return {"drawing": Markup(drawing), "axes": json.dumps(axes)}


def _gauges(motion: CheckedMotion, figures: Sequence[Figure]) -> dict[str, Any]:
    """Name the curves whose values are shown next to the scene, in the displayed units.

    Returns:
        `joints` has the `curve` and, if finite, the `bounds` of each joint by quantity and unit;
        `kinds` these quantities and units; `tool` the names, units and curves of the tool.
    """
    trajectory, names = motion.trajectory, motion.joints.joint_names
    prefix = f"curve:{ShownMotion.of_checked(motion).label}:"
    joints: dict[str, dict[tuple[str, str], dict[str, Any]]] = {name: {} for name in names}
    kinds: dict[tuple[str, str], None] = {}
    for order, quantity in enumerate(MOTION_QUANTITIES):
        for name, *limits in zip(names, *motion.joints.limits.bounds(quantity), strict=True):
            joint_unit = trajectory.joint_units[trajectory.joint_names.index(name)]
            factor, unit = motion.scenario.units.shown(1.0, rate_unit(joint_unit, order))
            bounds = (factor * np.array(limits)).tolist() if np.isfinite(limits).all() else None
            joints[name][quantity, unit] = {"curve": f"{prefix}{name}:{quantity}", "bounds": bounds}
            kinds[quantity, unit] = None
    tool = [
        (curve.removeprefix(prefix), axes.get_ylabel().partition("[")[2].removesuffix("]"), curve)
        for figure in figures[1:]
        for axes in figure.axes
        for line in axes.lines
        if (curve := str(line.get_gid())).startswith(prefix)
    ]
    return {"joints": joints, "kinds": list(kinds), "tool": tool}


def _number(units: Units, value: float | None, unit: str) -> str:
    return units.number(value, unit).replace("-", "\u2212")
