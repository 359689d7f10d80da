"""Above and below the panels: names of waypoints, titles of columns, legends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.view.motions import Marks, Motion
from knotwork.view.panel import Panel
from knotwork.view.panels import make_room
from knotwork.view.style import (
    DARK,
    FAINT,
    LARGE,
    LIMIT_DASHES,
    NORMAL,
    SMALL,
    WRONG,
    colour,
    dashes,
    printable,
    shortened,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

MOST_LETTERS, MOST_LEGEND_LETTERS, MOST_TITLE_LETTERS = 16, 26, 50
# Free room between names, in points.
GAP = 4.0
# With more waypoints, names that can't fit are not even tried.
MOST_NAMES = 200
MARGIN = 0.012
# Least height of a panel in inches, three quarters of it where there are many rows.
LEAST_HEIGHT, MANY_ROWS = 1.7, 4


def frame_times(
    tops: Sequence[Axes],
    bottoms: Sequence[Axes],
    motions: Sequence[Motion],
    titles: Sequence[str] = (),
) -> None:
    """Set the range of times; write names of waypoints and titles above the columns of panels.

    All else must have been drawn: what fits above the panels depends on their width.

    Args:
        tops: The first panel of each column.
        bottoms: The last panel of each column.
        motions: What is drawn; the first one's waypoints are named.
        titles: Titles of the columns, if any.
    """
    start = min(float(motion.curve.x[0]) for motion in motions)
    end = max(float(motion.curve.x[-1]) for motion in motions)
    marks = motions[0].marks
    if marks is not None:
        start, end = min(start, float(marks.time[0])), max(end, float(marks.time[-1]))
    room = MARGIN * (end - start)
    for top, bottom in zip(tops, bottoms, strict=True):
        top.set_xlim(start - room, end + room)
        bottom.set_xlabel("time [s]")
    figure: Any = tops[0].figure
    figure.draw_without_rendering()
    for column, top in enumerate(tops):
        written = name_waypoints(top, marks) if marks is not None else []
        if titles:
            title_column(top, shortened([titles[column]], MOST_LEGEND_LETTERS)[0], written)


def picture_title(motions: Sequence[Motion], default: str) -> str:
    """Scenario, planner if there is but one, and whether the check failed."""
    first = motions[0]
    name = first.scenario.name if first.scenario is not None else ""
    (name,) = shortened([name], MOST_TITLE_LETTERS)
    parts = [part for part in (name, first.label if len(motions) == 1 else "") if part]
    failed = [motion.label for motion in motions if motion.ok is False]
    if failed:
        which = "" if len(motions) == 1 else f" of {', '.join(failed)}"
        parts.append(f"check{which} FAILED")
    return " · ".join(parts) or default


def curve_legend(figure: Figure, curves: Mapping[str, tuple[int, int]], title: str) -> None:
    """Put the title above the panels and below it which curve is which.

    Args:
        figure: Where.
        curves: Number of the colour and of the line style of each, by name.
        title: Title of the picture.
    """
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour(shade), ls=dashes(style), lw=2.0)
        for shade, style in curves.values()
    ]
    add_legend(figure, handles, shortened(list(curves), MOST_LEGEND_LETTERS), "upper", title)


def name_waypoints(axis: Axes, marks: Marks) -> list[Text]:
    """Write the waypoints' names above a panel; where they are too many, some are left out.

    Args:
        axis: The panel, laid out, with its range of times set.
        marks: The waypoints.

    Returns:
        The names written.
    """
    figure: Any = axis.figure
    start, end = axis.get_xlim()
    renderer = figure.canvas.get_renderer()
    points = 72.0 / figure.dpi
    width = axis.get_window_extent(renderer).width * points
    at = (marks.time - start) / (end - start) * width
    names = shortened(marks.names, MOST_LETTERS)
    some = sorted(_thinned(at, SMALL)) if len(at) > MOST_NAMES else range(len(at))
    at = at[list(some)]
    texts = [
        axis.text(
            time,
            1.02,
            name,
            transform=axis.get_xaxis_transform(),
            fontsize=SMALL,
            color=DARK,
            ha="center",
            va="bottom",
            parse_math=False,
            gid="waypoint-name",
        )
        for time, name in ((marks.time[i], names[i]) for i in some)
    ]
    boxes = [text.get_window_extent(renderer) for text in texts]
    widths = np.array([box.width for box in boxes]) * points
    height = max(box.height for box in boxes) * points
    level = np.all(np.diff(at) >= 0.5 * (widths[1:] + widths[:-1]) + GAP)
    if level:
        return texts
    kept = _thinned(at, height + 0.5)
    for i, text in enumerate(texts):
        if i in kept:
            text.set_rotation(90)
        else:
            text.remove()
    return [texts[i] for i in sorted(kept)]


def _thinned(at: np.ndarray[Any, Any], least: float) -> set[int]:
    """Indices of places at least so far apart; the first and the last are kept."""
    last = len(at) - 1
    kept = [0]
    for i in range(1, last):
        if at[i] - at[kept[-1]] >= least and at[last] - at[i] >= least:
            kept.append(i)
    if at[last] - at[kept[-1]] >= least:
        kept.append(last)
    return set(kept)


def title_column(axis: Axes, title: str, names: Sequence[Text]) -> None:
    """Put a title above a panel and above the names of the waypoints there."""
    figure: Any = axis.figure
    renderer = figure.canvas.get_renderer()
    heights = [name.get_window_extent(renderer).height for name in names]
    pad = 6.0 + (max(heights) * 72.0 / figure.dpi + 4.0 if heights else 0.0)
    text = axis.set_title("", fontsize=NORMAL, pad=pad, weight="bold")
    text.set_parse_math(False)
    text.set_text(title)


def add_legend(
    figure: Figure, handles: Sequence[Any], names: Sequence[str], place: str, title: str = ""
) -> None:
    """Put a legend above or below the panels, in as many columns as fit.

    Args:
        figure: Where.
        handles: What is explained.
        names: What it is.
        place: `"upper"` or `"lower"`.
        title: Title of the picture, above the legend.
    """
    from matplotlib.legend_handler import HandlerTuple

    size = NORMAL if place == "upper" else SMALL
    longest = max((len(name) for name in names), default=1)
    room = 72.0 * figure.get_figwidth() - 20.0
    columns = max(1, min(len(names), int(room / (0.58 * size * longest + 3.9 * size))))
    columns = -(-len(names) // -(-len(names) // columns)) if names else 1
    outside: Any = f"outside {place} center"
    # names that start with an underscore or hold a $ would be read as something else
    legend = figure.legend(
        handles,
        [str(i) for i in range(len(names))],
        loc=outside,
        ncols=columns,
        frameon=False,
        fontsize=size,
        title=" " if title else None,
        title_fontsize=LARGE,
        handlelength=2.8,
        handler_map={tuple: HandlerTuple(ndivide=None)},
        columnspacing=1.6,
        borderaxespad=0.3,
    )
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_parse_math(False)
        text.set_text(name)
    if title:
        heading = legend.get_title()
        heading.set_parse_math(False)
        heading.set_text(printable(title))


def explain_marks(figure: Figure, shown: set[str], rows: int) -> None:
    """Explain below the panels what occurs in them.

    Args:
        figure: Where.
        shown: Of `"waypoint"`, `"asked"` (what was asked for there), `"knot"` (a tick),
            `"knot-dot"` (on the curve), `"limit"`, `"jump"` and `"broken"` (beyond a limit).
        rows: Number of motions whose knots are shown in a panel.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[tuple[str, Any, str]] = [
        ("waypoint", Line2D([], [], color=FAINT, lw=1.2), "waypoint"),
        (
            "asked",
            Line2D([], [], ls="", marker="o", mfc="white", mec=DARK, mew=1.3, ms=6),
            "asked for",
        ),
        ("knot", _knot_handle(shown), "knot" if rows == 1 else "knots of each"),
        ("limit", Line2D([], [], color=DARK, ls=LIMIT_DASHES, lw=1.3), "limit"),
        (
            "jump",
            Line2D([], [], color=DARK, ls=(0, (1, 1.5)), marker="o", mfc="white", ms=4, lw=1.2),
            "jump",
        ),
        ("broken", Patch(color=WRONG, alpha=0.6, lw=0), "limit broken"),
        (
            "broken",
            Line2D([], [], ls="", marker="X", mfc=WRONG, mec="white", ms=9),
            "worst",
        ),
    ]
    used = [(handle, name) for kind, handle, name in entries if kind in shown]
    if used:
        add_legend(figure, [one for one, _ in used], [name for _, name in used], "lower")


