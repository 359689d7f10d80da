"""One panel of a picture: curves of one quantity over time, their limits, waypoints and knots."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.joint_quantities import DERIVATIVES, rate_unit
from knotwork.view.curves import Strokes, strokes
from knotwork.view.limits import draw_bands, draw_broken, draw_limits
from knotwork.view.notes import limit_note
from knotwork.view.series import Series
from knotwork.view.style import (
    DARK,
    SMALL,
    WRONG,
    colour,
    dashes,
    dress,
    mark_waypoints,
    shown_unit,
    wrap,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

# A range below this, relative to the values or to 1, is rounding of a curve that stands still; it
# is shown this wide, again relative to the values or to 1.
STILL, STILL_RANGE = 1e-9, 0.2
# Room below the curves for the knots, and above them, in parts of the range.
FOOT, HEAD = 0.12, 0.07
# Room around a note, and the most that it may take, in parts of the panel's height.
NOTE_ROOM, MOST_TAKEN = 0.06, 0.7
# More of these would hide the curve.
MOST_WAYPOINT_LINES = 400
MOST_KNOT_TICKS, MOST_KNOT_DOTS, MOST_JUMP_DOTS, MOST_LARGE_DOTS = 400, 40, 60, 60
# Motions whose knots have a row of ticks each, so high in parts of the panel.
MOST_KNOT_ROWS, KNOT_TICK = 3, 0.035


@dataclass
class Panel:
    """What a panel shows, and what came of drawing it.

    Attributes:
        axis: Where.
        quantity: Name of the quantity.
        series: The curves, all of joints of one unit.
        degrees: Show angles in degrees.
        shown: What of the legend's entries occurs in it: see `heads.explain_marks`.
        low, high: Range of values to show.
        ceiling: The highest that a note may not hide.
        note: What it says of limits.
    """

    axis: Axes
    quantity: str
    series: list[Series]
    degrees: bool
    shown: set[str] = field(default_factory=set)
    low: float = np.inf
    high: float = -np.inf
    ceiling: float = 0.0
    note: Text | None = None

    @property
    def order(self) -> int:
        """Order of the derivative."""
        return DERIVATIVES.index(self.quantity)

    @property
    def factor(self) -> float:
        """From the SI unit to the shown one."""
        return shown_unit(self.series[0].unit, self.degrees)[1]

    @property
    def unit(self) -> str:
        """Unit that values are shown in."""
        return rate_unit(shown_unit(self.series[0].unit, self.degrees)[0], self.order)

    @property
    def title(self) -> str:
        """Label of the axis."""
        return f"{self.quantity} [{self.unit}]"

    @property
    def alone(self) -> bool:
        """Whether one joint of one motion is shown, with room for details."""
        return len(self.series) == 1

    def draw(self) -> None:
        """Draw everything but limits, whose place depends on the range of a whole row."""
        dress(self.axis)
        self.axis.set_ylabel(self.title)
        for one in self.series:
            self._curve(one)
        self._waypoints()
        self._knots()

    @property
    def one_joint(self) -> bool:
        """Whether all curves are of the same joint."""
        return len({one.joint for one in self.series}) == 1

    def gid(self, kind: str, one: Series) -> str:
        """Name of something drawn for a curve, for those who look for it in the figure."""
        return f"{kind}:{one.motion.label}:{one.joint}:{self.quantity}"

    def _curve(self, one: Series) -> None:
        drawn = strokes(one.motion.curve, one.component, self.order, self.factor)
        look = colour(one.index)
        time, value = drawn.line(steps=self.quantity == "jerk")
        self.axis.plot(
            time,
            value,
            color=look,
            linestyle=dashes(one.dashed),
            linewidth=2.0,
            gid=self.gid("curve", one),
            zorder=3,
            solid_capstyle="butt",
        )
        self.low = min(self.low, float(drawn.value.min()))
        self.high = max(self.high, float(drawn.value.max()))
        if self.quantity != "jerk" and drawn.jumps.size:
            self._jumps(one, drawn, look)
        draw_broken(self, one, drawn)

    def _jumps(self, one: Series, drawn: Strokes, look: str) -> None:
        time, value = drawn.jump_lines()
        few = drawn.jumps.size * len(self.series) <= MOST_JUMP_DOTS
        self.axis.plot(
            time,
            value,
            color=look,
            linestyle=(0, (1, 1.5)),
            linewidth=1.2,
            marker="o" if few else "",
            markersize=4,
            markerfacecolor="white",
            gid=self.gid("jump", one),
            zorder=3.5,
        )
        self.shown.add("jump")

    def _waypoints(self) -> None:
        marks = self.series[0].motion.marks
        if marks is None:
            return
        if len(marks.time) <= MOST_WAYPOINT_LINES:
            mark_waypoints(self.axis, marks.time)
            self.shown.add("waypoint")
        if self.order > 1:
            return
        seen: set[str] = set()
        small = len(marks.time) > MOST_LARGE_DOTS // len(self.series)
        for one in self.series:
            if one.joint in seen or one.motion.marks is None:
                continue
            seen.add(one.joint)
            one_marks = one.motion.marks
            value = self.factor * one_marks.asked[self.order][:, one.component]
            known = np.isfinite(value)
            if not known.any():
                continue
            several = len({other.motion.label for other in self.series}) > 1
            self.axis.plot(
                one_marks.time[known],
                value[known],
                linestyle="none",
                marker="o",
                markersize=3.5 if small else 6,
                markerfacecolor="white",
                markeredgecolor=DARK if several else colour(one.index),
                markeredgewidth=1.3,
                gid=self.gid("asked", one),
                zorder=4,
            )
            self.low = min(self.low, float(value[known].min()))
            self.high = max(self.high, float(value[known].max()))
            self.shown.add("asked")

    def _knots(self) -> None:
        motions = {one.motion.label: one for one in self.series}
        if len(motions) > MOST_KNOT_ROWS:
            return
        for row, one in enumerate(motions.values()):
            breaks = one.motion.curve.x
            if len(breaks) > MOST_KNOT_TICKS:
                continue
            self.axis.vlines(
                breaks,
                KNOT_TICK * row,
                KNOT_TICK * (row + 0.85),
                transform=self.axis.get_xaxis_transform(),
                color=DARK if len(motions) == 1 else colour(one.index),
                linewidth=1.6,
                gid=self.gid("knots", one),
                zorder=4,
            )
            self.shown.add("knot")
        if not self.alone or self.quantity == "jerk":
            return
        one = self.series[0]
        breaks = one.motion.curve.x
        if len(breaks) <= MOST_KNOT_DOTS:
            value = self.factor * one.motion.curve(breaks, self.order)[:, one.component]
            jumps = np.abs(one.motion.curve.jumps(self.order)[:, one.component])
            keep = np.concatenate(([True], jumps < STILL, [True]))
            self.shown.add("knot-dot")
            self.axis.plot(
                breaks[keep],
                value[keep],
                linestyle="none",
                marker="D",
                markersize=4,
                color=DARK,
                gid=self.gid("knot-dots", one),
                zorder=3.8,
            )

    def finish(self, low: float, high: float) -> None:
        """Draw the limits and set the range.

        Args:
            low: Least of the values of all panels that share this one's scale.
            high: Greatest of them.
        """
        middle = 0.5 * (low + high)
        scale = max(1.0, abs(middle))
        if high - low < STILL * scale:
            low, high = (middle + side * 0.5 * STILL_RANGE * scale for side in (-1.0, 1.0))
        low, high = draw_limits(self, low, high)
        span = high - low
        note = limit_note(self.series, self.quantity, self.factor, self.unit)
        bottom = low - FOOT * span
        self.ceiling = high
        if self.one_joint:
            draw_bands(self, bottom, high + HEAD * span)
        self.axis.set_ylim(bottom, high + HEAD * span)
        if note:
            self.note = self.axis.text(
                0.995,
                0.97,
                note.text,
                transform=self.axis.transAxes,
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
            self.note.set_in_layout(False)

    def make_room(self, width: float, height: float) -> None:
        """Break the note into lines that fit, and raise the top so that they hide no curve.

        Args:
            width: Of the panel, as laid out [in].
            height: Likewise.
        """
        if self.note is None:
            return
        figure: Any = self.axis.figure
        wrap(self.note, width)
        box = self.note.get_window_extent(figure.canvas.get_renderer())
        taken = min(box.height / figure.dpi / height + NOTE_ROOM, MOST_TAKEN)
        bottom, _ = self.axis.get_ylim()
        self.axis.set_ylim(bottom, bottom + (self.ceiling - bottom) / (1.0 - taken))
