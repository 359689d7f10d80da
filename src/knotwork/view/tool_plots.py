"""The tool over time: its speed, and how far it is off its path, or off the straight way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import InputError
from knotwork.scenario import Scenario, ToleranceSet
from knotwork.view.heads import curve_legend, explain_marks, frame_times, picture_title, settle
from knotwork.view.motions import Drawable, Motion, motions_of
from knotwork.view.style import (
    DASHES,
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
from knotwork.view.tool_curves import (
    Curve,
    full_speeds,
    path_deviations,
    robot_of,
    speed_errors,
    speeds,
    straight_deviations,
    stretches,
)
from knotwork.view.window import WHOLE, Window, windowed
from knotwork.waypoints import CartesianWaypoint, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PERCENT = 1e2
# Room above and below the curves, and above them where words are, in parts of their range.
ROOM, NOTE_ROOM = 0.07, 0.3
# With more rows the units are below their titles.
MANY = 5
# Less than this, in parts of the tolerance, is as good as nothing.
NOTHING = 1e-3


@dataclass(frozen=True)
class _Row:
    """A row of panels: what it shows.

    Attributes:
        title: What is measured.
        unit: Unit that it is shown in.
        factor: From SI to that unit.
        curve: Function that measures a motion.
        component: Which of its values is shown.
        asked: What of a waypoint's velocity is marked, `"linear"` or `"angular"`, or nothing.
        tolerance: What deviations are allowed, in SI, or `None`.
    """

    title: str
    unit: str
    factor: float
    curve: Callable[[Motion], Curve]
    component: int
    asked: str = ""
    tolerance: float | None = None


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
    """Draw the tool over time: its speed, and its deviation from what it should follow.

    What waypoints ask for is marked. Along tool paths the deviation in place, orientation and speed
    is shown against its tolerance. Elsewhere, where two poses follow each other, deviation is that
    from the straight way from one to the next, turning evenly. Everything is sampled.

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
    if len(found) > len(DASHES):
        raise InputError(
            f"{len(found)} motions are too many to tell apart in one picture; choose at most "
            f"{len(DASHES)}"
        )
    page = checked_size(size)
    measured: dict[Callable[[Motion], Curve], list[Curve]] = {}
    rows = [
        row
        for row in _rows(found, degrees)
        if any(
            len(time)
            for time, _ in measured.setdefault(row.curve, [row.curve(one) for one in found])
        )
    ]
    with settings():
        figure = new_figure(len(rows), 1, page)
        axes: list[Axes] = list(figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0])
        for axis, row in zip(axes, rows, strict=True):
            _draw_row(axis, row, found, measured[row.curve])
            axis.set_ylabel(row.title + ("\n" if len(rows) > MANY else " ") + f"[{row.unit}]")
        figure.align_ylabels()
        heading = title if title is not None else f"{picture_title(found, 'motion')} · tool"
        several = enumerate(found) if len(found) > 1 else ()
        curve_legend(figure, {motion.label: (i, i) for i, motion in several}, heading)
        explain_marks(figure)
        frame_times([axes[0]], axes[-1:], found)
        settle(figure, len(rows), grows=page is None)
    return figure


def _rows(motions: list[Motion], degrees: bool | None) -> list[_Row]:
    """What may be shown; a row without any value is left out."""
    for motion in motions:
        robot_of(motion)  # that there is one is said before anything is drawn
    scenario = motions[0].scenario
    allowed = scenario.tolerances if scenario is not None else ToleranceSet()
    units = motions[0].units(degrees)
    factor, angle = units.shown(1.0, "rad")
    metres, length = units.shown(1.0, "m")
    return [
        _Row("tool speed", f"{length}/s", metres, speeds, 0, "linear"),
        _Row("turning speed", f"{angle}/s", factor, speeds, 1, "angular"),
        _Row("speed error", "%", PERCENT, speed_errors, 0, tolerance=allowed.path_speed),
        _Row("off tool path", length, metres, path_deviations, 0, tolerance=allowed.path),
        _Row(
            "turned from it",
            angle,
            factor,
            path_deviations,
            1,
            tolerance=allowed.path_orientation,
        ),
        _Row("off straight path", length, metres, straight_deviations, 0),
        _Row("turned from it", angle, factor, straight_deviations, 1),
    ]


