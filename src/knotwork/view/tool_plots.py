"""The tool over time: its speed, and its deviation from its path or from a straight line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from knotwork.scenario import Scenario
from knotwork.units import Units
from knotwork.verification.limits import LIMIT_SLACK
from knotwork.view.drawn_motions import (
    Drawable,
    Motion,
    check_distinct,
    chosen_velocities,
    motions_of,
)
from knotwork.view.headings import head_and_foot, picture_title
from knotwork.view.panel import Curve, Level, Panel, draw_grid
from knotwork.view.style import checked_size, rounded, settings
from knotwork.view.tool_curves import Curve as Samples
from knotwork.view.tool_curves import Row, full_speeds, speed_errors, stretches, tool_rows
from knotwork.waypoints import CartesianWaypoint

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Fraction of the tolerance that counts as zero.
NOTHING = 1e-3


def plot_tool(
    motions: Drawable | Sequence[Drawable],
    *,
    degrees: bool | None = None,
    scenario: Scenario | None = None,
    labels: Sequence[str] | None = None,
    title: str | None = None,
    size: str | None = None,
) -> Figure:
    """Draw the tool over time: its speed, and its deviation from its path.

    Given velocities at waypoints are marked. Along tool paths the deviation in position,
    orientation and speed is shown with its tolerance, and limited quantities of tool and links
    with their limits. Between two poses without a path, the deviation is that from the straight
    line with constant angular velocity. Everything is sampled.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them, of a robot with a tool.
        degrees: Show angles in degrees or in radians; by default the unit of the scenario.
        scenario: Scenario of trajectories, with its robot.
        labels: A name for each motion; by default its planner.
        title: Title of the picture; by default the scenario and the planner.
        size: `"a4"` or `"slide"`; by default as large as the panels need.

    Returns:
        A figure, not known to `pyplot`.

    >>> figure = plot_tool(kw.plan("planar2_closed_form"))
    >>> [axis.get_ylabel() for axis in figure.axes]
    ['tool speed [m/s]', 'turning speed [rad/s]', ...]

    Raises:
        InputError: There is no robot with a tool, there are too many motions for one picture, or
            they have other joints than the scenario.
    """
    found = motions_of(motions, scenario=scenario, labels=labels)
    check_distinct(found)
    page = checked_size(size)
    measured: Callable[..., list[Samples]] = cache(lambda curve: [curve(one) for one in found])
    units = found[0].units(degrees)
    panels = [
        _panel(row, found, measured(row.curve), units)
        for row in tool_rows(found)
        if any(len(time) for time, _ in measured(row.curve))
    ]
    with settings():
        figure = draw_grid([[panel] for panel in panels], page)
        heading = title if title is not None else f"{picture_title(found, 'motion')} · tool"
        several = len(found) > 1
        curves = [one.label for one in found] if several else ()
        head_and_foot(figure, found, heading, curves, overlaid=several, grows=page is None)
    return figure


def _panel(row: Row, motions: list[Motion], samples: list[Samples], units: Units) -> Panel:
    """Make the panel of a row, with all motions."""
    factor, unit = (100.0, "%") if row.unit == "%" else units.shown(1.0, row.unit)
    curves = [
        Curve(f"{motion.label}:{row.title}", i, time, factor * values[:, row.component])
        for i, (motion, (time, values)) in enumerate(zip(motions, samples, strict=True))
    ]
    first = motions[0]
    scenario = first.scenario
    times = np.array([one.time for one in scenario.waypoints])
    panel = Panel(row.title, unit, factor, curves, times, zero=True)
    chosen = chosen_velocities(scenario)
    poses = [
        one
        for one in scenario.waypoints
        if isinstance(one, CartesianWaypoint) and one.name not in chosen
    ]
    if row.asked and poses:
        asked = [factor * float(np.linalg.norm(getattr(one, row.asked))) for one in poses]
        curves[0].mark("asked", np.array([one.time for one in poses]), np.array(asked))
    if row.asked == "linear":
        part = scenario.tolerances.path_speed
        for path, stretch, start, end in full_speeds(first):
            if path.motion.carrier is not None:
                continue  # its speed is relative to a moving frame
            low, high = (factor * stretch.speed * (1.0 + side * part) for side in (-1.0, 1.0))
            panel.bands.append((start, end, low, high))
    if row.limit is not None:
        _mark_limit(panel, row, factor * row.limit, motions)
    return panel


def _mark_limit(panel: Panel, row: Row, limit: float, motions: list[Motion]) -> None:
    """A tolerance or a limit, the parts beyond, and a note on the worst value."""
    side = -1.0 if row.least else 1.0
    most = side * limit + (0.0 if row.tolerance else LIMIT_SLACK * max(1.0, limit))
    reached = []
    for motion, curve in zip(motions, panel.curves, strict=True):
        used = np.abs(curve.value) if row.tolerance else side * curve.value
        if (used > most).any():
            over = np.where(used > most, curve.value, np.nan)
            curve.mark("beyond" if row.tolerance else "broken", curve.time, over)
        if np.isfinite(used).any():
            i = int(np.nanargmax(used))
            reached.append((float(used[i]), float(curve.time[i]), motion.label))
        reached += [
            (side * panel.factor * one.value, one.time, motion.label)
            for one in motion.judged
            if (one.quantity, one.name) == row.judged and one.value is not None
            if one.time is not None
        ]
    worst, at, who = max(reached, key=lambda one: one[0])
    signed, first = row.curve is speed_errors, motions[0]
    spans = [(float(first.curve.x[0]), float(first.curve.x[-1]))]
    if row.tolerance:
        shown = full_speeds(first) if signed else stretches(first.scenario, first.curve)
        spans = [(start, end) for *_, start, end in shown]
    kind = "tolerance" if row.tolerance else "limit"
    for value in (-limit, limit) if signed else (limit,):
        panel.levels.append(Level(kind, value, spans, row.tolerance or row.least))
    reached_text = f"{rounded(side * worst)} {panel.unit}".rstrip() + f" at {rounded(at)} s"
    if not np.isfinite(worst):
        reached_text = f"infinite at the jump at {rounded(at)} s"
    elif row.tolerance and worst < NOTHING * limit:
        reached_text = f"under {rounded(NOTHING * limit)} {panel.unit}"
    name = f"{who}: " if len(motions) > 1 else ""
    allowed = f"{kind} {'±' if signed else ''}{rounded(limit)} {panel.unit}".rstrip()
    panel.note, panel.broken = f"{name}{reached_text}, {allowed}", worst > most
