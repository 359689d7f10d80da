"""A report as one self-contained page, to be read, printed or sent."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.files.documents import read_text
from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.units import Units, readable
from knotwork.verification import Finding, Report
from knotwork.verification.brief import NOTABLE_USE, brief_texts_by_group
from knotwork.verification.worst import without_use, worst_failures
from knotwork.view.joint_plots import plot_joints
from knotwork.view.page import Page, asset, frame, json_in_html, rendered
from knotwork.view.picture_files import inline_svg, night_colours
from knotwork.view.plan_pages import view_plan
from knotwork.view.scene_verdict import failures
from knotwork.view.shown_motion import PlanLike
from knotwork.view.tool_plots import plot_tool

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_ROBOT = (
    "the scenario names no robot, so there is no arm to show: this report has only joint plots"
    "; name a robot in the scenario to see it move"
)
# Number of rows of failures, and of the tightest findings.
MOST = 6
MOST_USE = 100.0
"""Uses of a limit above this are not printed in percent."""
_VERDICTS = {"met": "ok", "failed": "FAIL", "information": "not required"}
"""Verdicts with other words."""


def report_page(plan: PlanLike) -> Page:
    """Put the report of a plan on a page.

    Without a robot there is no 3D view: only plots, and the page gives the reason.

    >>> report_page(kw.plan("paper_case")).save("report.html").name
    'report.html'

    Args:
        plan: The plan with its report.
    """
    report, scenario, robot = plan.report, plan.scenario, plan.space.robot
    plots = [("Joints over time", plot_joints(plan))]
    scene: Page | None = None
    if robot is not None:
        if robot.tcp_frame_id is not None:
            plots.append(("The tool over time", plot_tool(plan)))
        scene = view_plan(plan, embedded=True, autoplay=False)
    parts = {"style": asset("report.css"), "night": night_colours(), "script": asset("report.js")}
    parts["limits"] = json_in_html(_limits(plan))
    parts["scene"] = frame(scene.html, height="100%", name="3D view") if scene else ""
    warnings = scene.warnings if scene is not None else (NO_ROBOT,)
    text = rendered(
        "report.html",
        parts,
        scenario=scenario,
        report=report,
        robot=robot,
        trajectory=plan.trajectory,
        summary=report.summary,
        facts=brief_texts_by_group(report.groups),
        failures=failures(report, scenario),
        most_use=MOST_USE,
        tightest=[_shown(one, report.units) for one in _tightest(report)],
        verdicts=_VERDICTS,
        number=_number,
        vector=_vector,
        groups=[
            _group(title, [_shown(one, report.units) for one in found])
            for title, found in _details(report).items()
        ],
        plots=[(name, _picture(figure)) for name, figure in plots],
        warnings=warnings,
        source=read_text(scenario.source) if scenario.source is not None else None,
    )
    return Page(f"{scenario.name}: report", text, warnings)


def _tightest(report: Report) -> list[Finding]:
    """Failures first, then the finding nearest its limit for each other quantity."""
    failing = worst_failures(report.failures)[:MOST]
    rows = [found for found in report.tightest if (found.use or 0.0) >= NOTABLE_USE][:MOST]
    rows += [one for found in report.groups.values() for one in without_use(found)]
    failed = {(one.subject, one.quantity) for one in failing}
    first: dict[tuple[str, str], Finding] = {}
    for found in rows:
        first.setdefault((found.subject, found.quantity), found)
    return [*failing, *(found for key, found in first.items() if key not in failed)]


def _details(report: Report) -> dict[str, list[Finding]]:
    """Findings by group, without those at the top of the page."""
    shown = report.tried if report.failures else ()
    left = {
        title: [one for one in found if one not in shown] for title, found in report.groups.items()
    }
    return {title: found for title, found in left.items() if found}


def _shown(found: Finding, units: Units) -> Finding:
    """A finding with its numbers in the displayed units, with the names of these units."""
    factor, unit = units.shown(1.0, found.unit)
    changed: dict[str, Any] = {"unit": unit}
    for name in ("value", "limit", "margin", "excess"):
        value = getattr(found, name)
        changed[name] = None if value is None else factor * value
    for name in () if found.form else ("requested", "achieved"):
        values = getattr(found, name)
        changed[name] = None if values is None else tuple(factor * value for value in values)
    return replace(found, **changed)


def _picture(figure: Figure) -> dict[str, str]:
    """A figure as part of the page, and its panels with their times.

    Returns:
        `drawing`, and `axes`, JSON: panels relative to the drawing, from its upper left
        corner, with their ranges of times and values, and the unit.
    """
    from markupsafe import Markup

    axes = []
    for i, axis in enumerate(figure.axes):
        axis.set_gid(f"panel:{i}")
        box, (start, end), (low, high) = axis.get_position(), axis.get_xlim(), axis.get_ylim()
        place = {"left": box.x0, "top": 1.0 - box.y1, "width": box.width, "height": box.height}
        span = {"start": float(start), "end": float(end), "low": float(low), "high": float(high)}
        unit = axis.get_ylabel().partition("[")[2].removesuffix("]")
        axes.append({**place, **span, "unit": unit})
    drawing = inline_svg(figure)
    return {"drawing": Markup(drawing), "axes": json.dumps(axes)}


def _limits(plan: PlanLike) -> dict[str, dict[str, dict[str, float]]]:
    """Finite lower and upper limits by joint and quantity, in the displayed units."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    units = plan.trajectory.joint_units
    for order, quantity in enumerate(DERIVATIVES):
        lower, upper = plan.space.bounds(quantity)
        for i, name in enumerate(plan.space.joint_names):
            own = units[plan.trajectory.joint_names.index(name)]
            factor = plan.scenario.units.shown(1.0, rate_unit(own, order))[0]
            if np.isfinite([lower[i], upper[i]]).all():
                bounds = {"low": factor * float(lower[i]), "high": factor * float(upper[i])}
                found.setdefault(name, {})[quantity] = bounds
    return found


