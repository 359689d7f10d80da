"""A picture: panels over time, with titles, names and legends around them."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from knotwork.errors import UnknownNameError
from knotwork.view.panel import Panel
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.style import (
    DARK,
    GRID,
    LARGE,
    MARK_LOOKS,
    NORMAL,
    SMALL,
    WRONG,
    colour,
    dashes,
    number,
    printable,
    settings,
    shorten_names,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

PAGE_SIZES = {"a4": (8.27, 11.69), "slide": (13.333, 7.5)}
"""Upright A4, and a slide of 16 to 9 [in]."""
PICTURE_WIDTH, ROW_HEIGHT, HEAD_HEIGHT = 10.0, 2.3, 1.3
"""Width of a picture of one column, height of a row, and of titles and legends [in]."""
MIN_ROW_HEIGHT, MIN_PICTURE_HEIGHT = 1.6, 5.0
"""Minimum height of a row and of a picture [in]."""
MAX_ROW_HEIGHTS = 5
"""Number of rows above which they become lower."""
MANY_COLUMNS_ROW = 1.25
"""Height of a row of several columns, relative to that of one: its panels are narrow."""

NAME_LETTERS, CURVE_LETTERS, TITLE_LETTERS, REASON_LETTERS = 16, 26, 50, 84
"""Maximum numbers of letters of names of waypoints and curves, of titles, and of reasons."""
LETTER_WIDTH = 0.62
"""Width of a letter, as a fraction of the font size."""
TIME_MARGIN = 0.012
"""Margin around the times of a motion, as a fraction of its duration."""
MIN_SPAN = 0.003
"""Minimum drawn duration of a contact, as a fraction of the motion."""
SEGMENTS = ("tool path", "way", "wait")
MIN_HEIGHT, LOW_HEIGHT, MANY_ROWS = 1.5, 1.1, 4
"""Minimum height of a panel [in], that of a panel of more rows than the last number."""

DrawPanel: TypeAlias = "Callable[[Axes], Panel]"


def draw_picture(
    motions: Sequence[ShownMotion],
    rows: Sequence[Sequence[DrawPanel]],
    title: str,
    *,
    joints: Sequence[str] = (),
    columns: Sequence[str] = ("",),
    size: str | None = None,
) -> Figure:
    """Draw panels, and write titles, names and legends around them.

    Args:
        motions: The drawn motions; the waypoints of the first one are named.
        rows: For each row of panels, functions that draw them; as many as there are columns.
        title: Title of the picture.
        joints: Names of the curves of a single motion, in the order of colours. Curves of several
            motions are named by their motions.
        columns: Titles of the columns.
        size: A name of `PAGE_SIZES`; by default as large as the panels need.

    Returns:
        A figure, not known to `pyplot`.

    Raises:
        UnknownNameError: The size is unknown.
    """
    if size is not None and size not in PAGE_SIZES:
        raise UnknownNameError("size", size, tuple(PAGE_SIZES))
    with settings():
        figure = _new_figure(len(rows), len(columns), size)
        grid = figure.subplots(len(rows), len(columns), sharex=True, squeeze=False)
        for line, row in zip(grid, rows, strict=True):
            for axes, draw in zip(line, row, strict=True):
                _dress(axes)
                draw(axes).finish()
        curves = [motion.label for motion in motions] if len(motions) > 1 else joints
        _add_curve_legend(figure, curves, title, motions)
        for axes in grid[0]:
            _mark_segments(axes, motions[0])
        for motion in motions:
            _mark_contacts(figure.axes, motion)
        _add_mark_legend(figure, motions[0])
        _set_times(grid[-1], motions)
        figure.align_ylabels()
        _lay_out(figure)
        for axes, column in zip(grid[0], shorten_names(columns, CURVE_LETTERS), strict=True):
            _write_above(axes, column, motions[0])
        _lay_out(figure)
        if size is None:
            _grow(figure, len(rows))
        figure.set_layout_engine("none")  # a second call gives the same result
    return figure


def _new_figure(rows: int, columns: int, size: str | None) -> Figure:
    """Make an empty figure, of the given size or as large as its rows and columns need."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    row = ROW_HEIGHT if columns == 1 else MANY_COLUMNS_ROW * ROW_HEIGHT
    row = max(MIN_ROW_HEIGHT, row * min(1.0, MAX_ROW_HEIGHTS / rows))
    width = PICTURE_WIDTH * max(1.0, (columns + 1) / 3)
    page = width, max(HEAD_HEIGHT + row * rows, MIN_PICTURE_HEIGHT)
    figure = Figure(
        figsize=page if size is None else PAGE_SIZES[size],
        dpi=150,
        layout="constrained",
        facecolor="white",
    )
    FigureCanvasAgg(figure)
    return figure


