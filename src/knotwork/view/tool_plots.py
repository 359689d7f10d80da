"""The tool over time: its speed, and its deviation from its path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from knotwork.task.scenario import Scenario
from knotwork.units import Units
from knotwork.verification.limits import limit_slack
from knotwork.verification.report import AnyMotion
from knotwork.view.panel import LimitLine, Panel
from knotwork.view.picture import draw_picture, picture_title
from knotwork.view.plotted_motions import motions_of
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.style import MARK_LOOKS, rounded_text
from knotwork.view.tool_curves import (
    Curve,
    ToolRow,
    full_speeds,
    speed_errors,
    stretches,
    tool_rows,
)
from knotwork.waypoints import CartesianWaypoint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ZERO_SHARE = 1e-3
"""Fraction of a tolerance below which a value is not written in digits."""


def plot_tool(
    motions: AnyMotion | Sequence[AnyMotion],
    *,
    degrees: bool | None = None,
    scenario: Scenario | None = None,
    size: str | None = None,
) -> Figure:
    """Draw the tool over time: its speed, and its deviation from its path.

    Given velocities at waypoints are marked. Along tool paths the deviation in position,
    orientation and speed is shown with its tolerance, and limited quantities of tool and links with
    their limits. All values are sampled.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them, of a robot with a tool.
        degrees: Show angles in degrees or in radians; by default the unit of the scenario.
        scenario: Scenario of trajectories, with its robot.
        size: `"a4"` or `"slide"`; by default as large as the panels need.

    Returns:
        A figure, not known to `pyplot`.

    >>> figure = plot_tool(kw.plan("planar2_closed_form"))
    >>> [axis.get_ylabel().split()[0] for axis in figure.axes]
    ['tool', 'turning', 'clearance']

    Raises:
        InputError: There is no robot with a tool, there are too many motions for one picture, or
            they have other joints than the scenario.
    """
    drawn = motions_of(motions, scenario)
    sample: Callable[..., list[Curve]] = cache(lambda curve: [curve(motion) for motion in drawn])
    draw = partial(_draw_panel, motions=drawn, units=drawn[0].units(degrees))
    panels = [
        [partial(draw, row=row, samples=sample(row.curve))]
        for row in tool_rows(drawn)
        if any(len(time) for time, _ in sample(row.curve))
    ]
    return draw_picture(drawn, panels, f"{picture_title(drawn, 'motion')} · tool", size=size)


def _draw_panel(
    axes: Axes, row: ToolRow, motions: list[ShownMotion], samples: list[Curve], units: Units
) -> Panel:
    """Draw the panel of a row, with all motions."""
    factor, unit = (100.0, "%") if row.unit == "%" else units.shown(1.0, row.unit)
    panel = Panel(axes, row.title, unit, factor)
    values = [(time, factor * value[:, row.component]) for time, value in samples]
    for i, (motion, curve) in enumerate(zip(motions, values, strict=True)):
        panel.draw_curve(f"{motion.label}:{row.title}", i, *curve)
    axes.update_datalim([(motions[0].curve.x[0], 0.0)])
    first, scenario = motions[0], motions[0].scenario
    panel.mark_waypoints(np.array([waypoint.time for waypoint in scenario.waypoints]))
    chosen = first.chosen_velocities
    poses = [
        waypoint
        for waypoint in scenario.waypoints
        if isinstance(waypoint, CartesianWaypoint) and waypoint.name not in chosen
    ]
    if row.given_part and poses:
        given = [factor * float(np.linalg.norm(getattr(pose, row.given_part))) for pose in poses]
        panel.mark("given", row.title, np.array([pose.time for pose in poses]), np.array(given))
    if row.given_part == "linear":
        part = scenario.tolerances.path_speed
        for path, stretch, start, end in full_speeds(first):
            if path.timed_path.has_own_clock:
                continue  # its speed is relative to a moving frame
            low, high = (factor * stretch.speed * (1.0 + side * part) for side in (-1.0, 1.0))
            axes.fill_between([start, end], low, high, gid="band", **MARK_LOOKS["band"])
    if row.limit is not None:
        _mark_limit(panel, row, factor * row.limit, motions, values)
    return panel


def _mark_limit(
    panel: Panel, row: ToolRow, limit: float, motions: list[ShownMotion], values: list[Curve]
) -> None:
    """Mark a tolerance or a limit and the parts of curves beyond, and note the worst value."""
    side = -1.0 if row.least else 1.0
    most = side * limit + (0.0 if row.tolerance else limit_slack(limit))
    reached = []
    for motion, (time, value) in zip(motions, values, strict=True):
        sizes = np.abs(value) if row.tolerance else side * value
        if (sizes > most).any():
            kind, name = "beyond" if row.tolerance else "exceeded", f"{motion.label}:{row.title}"
            panel.mark(kind, name, time, np.where(sizes > most, value, np.nan))
        if np.isfinite(sizes).any():
            i = int(np.nanargmax(sizes))
            reached.append((float(sizes[i]), float(time[i]), motion.label))
        reached += [
            (side * panel.factor * finding.value, finding.time, motion.label)
            for finding in motion.tool_findings
            if (finding.quantity, finding.name) == row.judged and finding.value is not None
            if finding.time is not None
        ]
    worst, when, label = max(reached, key=lambda extreme: extreme[0])
    signed, first = row.curve is speed_errors, motions[0]
    spans = [(float(first.curve.x[0]), float(first.curve.x[-1]))]
    if row.tolerance:
        shown = full_speeds(first) if signed else stretches(first)
        spans = [(start, end) for *_, start, end in shown]
    kind = "tolerance" if row.tolerance else "limit"
    always, levels = row.tolerance or row.least, (-limit, limit) if signed else (limit,)
    panel.levels = [LimitLine(kind, level, spans, always=always) for level in levels]
    value_text = f"{rounded_text(side * worst)} {panel.unit}".rstrip()
    reached_text = f"{value_text} at {rounded_text(when)} s"
    if not np.isfinite(worst):
        reached_text = f"infinite at the jump at {rounded_text(when)} s"
    elif row.tolerance and worst < ZERO_SHARE * limit:
        reached_text = f"under {rounded_text(ZERO_SHARE * limit)} {panel.unit}"
    name = f"{label}: " if len(motions) > 1 else ""
    allowed = f"{kind} {'±' if signed else ''}{rounded_text(limit)} {panel.unit}".rstrip()
    panel.note, panel.failed = f"{name}{reached_text}, {allowed}", worst > most