def _group(title: str, findings: Sequence[Finding]) -> dict[str, Any]:
    """A table of findings: its columns, and its rows by name or by quantity."""
    numbers = [found for found in findings if found.value is not None]
    order = list(dict.fromkeys(found.name for found in numbers))
    parts: dict[str, dict[str, Any]] = {}
    for found in numbers:
        part = parts.setdefault(found.title, {"title": found.title, "rows": [], "free": []})
        if found.limit is None and not found.required:
            named = f"{found.name} {_number(found.value)} {found.unit}".strip()
            at = f" at {found.when} s" if len(order) == 1 and found.when else ""
            part["free"].append(named + at)
        else:
            part["rows"].append(found)
    return {
        "title": title,
        "subject": numbers[0].subject if numbers else "",
        "by_name": any(found.requested is not None for found in numbers),
        "names": [_named(name, [one for one in numbers if one.name == name]) for name in order],
        "ok": all(found.ok for found in findings),
        "met": _met(findings),
        "parts": list(parts.values()),
        "sentences": [str(found) for found in findings if found.value is None],
    }


def _named(name: str, rows: Sequence[Finding]) -> dict[str, Any]:
    """The findings of a waypoint, under an expandable row."""
    ok = all(found.ok for found in rows)
    return {"name": name, "when": rows[0].when, "ok": ok, "met": _met(rows), "rows": rows}


def _met(findings: Sequence[Finding]) -> str:
    """Number of requirements met."""
    required = [found for found in findings if found.required]
    return f"{sum(found.ok for found in required)} of {len(required)} met" if required else ""


def _vector(values: tuple[float, ...] | None) -> str:
    return ", ".join("0" if abs(value) < 5e-10 else _number(value) for value in values or ())


def _number(value: float | None) -> str:
    return "" if value is None else readable(value).replace("-", "\u2212")
