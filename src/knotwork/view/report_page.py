"""A report as one self-contained page, to be read, printed or sent."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from knotwork.documents import read_text
from knotwork.verification import LimitUse, Report, Requirement
from knotwork.view.motions import PlanLike
from knotwork.view.page import Page, asset, environment, frame, version
from knotwork.view.plots import plot_joints
from knotwork.view.show import view_plan
from knotwork.view.style import settings
from knotwork.view.tool_plots import plot_tool

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUANTITY_WORDS = {
    "position": "tool position",
    "orientation": "tool orientation",
    "linear_velocity": "tool velocity",
    "angular_velocity": "tool turning velocity",
}
NO_ROBOT = (
    "the scenario names no robot, so there is no arm to show: this report has plots of the joints "
    "only; name a robot in the scenario to see it move"
)
# An orientation is a quaternion, which has no unit.
_UNITLESS = ("orientation",)


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
            met=sum(item.ok for item in report.requirements),
            requirements=_requirements(report),
            limits=list(_limits(report)),
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


def _requirements(report: Report) -> list[dict[str, Any]]:
    """Rows of the table, those of one waypoint together."""
    order = list(dict.fromkeys(item.waypoint for item in report.requirements))
    items = sorted(report.requirements, key=lambda item: order.index(item.waypoint))
    return [_requirement(item) for item in items]


def _requirement(item: Requirement) -> dict[str, Any]:
    unit = "x, y, z, w" if item.quantity in _UNITLESS else item.unit
    return {
        "waypoint": item.waypoint,
        "time": f"{item.time:g}",
        "quantity": QUANTITY_WORDS.get(item.quantity, item.quantity.replace("_", " ")),
        "requested": _vector(item.requested),
        "achieved": _vector(item.achieved),
        "values_unit": unit,
        "error": f"{item.error:.2g} {item.unit}",
        "tolerance": f"{item.tolerance:.2g} {item.unit}",
        "ok": item.ok,
    }


def _vector(values: tuple[float, ...]) -> str:
    return ", ".join(_number(value) for value in values)


def _number(value: float) -> str:
    return "0" if abs(value) < 5e-10 else f"{value:.5g}".replace("-", "\u2212")


def _limits(report: Report) -> Iterator[dict[str, Any]]:
    """Groups of limits by quantity; joints that none is given for are named in one line."""
    for quantity in dict.fromkeys(item.quantity for item in report.limits):
        items = [item for item in report.limits if item.quantity == quantity]
        yield {
            "quantity": quantity,
            "sampled": items[0].sampled,
            "rows": [_limit(item) for item in items if item.limit is not None],
            "free": [_free(item) for item in items if item.limit is None],
        }


def _limit(item: LimitUse) -> dict[str, Any]:
    limit, margin = item.limit or 0.0, item.margin or 0.0
    return {
        "joint": item.joint,
        "value": _number(item.value),
        "limit": _number(limit),
        "margin": _number(margin),
        "use": min(max(abs(item.value / limit), 0.0), 1.0) if limit else 0.0,
        "time": f"{item.time:.3f}",
        "unit": item.unit,
        "ok": item.ok,
    }


def _free(item: LimitUse) -> str:
    return f"{item.joint} {_number(item.value)} {item.unit}"