def _draw_row(axis: Axes, row: _Row, motions: list[Motion], curves: list[Curve]) -> None:
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
    if row.tolerance is not None:
        _mark_tolerance(axis, row, motions, curves)
    _set_range(axis, row)


def _mark_asked(axis: Axes, row: _Row, motion: Motion) -> None:
    """What waypoints ask for, and paths."""
    waypoints = motion.scenario.waypoints if motion.scenario is not None else ()
    poses = [one for one in waypoints if isinstance(one, CartesianWaypoint)]
    poses = [one for one in poses if motion.shows(one.time)]
    if poses:
        asked = [row.factor * float(np.linalg.norm(getattr(one, row.asked))) for one in poses]
        times = [one.time for one in poses]
        axis.plot(times, asked, gid=f"asked:{row.asked}", zorder=4, **LOOKS["asked"])
    if row.asked == "linear" and motion.scenario is not None:
        part = motion.scenario.tolerances.path_speed
        for stretch, start, end in full_speeds(motion):
            low, high = (row.factor * stretch.speed * (1.0 + side * part) for side in (-1.0, 1.0))
            axis.fill_between([start, end], low, high, gid="band:speed", **LOOKS["band"])


def _mark_tolerance(axis: Axes, row: _Row, motions: list[Motion], curves: list[Curve]) -> None:
    """The tolerance, the curves beyond it, and in words how much of it the worst one takes."""
    signed = row.curve is speed_errors
    shown = full_speeds(motions[0]) if signed else stretches(motions[0].scenario, motions[0].curve)
    spans = [(start, end) for *_, start, end in shown]
    limit = row.factor * (row.tolerance or 0.0)
    worst, at, who = -1.0, 0.0, ""
    for side in (-1.0, 1.0) if signed else (1.0,):
        axis.plot(
            *_levels(spans, side * limit),
            gid=f"tolerance:{row.title}",
            zorder=2,
            **LOOKS["tolerance"],
        )
    for motion, (time, values) in zip(motions, curves, strict=True):
        value = row.factor * values[:, row.component]
        size = np.abs(value)
        if (size > limit).any():
            beyond = np.where(size > limit, value, np.nan)
            gid = f"beyond:{motion.label}:{row.title}"
            axis.plot(time, beyond, gid=gid, zorder=1.5, **LOOKS["beyond"])
        if len(size) and np.nanmax(size) > worst:
            i = int(np.nanargmax(size))
            worst, at, who = float(size[i]), float(time[i]), motion.label
    name = f"{who}: " if len(motions) > 1 else ""
    sign = "±" if signed else ""
    tiny = NOTHING * limit
    said = (
        f"{rounded(worst)} {row.unit} at {rounded(at)} s"
        if worst >= tiny
        else f"under {rounded(tiny)} {row.unit}"
    )
    text = f"{name}{said}, tolerance {sign}{rounded(limit)} {row.unit}"
    write_note(axis, text, worst > limit)


def _levels(spans: list[tuple[float, float]], value: float) -> tuple[FloatArray, FloatArray]:
    """Level lines over spans of time, parted by NaN."""
    times = np.array([(start, end, end) for start, end in spans]).ravel()
    return times, np.tile([value, value, np.nan], len(spans))


def _set_range(axis: Axes, row: _Row) -> None:
    """A scale from zero, or about it."""
    drawn = [np.asarray(line.get_ydata(), float) for line in axis.lines]
    values = np.concatenate(drawn)
    values = values[np.isfinite(values)]
    high = max(float(values.max()), 0.0) if values.size else 0.0
    low = min(float(values.min()), 0.0) if values.size else 0.0
    if high - low <= 1e-8 * row.factor:  # rounding
        high = low + 1.0
    above = NOTE_ROOM if row.tolerance is not None else ROOM
    axis.set_ylim(low - ROOM * (high - low), high + above * (high - low))