def _dress(axes: Axes) -> None:
    """Give a panel its frame, its grid and numbers without offsets."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, axis="y", color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.yaxis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))


def picture_title(motions: Sequence[ShownMotion], default: str) -> str:
    """Title of a picture: scenario, planner if there is only one, and whether a check fails."""
    first = motions[0]
    (name,) = shorten_names([first.scenario.name], TITLE_LETTERS)
    parts = [part for part in (name, first.label if len(motions) == 1 else "") if part]
    failed = [motion.label for motion in motions if motion.failures]
    if failed:
        names = "" if len(motions) == 1 else f" of {', '.join(failed)}"
        parts.append(f"check{names} FAILED")
    return " · ".join(parts) or default


def _grow(figure: Figure, rows: int) -> None:
    """Enlarge a figure if names and legends leave its panels too low."""
    height = figure.axes[0].get_window_extent().height / figure.dpi
    missing = (MIN_HEIGHT if rows <= MANY_ROWS else LOW_HEIGHT) - height
    if missing > 0.0:
        figure.set_figheight(figure.get_figheight() + rows * missing)
        _lay_out(figure)


def _lay_out(figure: Figure) -> None:
    """Place panels, names and legends, without drawing anything."""
    engine: Any = figure.get_layout_engine()
    engine.execute(figure)


def _set_times(axes: Sequence[Axes], motions: Sequence[ShownMotion]) -> None:
    """Set the common range of times, and name it below the last row of panels."""
    times = np.concatenate([motions[0].times, *(motion.curve.x[[0, -1]] for motion in motions)])
    start, end = float(np.nanmin(times)), float(np.nanmax(times))
    margin = TIME_MARGIN * (end - start)
    axes[0].set_xlim(start - margin, end + margin)
    for panel in axes:
        panel.set_xlabel("time [s]")


def _mark_segments(axes: Axes, motion: ShownMotion) -> None:
    """Mark tool paths, collision-free motions, waits and events on the upper edge of a panel."""
    start, end = float(motion.curve.x[0]), float(motion.curve.x[-1])
    times = {
        "event": [event.time for event in motion.trajectory.events if start <= event.time <= end]
    }
    for segment in motion.trajectory.segments:
        low, high = max(segment.start, start), min(segment.end, end)
        if segment.kind in SEGMENTS and low < high:
            times.setdefault(segment.kind, []).extend((low, high, np.nan))
    upright: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "clip_on": False}
    for kind, marked in times.items():
        if marked:
            axes.plot(marked, [1.0] * len(marked), gid=kind, **MARK_LOOKS[kind], **upright)


def _mark_contacts(axes: Sequence[Axes], motion: ShownMotion) -> None:
    """Mark contacts of bodies over the whole height of panels."""
    low, high = (float(end) for end in motion.curve.x[[0, -1]])
    margin = 0.5 * MIN_SPAN * (high - low)
    look: dict[str, Any] = MARK_LOOKS["contact"] | {"lw": 0.0, "gid": "contact"}
    shown = [(start, end) for start, end in motion.contacts if start <= high and end >= low]
    for panel, (start, end) in product(axes, shown):
        panel.axvspan(max(start - margin, low), min(end + margin, high), **look)


def _write_above(axes: Axes, column: str, motion: ShownMotion) -> None:
    """Write the title of a column and the names of the waypoints above its first panel."""
    if len(motion.times):
        _name_waypoints(axes, motion)
    if axes.get_title(loc="right"):  # above the note
        above: Any = ("axes fraction", axes._right_title)  # type: ignore[attr-defined]
        look: dict[str, Any] = {"ha": "center", "va": "bottom", "weight": "bold"}
        axes.annotate(column, (0.5, 1.2), xycoords=above, fontsize=NORMAL, **look)
    else:
        axes.set_title(column, fontsize=NORMAL, weight="bold")


def _name_waypoints(axes: Axes, motion: ShownMotion) -> None:
    """Write the names of the waypoints above a panel; only some of them if there are too many."""
    figure: Any = axes.figure
    x = axes.transData.transform([(time, 0.0) for time in motion.times])[:, 0] * 72 / figure.dpi
    names = shorten_names(motion.names, NAME_LETTERS)
    for i in motion.joints.rest_intervals:
        names[i + 1] = ""  # a wait has one name, at its start
    widths = LETTER_WIDTH * SMALL * np.array([len(name) + 1 for name in names])
    level = bool(np.all(np.diff(x) >= 0.5 * (widths[1:] + widths[:-1])))
    shown = [0]
    for i in range(1, len(x)):
        if level or x[i] - x[shown[-1]] >= 1.3 * SMALL:
            shown.append(i)
    above = axes.secondary_xaxis("top")
    above.set_xticks(motion.times[shown], [names[i] for i in shown], fontsize=SMALL, color=DARK)
    above.tick_params(length=0, rotation=0 if level else 90)
    above.spines["top"].set_visible(False)


def _add_curve_legend(
    figure: Figure, curves: Sequence[str], title: str, motions: Sequence[ShownMotion]
) -> None:
    """Put the title above the panels, and below it the names of the curves.

    If the curves are motions, the failure of each follows its name, in red.
    """
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour(i), ls=dashes(i), lw=2.0) for i in range(len(curves))]
    texts = shorten_names(curves, CURVE_LETTERS)
    failures = [motion.failure_text for motion in motions] if len(motions) > 1 else []
    for i, failure in enumerate(failures):
        reason = textwrap.shorten(printable(failure), REASON_LETTERS, placeholder=" …")
        texts[i] += f": {reason}" if reason else ""
    legend = _add_legend(figure, handles, texts, "upper", title)
    for text, failure in zip(legend.get_texts(), failures, strict=False):
        if failure:
            text.set_color(WRONG)


def _add_mark_legend(figure: Figure, motion: ShownMotion) -> None:
    """Explain the marks of the panels below them, and name the events."""
    from matplotlib.lines import Line2D

    artists = [
        artist for axes in figure.axes for artist in (*axes.lines, *axes.collections, *axes.patches)
    ]
    drawn = {str(artist.get_gid()).partition(":")[0] for artist in artists}
    handles = [Line2D([], [], **look) for kind, look in MARK_LOOKS.items() if kind in drawn]
    events = ", ".join(dict.fromkeys(event.text for event in motion.trajectory.events))
    title = textwrap.shorten(f"events: {events}", REASON_LETTERS, placeholder=" …")
    names = [str(handle.get_label()) for handle in handles]
    if handles:
        _add_legend(figure, handles, names, "lower", title if "event" in drawn else "")


def _add_legend(
    figure: Figure, handles: Sequence[Any], names: Sequence[str], side: str, title: str
) -> Legend:
    """Put a legend above or below the panels, in as many columns as fit."""
    size = NORMAL if side == "upper" else SMALL
    longest = max(map(len, names), default=1)
    width = 72.0 * figure.get_figwidth() / (LETTER_WIDTH * size * (longest + 6))
    outside: Any = f"outside {side} center"
    legend = figure.legend(
        handles,
        list(map(str, range(len(names)))),  # a name with an underscore first would be left out
        loc=outside,
        ncols=max(1, min(len(names), int(width))),
        frameon=False,
        fontsize=size,
        title=printable(title) or None,
        title_fontsize=LARGE if side == "upper" else SMALL,
        handlelength=2.8,
        columnspacing=1.6,
        borderaxespad=0.3,
    )
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(name)
    return legend
