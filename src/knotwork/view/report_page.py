"""A report as one self-contained page, to be read, printed or sent."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from knotwork.documents import read_text
from knotwork.verification import Finding
from knotwork.view.motions import PlanLike
from knotwork.view.page import Page, asset, environment, frame, version
from knotwork.view.plots import plot_joints
from knotwork.view.show import view_plan
from knotwork.view.style import settings
from knotwork.view.tool_plots import plot_tool

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_ROBOT = (
    "the scenario names no robot, so there is no arm to show: this report has plots of the joints "
    "only; name a robot in the scenario to see it move"
)
_VERDICTS = {"met": "ok", "failed": "FAIL", "warning": "warning", "information": "not required"}


def report_page(plan: PlanLike) -> Page:
    """Put the report of a plan on a page.

    Without a robot there is no 3D view: plots only, and the page says so and why.

    Args:
        plan: What was planned and checked.
    """
    from markupsafe import Markup

    report, scenario, robot = plan.report, plan.scenario, plan.space.robot
    plots = [("Joints over time", plot_joints(plan, degrees=False))]
    scene: Page | None = None
    if robot is not None:
        if robot.tcp_frame_id is not None:
            plots.append(("The tool over time", plot_tool(plan)))
        scene = view_plan(plan, embedded=True, autoplay=False)
    warnings = scene.warnings if scene is not None else (NO_ROBOT,)
    text = (
        environment()
        .get_template("report.html")
        .render(
            scenario=scenario,
            report=report,
            robot=robot,
            trajectory=plan.trajectory,
            counts=report.counts,
            verdicts=_VERDICTS,
            number=_number,
            vector=_vector,
            groups=[_group(title, found) for title, found in report.groups.items()],
            plots=[(name, _picture(figure)) for name, figure in plots],
            scene=Markup(frame(scene.html, height="100%", name="3D view")) if scene else None,
            warnings=warnings,
            source=read_text(scenario.source) if scenario.source is not None else None,
            style=Markup(asset("report.css")),
            version=version(),
        )
    )
    return Page(f"{scenario.name}: report", text, warnings)


def _picture(figure: Figure) -> str:
    """A figure as the address of an image that is part of the page."""
    file = io.BytesIO()
    with settings():
        figure.savefig(file, format="png", dpi=130)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode("ascii")


def _group(title: str, findings: Sequence[Finding]) -> dict[str, Any]:
    """A table of findings: which columns it has, and its rows by name or by quantity."""
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
        "rows": sorted(numbers, key=lambda found: order.index(found.name)),
        "parts": list(parts.values()),
        "said": [str(found) for found in findings if found.value is None],
    }


def _vector(values: tuple[float, ...] | None) -> str:
    return ", ".join("0" if abs(value) < 5e-10 else _number(value) for value in values or ())


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}".replace("-", "\u2212")
