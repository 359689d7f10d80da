"""The tool over time: its speed, and its deviation from its path or from a straight line."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from knotwork.scenario import Scenario
from knotwork.verification.limits import LIMIT_SLACK
from knotwork.view.drawn_motions import Drawable, Motion, check_distinct, motions_of
from knotwork.view.headings import curve_legend, explain_marks, frame_times, picture_title, settle
from knotwork.view.panel_limits import NEAR
from knotwork.view.style import (
    LOOKS,
    checked_size,
    colour,
    dashes,
    dress,
    mark_waypoints,
    new_figure,
    rounded,
    settings,
    write_note,
)
from knotwork.view.time_window import WHOLE, Window, windowed
from knotwork.view.tool_curves import (
    Curve,
    Row,
    full_speeds,
    speed_errors,
    stretches,
    tool_rows,
)
from knotwork.waypoints import CartesianWaypoint, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Margins around the curves, and above them where a note is, in parts of their range.
MARGIN, NOTE_MARGIN = 0.07, 0.3
# With more rows the units are below their titles.
MANY = 5
# Longer titles are wrapped.
LONG = 17
# Less than this, in parts of the tolerance, is as good as nothing.
NOTHING = 1e-3


def plot_tool(
    motions: Drawable | Sequence[Drawable],
    *,
    degrees: bool | None = None,
    scenario: Scenario | None = None,
    labels: Sequence[str] | None = None,
    title: str | None = None,
    window: Window = WHOLE,
    size: str | None = None,
) -> Figure:
    """Draw the tool over time: its speed, and its deviation from its path.

    The velocities given at waypoints are marked. Along tool paths the deviation in place,
    orientation and speed is shown against its tolerance, and limited quantities of tool and links
    against their limits. Between two poses without a path, the deviation is that from the straight
    line with even turning. Everything is sampled.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them, of a robot with a tool.
        degrees: Show angles in degrees or in radians; by default as the scenario's file does.
        scenario: For trajectories: what was asked for, with its robot.
        labels: A name for each motion; by default its planner.
        title: Title of the picture; by default the scenario and the planner.
        window: From when to when to draw [s]; `None` for the start or the end of the motion.
        size: `"a4"` or `"slide"`; by default as large as the panels need.

    Returns:
        A figure, not known to `pyplot`.

    >>> figure = plot_tool(kw.plan("planar2_closed_form"))
    >>> [axis.get_ylabel() for axis in figure.axes]
    ['tool speed [m/s]', 'turning speed [rad/s]', ...]

    Raises:
        InputError: There is no robot with a tool, there are too many motions for one picture, they
            are not of the scenario's joints, or there is nothing in the window.
    """
    found = windowed(motions_of(motions, scenario=scenario, labels=labels), window)
    check_distinct(found)
    page = checked_size(size)
    measured: Callable[..., list[Curve]] = cache(lambda curve: [curve(one) for one in found])
    rows = [
        row
        for row in tool_rows(found, degrees)
        if any(len(time) for time, _ in measured(row.curve))
    ]
    with settings():
        figure = new_figure(len(rows), 1, page)
        axes: list[Axes] = list(figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0])
        for axis, row in zip(axes, rows, strict=True):
            _draw_row(axis, row, found, measured(row.curve))
            axis.set_ylabel(_axis_label(row, low=len(rows) > MANY))
        figure.align_ylabels()
        heading = title if title is not None else f"{picture_title(found, 'motion')} · tool"
        curve_legend(figure, [one.label for one in found] if len(found) > 1 else [], heading)
        explain_marks(figure)
        frame_times([axes[0]], axes[-1:], found)
        settle(figure, len(rows), grows=page is None)
    return figure


def _axis_label(row: Row, *, low: bool) -> str:
    """Quantity and unit of a row; long names are wrapped, and units are below them in low rows."""
    words = textwrap.fill(row.title, LONG) if len(row.title) > LONG else row.title
    gap = "\n" if low else " "
    return f"{words}{gap}[{row.unit}]" if row.unit else words


def _draw_row(axis: Axes, row: Row, motions: list[Motion], curves: list[Curve]) -> None:
    dress(axis)
    for index, (motion, (time, values)) in enumerate(zip(motions, curves, strict=True)):
        axis.plot(
            time,
            row.factor * values[:, row.component],
            color=colour(index),
            linestyle=dashes(index),
            linewidth=2.0,
            gid=f"tool:{motion.label}:{row.title}",
        )
    first = motions[0]
    times = [one.time for one in first.scenario.waypoints] if first.scenario is not None else []
    mark_waypoints(axis, np.array([time for time in times if first.shows(time)]))
    if row.asked:
        _mark_asked(axis, row, first)
    if row.limit is not None:
        _mark_limit(axis, row, row.factor * row.limit, motions, curves)
    _set_range(axis, row)


def _mark_asked(axis: Axes, row: Row, motion: Motion) -> None:
    """The velocities that waypoints and paths give."""
    waypoints = motion.scenario.waypoints if motion.scenario is not None else ()
    poses = [one for one in waypoints if isinstance(one, CartesianWaypoint)]
    poses = [one for one in poses if motion.shows(one.time)]
    if poses:
        asked = [row.factor * float(np.linalg.norm(getattr(one, row.asked))) for one in poses]
        times = [one.time for one in poses]
        axis.plot(times, asked, gid=f"asked:{row.asked}", zorder=4, **LOOKS["asked"])
    if row.asked == "linear" and motion.scenario is not None:
        part = motion.scenario.tolerances.path_speed
        for _, stretch, start, end in full_speeds(motion):
            low, high = (row.factor * stretch.speed * (1.0 + side * part) for side in (-1.0, 1.0))
            axis.fill_between([start, end], low, high, gid="band:speed", **LOOKS["band"])


def _mark_limit(
    axis: Axes, row: Row, limit: float, motions: list[Motion], curves: list[Curve]
) -> None:
    """A tolerance, or a limit that is near, the curves beyond, and a note on the worst value."""
    kind, beyond = ("tolerance", "beyond") if row.tolerance else ("limit", "broken")
    side = -1.0 if row.least else 1.0
    most = side * limit + (0.0 if row.tolerance else LIMIT_SLACK * max(1.0, limit))
    reached = []
    for motion, (time, values) in zip(motions, curves, strict=True):
        value = row.factor * values[:, row.component]
        used = np.abs(value) if row.tolerance else side * value
        if (used > most).any():
            over = np.where(used > most, value, np.nan)
            gid = f"{beyond}:{motion.label}:{row.title}"
            axis.plot(time, over, gid=gid, zorder=1.5, **LOOKS[beyond])
        if np.isfinite(used).any():
            i = int(np.nanargmax(used))
            reached.append((float(used[i]), float(time[i]), motion.label))
        reached += [
            (side * row.factor * one.value, one.time, motion.label)
            for one in motion.judged
            if (one.quantity, one.name) == row.judged and one.value is not None
            if one.time is not None and motion.shows(one.time)
        ]
    worst, at, who = max(reached, key=lambda one: one[0])
    signed = row.curve is speed_errors
    _note_worst(axis, row, limit, worst, at, who if len(motions) > 1 else "", worst > most)
    if row.tolerance:
        shown = (
            full_speeds(motions[0]) if signed else stretches(motions[0].scenario, motions[0].curve)
        )
        spans = [(start, end) for *_, start, end in shown]
    else:
        spans = [tuple(motions[0].curve.x[[0, -1]])]
    if row.tolerance or row.least or worst >= limit * (1.0 - NEAR):
        for one in (-limit, limit) if signed else (limit,):
            gid = f"{kind}:{row.title}"
            axis.plot(*_levels(spans, one), gid=gid, zorder=2, **LOOKS[kind])


def _note_worst(
    axis: Axes, row: Row, limit: float, worst: float, at: float, who: str, broken: bool
) -> None:
    """Note the worst value and its limit; a worst value at a lower limit is negated."""
    tiny = NOTHING * limit
    value = f"{rounded(-worst if row.least else worst)} {row.unit}".rstrip()
    when = f" at {rounded(at)} s"
    if not np.isfinite(worst):
        value = "infinite at the jump"
    elif row.tolerance and worst < tiny:
        value, when = f"under {rounded(tiny)} {row.unit}", ""
    name = f"{who}: " if who else ""
    kind = "tolerance" if row.tolerance else "limit"
    sign = "±" if row.curve is speed_errors else ""
    allowed = f"{kind} {sign}{rounded(limit)} {row.unit}".rstrip()
    write_note(axis, f"{name}{value}{when}, {allowed}", broken)


def _levels(spans: list[tuple[float, float]], value: float) -> tuple[FloatArray, FloatArray]:
    """Level lines over spans of time, parted by NaN."""
    times = np.array([(start, end, end) for start, end in spans]).ravel()
    return times, np.tile([value, value, np.nan], len(spans))


def _set_range(axis: Axes, row: Row) -> None:
    """A scale from zero, or about it."""
    drawn = [np.asarray(line.get_ydata(), float) for line in axis.lines]
    values = np.concatenate(drawn)
    values = values[np.isfinite(values)]
    high = max(float(values.max()), 0.0) if values.size else 0.0
    low = min(float(values.min()), 0.0) if values.size else 0.0
    if high - low <= 1e-8 * row.factor:  # rounding
        high = low + 1.0
    above = NOTE_MARGIN if row.limit is not None else MARGIN
    axis.set_ylim(low - MARGIN * (high - low), high + above * (high - low))