def _knot_handle(shown: set[str]) -> Any:
    from matplotlib.lines import Line2D

    tick = Line2D([], [], ls="", marker="|", color=DARK, ms=8, mew=1.6)
    if "knot-dot" not in shown:
        return tick
    return (Line2D([], [], ls="", marker="D", color=DARK, ms=4), tick)


def settle(figure: Figure, rows: Sequence[Sequence[Panel]]) -> None:
    """Lay the figure out; let it grow if names and legends left its panels too low for their notes.

    Args:
        figure: All but the notes has been drawn.
        rows: The panels; those of a row keep a common scale if they have one.
    """
    figure.draw_without_rendering()
    box = rows[0][0].axis.get_window_extent()
    width, height = box.width / figure.dpi, box.height / figure.dpi
    least = LEAST_HEIGHT if len(rows) <= MANY_ROWS else 0.75 * LEAST_HEIGHT
    if height < least:
        figure.set_figheight(figure.get_figheight() + len(rows) * (least - height))
        height = least
    for row in rows:
        shared = len({panel.axis.get_ylim() for panel in row}) == 1
        for panel in row:
            make_room(panel, width, height)
        if shared:
            top = max(panel.axis.get_ylim()[1] for panel in row)
            for panel in row:
                panel.axis.set_ylim(top=top)
    freeze(figure)


def freeze(figure: Figure) -> None:
    """Lay the figure out for the last time, so that drawing it again gives the same."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
