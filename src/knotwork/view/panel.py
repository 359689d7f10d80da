"""A panel of a picture: curves over time with limits and marks, and its drawing."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from knotwork.view.style import (
    LOOKS,
    SMALL,
    WRONG,
    colour,
    dashes,
    dress,
    least_height,
    mark_waypoints,
    new_figure,
    write_note,
)
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# A range below this, relative to the values or to 1 of their SI unit, is the rounding of a constant
# curve; it is shown this wide, relative to the values or to 1 of the displayed unit.
STILL, STILL_RANGE = 1e-9, 0.2
# Margins below the curves for the knots, and above them, as fractions of the range.
FOOT, HEAD = 0.12, 0.07
# Distance of a limit from the curves, relative to their range, beyond which it is only a note: a
# line would compress the curves.
NEAR = 0.35
# Margin around a note, and its largest height, as fractions of the panel's height.
NOTE_MARGIN, MOST_TAKEN = 0.06, 0.7
# Width of numbers and name of a panel [in]; width of letters, plain and bold, relative to the font
# size.
BESIDE, LETTER, BOLD_LETTER = 0.95, 0.55, 0.62
# Height of the panels as a fraction of the figure's.
PANEL_HEIGHT = 0.57
# Margin for marks of a curve below a note, in points.
MARK_MARGIN = 5.0
# Height of a row of knots as a fraction of the panel's.
KNOT_TICK = 0.035
# Letters in a line of a quantity's name; panels lower than this [in] have the unit below it.
LONG, LOW = 17, 2.2
# In panels lower than this [in] the name is written across, in lines of this number of letters.
LOWEST, SHORT = 1.2, 12


class Mark(NamedTuple):
    """A mark of a curve: its kind, as in `LOOKS`, its points, and further style."""

    kind: str
    time: FloatArray
    value: FloatArray
    look: dict[str, Any]


@dataclass
class Curve:
    """One curve of a panel.

    Attributes:
        name: Its name, part of the names of its drawn parts.
        index: Index of colour and line style.
        time: Times [s], shape (n,).
        value: Values in the displayed unit, shape (n,), with NaN at gaps.
        marks: Its marks.
    """

    name: str
    index: int
    time: FloatArray
    value: FloatArray
    marks: list[Mark] = field(default_factory=list)

    def mark(self, kind: str, time: FloatArray, value: FloatArray, **look: Any) -> None:
        """Mark points of the curve."""
        if len(time):
            self.marks.append(Mark(kind, time, value, look))


@dataclass
class Level:
    """A limit of a panel.

    Attributes:
        kind: `"limit"` or `"tolerance"`.
        value: Value in the displayed unit.
        spans: Time intervals of its validity [s].
        always: Draw it at any distance from the curves.
        index: Index of the colour of its curve; `None` if it applies to all.
    """

    kind: str
    value: float
    spans: Sequence[tuple[float, float]]
    always: bool = False
    index: int | None = None


@dataclass
class Panel:
    """Curves of one quantity over time.

    Attributes:
        title: Name of the quantity.
        unit: Displayed unit.
        factor: Factor from the SI unit to the displayed one.
        curves: The curves.
        waypoints: Times of the waypoints [s].
        zero: Include 0 in the range.
        levels: Limits to draw as lines.
        allowed: Values beyond these are shaded.
        bands: Filled rectangles: start and end [s], lower and upper value.
        knots: Rows of ticks: times [s] and colour.
        note: Text above the curves.
        broken: Whether the note is a failure.
    """

    title: str
    unit: str
    factor: float
    curves: list[Curve]
    waypoints: FloatArray
    zero: bool = False
    levels: list[Level] = field(default_factory=list)
    allowed: tuple[float, float] = (-np.inf, np.inf)
    bands: list[tuple[float, float, float, float]] = field(default_factory=list)
    knots: list[tuple[FloatArray, str]] = field(default_factory=list)
    note: str = ""
    broken: bool = False

    def span(self) -> tuple[float, float]:
        """Smallest and largest of the displayed values."""
        asked = [mark.value for one in self.curves for mark in one.marks if mark.kind == "asked"]
        values = np.concatenate([*(one.value for one in self.curves), *asked, [0.0] * self.zero])
        values = values[np.isfinite(values)]
        return float(values.min()), float(values.max())


def draw_grid(
    grid: Sequence[Sequence[Panel]], page: tuple[float, float] | None, *, shared: bool = False
) -> Figure:
    """Draw rows of panels, on a page or as large as needed; `shared`: a row has one scale."""
    rows, columns = len(grid), len(grid[0])
    figure = new_figure(rows, columns, page)
    axes = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for line, panels in zip(axes, grid, strict=True):
        spans = np.array([panel.span() for panel in panels])
        if shared:
            spans[:] = spans[:, 0].min(), spans[:, 1].max()
        for axis, panel, span in zip(line, panels, spans, strict=True):
            draw_panel(axis, panel, span, rows, columns)
        if shared:
            limits = np.array([axis.get_ylim() for axis in line])
            for axis in line:
                axis.set_ylim(limits.min(), limits.max())
            for axis in line[1:]:
                axis.set_ylabel("")
    figure.align_ylabels()
    return figure


def draw_panel(
    axis: Axes, panel: Panel, span: tuple[float, float], rows: int, columns: int
) -> None:
    """Draw a panel: its curves and marks, near limits, and the note at the top.

    Args:
        axis: Axes of the panel.
        panel: Its content.
        span: Smallest and largest value of all panels with the same scale.
        rows: Number of rows of panels in the picture.
        columns: Number of columns.
    """
    dress(axis)
    figure: Any = axis.figure
    row_height = figure.get_figheight() / rows
    across: dict[str, Any] = {"rotation": 0, "ha": "right", "va": "center", "fontsize": SMALL}
    lowest = row_height < LOWEST and columns == 1
    title = textwrap.fill(panel.title, SHORT if lowest else LONG)
    unit = f"[{panel.unit}]" if panel.unit else ""
    label = ("\n" if row_height < LOW else " ").join(filter(None, [title, unit]))
    axis.set_ylabel(label, **across if lowest else {})
    for one in panel.curves:
        look: dict[str, Any] = {"color": colour(one.index), "linestyle": dashes(one.index)}
        look |= {"linewidth": 2.0, "zorder": 3, "solid_capstyle": "butt"}
        axis.plot(one.time, one.value, gid=f"curve:{one.name}", **look)
        for mark in one.marks:
            gid = f"{mark.kind}:{one.name}"
            axis.plot(mark.time, mark.value, gid=gid, **LOOKS[mark.kind] | mark.look)
    mark_waypoints(axis, panel.waypoints)
    for row, (times, look_of) in enumerate(panel.knots):
        low, high = KNOT_TICK * row, KNOT_TICK * (row + 0.85)
        upright: dict[str, Any] = {"transform": axis.get_xaxis_transform(), "linewidth": 1.6}
        axis.vlines(times, low, high, color=look_of, gid=f"knots:{row}", zorder=4, **upright)
    for start, end, least, most in panel.bands:
        axis.fill_between([start, end], least, most, gid="band", **LOOKS["band"])
    bottom, top = _draw_levels(axis, panel, *_widened(panel, *span))
    bottom, top = bottom - FOOT * (top - bottom), top + HEAD * (top - bottom)
    if panel.note:
        letter = SMALL * (BOLD_LETTER if panel.broken else LETTER)
        width = int(72.0 * (figure.get_figwidth() / columns - BESIDE) / letter)
        lines = [line for one in panel.note.split("\n") for line in textwrap.wrap(one, width)]
        height = min(least_height(rows), PANEL_HEIGHT * figure.get_figheight() / rows)
        taken = NOTE_MARGIN + (len(lines) * 1.2 * SMALL + MARK_MARGIN) / 72.0 / height
        top = bottom + (top - bottom) / (1.0 - min(taken, MOST_TAKEN))
        write_note(axis, "\n".join(lines), panel.broken)
    axis.set_ylim(bottom, top)
    far = 10.0 * (top - bottom)  # the top may be raised
    lower, upper = panel.allowed
    for start, end in ((bottom - far, lower), (upper, top + far)):
        if start < end and bottom < end and start < top:
            axis.axhspan(start, end, color=WRONG, alpha=0.07, lw=0, zorder=0, gid="band")


def _widened(panel: Panel, low: float, high: float) -> tuple[float, float]:
    """A range of values, at least `STILL_RANGE` wide, also with limits."""
    middle = 0.5 * (low + high)
    scale = max(1.0, abs(middle))
    limits = [abs(one.value) for one in panel.levels if np.isfinite(one.value)]
    if high - low >= STILL * max(panel.factor, scale, *limits):
        return low, high
    return middle - 0.5 * STILL_RANGE * scale, middle + 0.5 * STILL_RANGE * scale


def _draw_levels(axis: Axes, panel: Panel, low: float, high: float) -> tuple[float, float]:
    """Draw the limits near the curves, and give the range including them."""
    margin = NEAR * (high - low)
    for level in panel.levels:
        if level.always or low - margin <= level.value <= high + margin:
            low, high = min(low, level.value), max(high, level.value)
            times = np.array([(start, end, end) for start, end in level.spans]).ravel()[:-1]
            values = np.tile([level.value, level.value, np.nan], len(level.spans))[:-1]
            gid = f"{level.kind}:{panel.title}"
            own = {} if level.index is None else {"color": colour(level.index)}
            axis.plot(times, values, gid=gid, **LOOKS[level.kind] | own)
    return low, high
