"""A panel of a picture: curves over time, their marks, limits, and a note above them."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.view.style import DARK, MARK_LOOKS, SMALL, WRONG, colour, dashes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONSTANT_RANGE, SHOWN_RANGE = 1e-9, 0.2
"""Range below which a curve is constant up to rounding, and width of its panel, both relative to
the values or to 1 of the unit.
"""
FOOT_MARGIN, HEAD_MARGIN = 0.12, 0.07
"""Margins below the curves for the knots, and above them, as fractions of the range."""
LIMIT_DISTANCE = 0.35
"""Distance of a limit from the curves, relative to their range, above which it is not drawn."""
MAX_WAYPOINT_LINES = 400
"""Number of waypoints above which their lines would hide the curves."""
KNOT_HEIGHT = 0.035
"""Height of a row of knots as a fraction of the panel's."""
NOTE_LETTERS = 14
"""Letters of a note per inch of a panel's width."""
LABEL_LETTERS = 12
"""Letters in a line of a quantity's name."""
LABEL_WIDTH = 1.0
"""Width of a quantity's name and of the numbers next to a panel [in]."""


class LimitLine(NamedTuple):
    """A limit of a panel.

    Attributes:
        kind: `"limit"` or `"tolerance"`.
        value: Value in the displayed unit.
        spans: Time intervals in which the limit applies [s].
        always: Whether it is drawn at any distance from the curves.
        colour: Colour, if the limit applies to one curve only.
    """

    kind: str
    value: float
    spans: Sequence[tuple[float, float]]
    always: bool = False
    colour: str | None = None


@dataclass
class Panel:
    """Curves of one quantity over time.

    Attributes:
        axes: Axes of the panel.
        title: Name of the quantity.
        unit: Displayed unit.
        factor: Factor from the SI unit to the displayed one.
        levels: Limits to draw as lines.
        note: Text above the panel.
        failed: Whether the note is a failure.
    """

    axes: Axes
    title: str
    unit: str
    factor: float
    levels: list[LimitLine] = field(default_factory=list)
    note: str = ""
    failed: bool = False

    def draw_curve(self, name: str, index: int, time: FloatArray, value: FloatArray) -> None:
        """Draw values in the displayed unit, NaN at gaps; `index` selects colour and line style."""
        look: dict[str, Any] = {"color": colour(index), "linestyle": dashes(index)}
        look |= {"linewidth": 2.0, "zorder": 3, "solid_capstyle": "butt"}
        self.axes.plot(time, value, gid=f"curve:{name}", **look)

    def mark(self, kind: str, name: str, time: FloatArray, value: FloatArray, **look: Any) -> None:
        """Mark points of a curve; the kind is one of `MARK_LOOKS`."""
        if len(time):
            self.axes.plot(time, value, gid=f"{kind}:{name}", **MARK_LOOKS[kind] | look)

    def mark_waypoints(self, times: FloatArray) -> None:
        """Draw a vertical line at each waypoint, unless there are too many."""
        if 0 < len(times) <= MAX_WAYPOINT_LINES:
            self._draw_uprights(times, 0.0, 1.0, gid="waypoint", zorder=1, **MARK_LOOKS["waypoint"])

    def mark_knots(self, row: int, times: FloatArray, shade: str) -> None:
        """Draw a row of ticks at the lower edge."""
        low, high = KNOT_HEIGHT * row, KNOT_HEIGHT * (row + 0.85)
        look: dict[str, Any] = {"color": shade, "linewidth": 1.6, "zorder": 4}
        self._draw_uprights(times, low, high, gid=f"knots:{row}", **look)

    def _draw_uprights(self, times: FloatArray, low: float, high: float, **look: Any) -> None:
        self.axes.vlines(times, low, high, transform=self.axes.get_xaxis_transform(), **look)

    def finish(self) -> None:
        """Draw the limits near the curves, set the range of values, and write the texts."""
        low, high = self._draw_levels(*self._curve_range())
        span = high - low
        self.axes.set_ylim(low - FOOT_MARGIN * span, high + HEAD_MARGIN * span)
        label = f"{self.title} [{self.unit}]" if self.unit else self.title
        level: dict[str, Any] = {"rotation": 0, "ha": "right", "va": "center", "fontsize": SMALL}
        self.axes.set_ylabel(textwrap.fill(label, LABEL_LETTERS), **level)
        figure: Any = self.axes.figure
        columns = self.axes.get_subplotspec().get_gridspec().ncols  # type: ignore[union-attr]
        width = figure.get_figwidth() / columns - LABEL_WIDTH
        note = textwrap.fill(self.note, int(NOTE_LETTERS * width))
        shade, weight = (WRONG, "bold") if self.failed else (DARK, "normal")
        self.axes.set_title(note, loc="right", fontsize=SMALL, color=shade, weight=weight)

    def _curve_range(self) -> tuple[float, float]:
        """The range of the drawn values, wider if they are constant up to rounding."""
        low, high = (float(end) for end in self.axes.dataLim.intervaly)
        middle, scale = 0.5 * (low + high), max(1.0, 0.5 * abs(low + high))
        limits = [abs(level.value) for level in self.levels if np.isfinite(level.value)]
        if high - low < CONSTANT_RANGE * max(self.factor, scale, *limits):
            return middle - 0.5 * SHOWN_RANGE * scale, middle + 0.5 * SHOWN_RANGE * scale
        return low, high

    def _draw_levels(self, low: float, high: float) -> tuple[float, float]:
        """Draw the limits near curves with this range, and return the range with the limits."""
        margin = LIMIT_DISTANCE * (high - low)
        for level in self.levels:
            if level.always or low - margin <= level.value <= high + margin:
                low, high = min(low, level.value), max(high, level.value)
                times = np.array([(start, end, np.nan) for start, end in level.spans]).ravel()
                look = {} if level.colour is None else {"color": level.colour}
                self.mark(level.kind, self.title, times, np.full(len(times), level.value), **look)
        return low, high
