"""Links from docstrings and signatures to the pages on which public names are described."""

from __future__ import annotations

import importlib
import re
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util.nodes import make_refnode

PACKAGES = (
    "knotwork",
    "knotwork.curves.polynomial",
    "knotwork.curves.interpolation",
    "knotwork.task.scenario",
    "knotwork.robot",
    "knotwork.robot.kinematics",
    "knotwork.curves.tool_paths",
    "knotwork.planning.task_to_joint",
    "knotwork.verification",
    "knotwork.files.storage",
    "knotwork.files.export",
    "knotwork.files.foreign",
    "knotwork.view",
)
"""Public packages, in the order of the pages: a name is described in the first that has it."""

MODULES = {
    "knotwork.errors": (
        "ArrayError",
        "BranchError",
        "CornerError",
        "DocumentError",
        "ExportError",
        "KnotError",
        "OptionError",
        "OutsideLimitsError",
        "PathError",
        "Problem",
        "RampError",
        "RobotError",
        "SingularityError",
        "TaskError",
        "TimeRangeError",
        "UnknownNameError",
        "UnreachablePoseError",
        "WaypointDataError",
    ),
    "knotwork.joint_quantities": ("JointLimits",),
    "knotwork.curves.trajectory": ("Continuity", "Jump", "Knots", "Samples"),
    "knotwork.curves.trajectory.exportable": (
        "DriveOptions",
        "MessageOptions",
        "ProgramOptions",
        "TableOptions",
    ),
    "knotwork.task.scenario.scenario_joints": ("ScenarioJoints", "read_scenario_joints"),
    "knotwork.planning.task_to_joint": (
        "Choice",
        "TaskSolution",
        "solve_task",
    ),
    "knotwork.planning.comparison": ("Comparison", "Refusal", "Score"),
    "knotwork.robot.kinematics.chain.batch": ("BatchSolution",),
    "knotwork.verification.metrics": (
        "Peak",
        "acceleration_jump",
        "end_acceleration",
        "integral_of_square",
        "peak",
        "position_miss",
        "velocity_fluctuation",
        "velocity_miss",
    ),
    "knotwork.planning.sweeps": ("SweepProgress",),
    "knotwork.view.page": ("Page",),
    "knotwork.waypoints": ("CartesianWaypoint",),
    "knotwork.verification.metrics.deviation": (
        "PathDeviation",
        "deviation_from_line",
        "straight_path_deviation",
    ),
}
"""What is public of modules that have no `__all__`: what those packages give and raise."""


def public_names() -> dict[str, list[str]]:
    """Full names under which public names are described, by the name alone."""
    offers = {module: importlib.import_module(module).__all__ for module in PACKAGES}
    found: dict[str, list[str]] = {}
    seen: list[Any] = []
    for module, names in {**offers, **MODULES}.items():
        for name in names:
            value = getattr(importlib.import_module(module), name)
            if not any(value is other for other in seen):
                seen.append(value)
                found.setdefault(name, []).append(f"{module}.{name}")
    return found


def _shared(one: list[str], other: list[str]) -> int:
    """How many parts two dotted names have in common from the left."""
    return next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), len(one))


def _full_name(text: str, module: str | None, names: dict[str, list[str]]) -> str | None:
    """The full name that a word of a docstring or signature means, if it means a public one."""
    path = text.removesuffix("()").split(".")
    for start, part in enumerate(path):
        if part not in names:
            continue
        inside = ".".join(path[:start]) or module or ""
        best = max(names[part], key=lambda full: _shared(full.split("."), inside.split(".")))
        return ".".join((best, *path[start + 1 :]))
    return None


def named(
    _role: str, rawtext: str, text: str, _line: int, _inliner: Any, *_: Any
) -> tuple[list[nodes.Node], list[nodes.system_message]]:
    """Link a public name; show anything else as code."""
    text = text.replace("\x00", "")
    literal = nodes.literal(rawtext, text, classes=["code"])
    if not re.fullmatch(r"[A-Za-z_][\w.]*(\(\))?", text):
        return [literal], []
    reference = addnodes.pending_xref(
        rawtext, refdomain="py", reftype="obj", reftarget=text, refexplicit=False, soft=True
    )
    reference += literal
    return [reference], []


def resolve(app: Sphinx, env: Any, node: addnodes.pending_xref, content: Any) -> Any:
    """Link a name that was written short, or by the module that it comes from."""
    if node.get("refdomain") != "py":
        return None
    full = _full_name(str(node["reftarget"]), node.get("py:module"), env.app.public_names)
    domain = env.get_domain("py")
    if full is not None and full in domain.objects:
        found = domain.objects[full]
        page = str(node.get("refdoc"))
        return make_refnode(app.builder, page, found.docname, found.node_id, content, full)
    if node.get("soft"):
        return content
    return None


def _start(app: Sphinx) -> None:
    app.public_names = public_names()  # type: ignore[attr-defined]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the role and the resolver."""
    app.connect("builder-inited", _start)
    app.add_role("named", named)
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
