"""One panel of a picture: curves of one quantity over time, their limits, waypoints and knots."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.view.curves import Strokes, strokes
from knotwork.view.limits import draw_bands, draw_broken, draw_limits
from knotwork.view.notes import limit_note
from knotwork.view.panel import Panel, Series
from knotwork.view.style import (
    DARK,
    SMALL,
    WRONG,
    colour,
    dashes,
    dress,
    mark_asked,
    mark_waypoints,
    wrap,
)

# A range below this, relative to the values or to 1, is rounding of a curve that stands still; it
# is shown this wide, again relative to the values or to 1.
STILL, STILL_RANGE = 1e-9, 0.2
# Room below the curves for the knots, and above them, in parts of the range.
FOOT, HEAD = 0.12, 0.07
# Room around a note, and the most that it may take, in parts of the panel's height.
NOTE_ROOM, MOST_TAKEN = 0.06, 0.7
# More of these would hide the curve.
MOST_KNOT_TICKS, MOST_KNOT_DOTS, MOST_JUMP_DOTS, MOST_LARGE_DOTS = 400, 40, 60, 60
# Motions whose knots have a row of ticks each, so high in parts of the panel.
MOST_KNOT_ROWS, KNOT_TICK = 3, 0.035


def draw_panel(panel: Panel) -> None:
    """Draw everything but limits, whose place depends on the range of a whole row."""
    dress(panel.axis)
    panel.axis.set_ylabel(panel.title)
    for one in panel.series:
        _curve(panel, one)
    _waypoints(panel)
    _knots(panel)


def _curve(panel: Panel, one: Series) -> None:
    drawn = strokes(one.motion.curve, one.component, panel.order, panel.factor)
    look = colour(one.index)
    time, value = drawn.line(steps=panel.quantity == "jerk")
    panel.axis.plot(
        time,
        value,
        color=look,
        linestyle=dashes(one.dashed),
        linewidth=2.0,
        gid=panel.gid("curve", one),
        zorder=3,
        solid_capstyle="butt",
    )
    panel.low = min(panel.low, float(drawn.value.min()))
    panel.high = max(panel.high, float(drawn.value.max()))
    if panel.quantity != "jerk" and drawn.jumps.size:
        _jumps(panel, one, drawn, look)
    draw_broken(panel, one, drawn)


def _jumps(panel: Panel, one: Series, drawn: Strokes, look: str) -> None:
    time, value = drawn.jump_lines()
    few = drawn.jumps.size * len(panel.series) <= MOST_JUMP_DOTS
    panel.axis.plot(
        time,
        value,
        color=look,
        linestyle=(0, (1, 1.5)),
        linewidth=1.2,
        marker="o" if few else "",
        markersize=4,
        markerfacecolor="white",
        gid=panel.gid("jump", one),
        zorder=3.5,
    )
    panel.shown.add("jump")


def _waypoints(panel: Panel) -> None:
    marks = panel.series[0].motion.marks
    if marks is None:
        return
    if mark_waypoints(panel.axis, marks.time):
        panel.shown.add("waypoint")
    if panel.order > 1:
        return
    seen: set[str] = set()
    small = len(marks.time) > MOST_LARGE_DOTS // len(panel.series)
    for one in panel.series:
        if one.joint in seen or one.motion.marks is None:
            continue
        seen.add(one.joint)
        one_marks = one.motion.marks
        value = panel.factor * one_marks.asked[panel.order][:, one.component]
        known = np.isfinite(value)
        if not known.any():
            continue
        several = len({other.motion.label for other in panel.series}) > 1
        look = DARK if several else colour(one.index)
        gid = panel.gid("asked", one)
        mark_asked(panel.axis, one_marks.time[known], value[known], gid, look, small=small)
        panel.low = min(panel.low, float(value[known].min()))
        panel.high = max(panel.high, float(value[known].max()))
        panel.shown.add("asked")


def _knots(panel: Panel) -> None:
    motions = {one.motion.label: one for one in panel.series}
    if len(motions) > MOST_KNOT_ROWS:
        return
    for row, one in enumerate(motions.values()):
        breaks = one.motion.curve.x
        if len(breaks) > MOST_KNOT_TICKS:
            continue
        panel.axis.vlines(
            breaks,
            KNOT_TICK * row,
            KNOT_TICK * (row + 0.85),
            transform=panel.axis.get_xaxis_transform(),
            color=DARK if len(motions) == 1 else colour(one.index),
            linewidth=1.6,
            gid=panel.gid("knots", one),
            zorder=4,
        )
        panel.shown.add("knot")
    if not panel.alone or panel.quantity == "jerk":
        return
    one = panel.series[0]
    breaks = one.motion.curve.x
    if len(breaks) <= MOST_KNOT_DOTS:
        value = panel.factor * one.motion.curve(breaks, panel.order)[:, one.component]
        jumps = np.abs(one.motion.curve.jumps(panel.order)[:, one.component])
        keep = np.concatenate(([True], jumps < STILL, [True]))
        panel.shown.add("knot-dot")
        panel.axis.plot(
            breaks[keep],
            value[keep],
            linestyle="none",
            marker="D",
            markersize=4,
            color=DARK,
            gid=panel.gid("knot-dots", one),
            zorder=3.8,
        )


def finish_panel(panel: Panel, low: float, high: float) -> None:
    """Draw the limits and set the range.

    Args:
        panel: What has been drawn.
        low: Least of the values of all panels that share this one's scale.
        high: Greatest of them.
    """
    middle = 0.5 * (low + high)
    scale = max(1.0, abs(middle))
    if high - low < STILL * scale:
        low, high = (middle + side * 0.5 * STILL_RANGE * scale for side in (-1.0, 1.0))
    low, high = draw_limits(panel, low, high)
    span = high - low
    note = limit_note(panel.series, panel.quantity, panel.factor, panel.unit)
    bottom = low - FOOT * span
    panel.ceiling = high
    if panel.one_joint:
        draw_bands(panel, bottom, high + HEAD * span)
    panel.axis.set_ylim(bottom, high + HEAD * span)
    if note:
        panel.note = panel.axis.text(
            0.995,
            0.97,
            note.text,
            transform=panel.axis.transAxes,
            ha="right",
            va="top",
            fontsize=SMALL,
            color=WRONG if note.broken else DARK,
            weight="bold" if note.broken else "normal",
            parse_math=False,
            gid="note",
            zorder=6,
            bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.0},
        )
        panel.note.set_in_layout(False)


def make_room(panel: Panel, width: float, height: float) -> None:
    """Break the note into lines that fit, and raise the top so that they hide no curve.

    Args:
        panel: What has been drawn and finished.
        width: Of the panel, as laid out [in].
        height: Likewise.
    """
    if panel.note is None:
        return
    figure: Any = panel.axis.figure
    wrap(panel.note, width)
    box = panel.note.get_window_extent(figure.canvas.get_renderer())
    taken = min(box.height / figure.dpi / height + NOTE_ROOM, MOST_TAKEN)
    bottom, _ = panel.axis.get_ylim()
    panel.axis.set_ylim(bottom, bottom + (panel.ceiling - bottom) / (1.0 - taken))
