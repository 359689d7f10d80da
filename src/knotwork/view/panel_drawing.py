"""One panel of a picture: curves of one quantity over time, their limits, waypoints and knots."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from knotwork.view.curves import Strokes, strokes
from knotwork.view.panel import Panel, Series
from knotwork.view.panel_limits import coinciding, draw_bands, draw_broken, draw_limits, limit_note
from knotwork.view.style import (
    DARK,
    LOOKS,
    SMALL,
    colour,
    dashes,
    dress,
    least_height,
    mark_waypoints,
    write_note,
)

# A range below this, relative to the values or to 1 of their SI unit, is rounding of a curve that
# stands still; it is shown this wide, relative to the values or to 1 of the shown unit.
STILL, STILL_RANGE = 1e-9, 0.2
# Margins below the curves for the knots, and above them, in parts of the range.
FOOT, HEAD = 0.12, 0.07
# Margin around a note, and its greatest height, in parts of the panel's height.
NOTE_MARGIN, MOST_TAKEN = 0.06, 0.7
# Width of the panels in parts of the figure's, and of letters, plain and bold, in parts of the
# font's size.
PANEL_WIDTH, LETTER, BOLD_LETTER = 0.85, 0.55, 0.62
# Height of the panels in parts of the figure's.
PANEL_HEIGHT = 0.57
# Margin for marks of a curve below a note, in points.
MARK_MARGIN = 5.0
# More of these would hide the curve.
MOST_KNOT_TICKS, MOST_KNOT_DOTS, MOST_JUMP_DOTS, MOST_LARGE_DOTS = 400, 40, 60, 60
# Motions whose knots have a row of ticks each, so high in parts of the panel.
MOST_KNOT_ROWS, KNOT_TICK = 3, 0.035


def draw_panel(panel: Panel) -> None:
    """Draw everything but limits, whose place depends on the range of a whole row."""
    dress(panel.axis)
    panel.axis.set_ylabel(f"{panel.quantity} [{panel.shown_in}]")
    for one in panel.series:
        _curve(panel, one)
    _waypoints(panel)
    _knots(panel)


def _curve(panel: Panel, one: Series) -> None:
    drawn = strokes(one.motion.curve, one.component, panel.order, *panel.scale(one))
    look = colour(one.index)
    time, value = drawn.line(steps=panel.quantity == "jerk")
    panel.axis.plot(
        time,
        value,
        color=look,
        linestyle=dashes(one.index),
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
    look_of = LOOKS["jump"] | {"color": look}
    if drawn.jumps.size * len(panel.series) > MOST_JUMP_DOTS:
        look_of["marker"] = ""
    panel.axis.plot(*drawn.jump_lines(), gid=panel.gid("jump", one), zorder=3.5, **look_of)


def _waypoints(panel: Panel) -> None:
    marks = panel.series[0].motion.marks
    if marks is None:
        return
    mark_waypoints(panel.axis, marks.time)
    if panel.order > 1:
        return
    seen: set[str] = set()
    small = len(marks.time) > MOST_LARGE_DOTS // len(panel.series)
    for one in panel.series:
        if one.joint in seen or one.motion.marks is None:
            continue
        seen.add(one.joint)
        one_marks = one.motion.marks
        factor, offset = panel.scale(one)
        value = factor * one_marks.asked[panel.order][:, one.component] + offset
        known = np.isfinite(value)
        if not known.any():
            continue
        several = len({other.motion.label for other in panel.series}) > 1
        look = LOOKS["asked"] | ({} if several else {"markeredgecolor": colour(one.index)})
        look |= {"markersize": 3.5} if small else {}
        gid = panel.gid("asked", one)
        panel.axis.plot(one_marks.time[known], value[known], gid=gid, zorder=4, **look)
        panel.low = min(panel.low, float(value[known].min()))
        panel.high = max(panel.high, float(value[known].max()))


def _knots(panel: Panel) -> None:
    motions = {one.motion.label: one for one in panel.series}
    if len(motions) > MOST_KNOT_ROWS:
        return
    for row, one in enumerate(motions.values()):
        if len(one.motion.knots) > MOST_KNOT_TICKS:
            continue
        panel.axis.vlines(
            one.motion.knots,
            KNOT_TICK * row,
            KNOT_TICK * (row + 0.85),
            transform=panel.axis.get_xaxis_transform(),
            color=DARK if len(motions) == 1 else colour(one.index),
            linewidth=1.6,
            gid=panel.gid("knots", one),
            zorder=4,
        )
    if not panel.alone or panel.quantity == "jerk":
        return
    one = panel.series[0]
    breaks = one.motion.curve.x
    if len(breaks) <= MOST_KNOT_DOTS:
        value = panel.factor * one.motion.curve(breaks, panel.order)[:, one.component]
        jumps = np.abs(one.motion.curve.jumps(panel.order)[:, one.component])
        keep = np.concatenate(([True], jumps < STILL, [True])) & np.isin(breaks, one.motion.knots)
        gid = panel.gid("knot-dots", one)
        panel.axis.plot(breaks[keep], value[keep], gid=gid, zorder=3.8, **LOOKS["knot-dots"])


def finish_panel(panel: Panel, low: float, high: float, rows: int, columns: int) -> None:
    """Draw the limits, set the range, and note above the curves how near the limits are.

    Args:
        panel: With its curves.
        low: Least of the values of all panels that share this one's scale.
        high: Greatest of them.
        rows: Of panels in the picture.
        columns: Likewise.
    """
    middle = 0.5 * (low + high)
    scale = max(1.0, abs(middle))
    if high - low < STILL * max(panel.factor, scale):
        low, high = (middle + side * 0.5 * STILL_RANGE * scale for side in (-1.0, 1.0))
    low, high = draw_limits(panel, low, high)
    bottom, top = low - FOOT * (high - low), high + HEAD * (high - low)
    note, broken = limit_note(panel.series, panel.quantity, panel.factor, panel.unit)
    together = coinciding(panel)
    if note or together:
        figure: Any = panel.axis.figure
        width = 72.0 * PANEL_WIDTH * figure.get_figwidth() / columns
        letter = SMALL * (BOLD_LETTER if broken else LETTER)
        notes = [one for one in (note, *together) if one]
        lines = [line for one in notes for line in textwrap.wrap(one, int(width / letter))]
        height = min(least_height(rows), PANEL_HEIGHT * figure.get_figheight() / rows)
        taken = NOTE_MARGIN + (len(lines) * 1.2 * SMALL + MARK_MARGIN) / 72.0 / height
        top = bottom + (high - bottom) / (1.0 - min(taken, MOST_TAKEN))
        write_note(panel.axis, "\n".join(lines), broken)
    panel.axis.set_ylim(bottom, top)
    if panel.one_joint:
        draw_bands(panel, bottom, top)
