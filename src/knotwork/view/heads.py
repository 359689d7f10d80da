"""Above and below the panels: names of waypoints, titles of columns, legends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.view.motions import Marks, Motion
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
    panel_width,
    printable,
    shortened,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

MOST_LETTERS, MOST_LEGEND_LETTERS = 16, 26
# Free room between names, in points.
GAP = 4.0
MARGIN = 0.012


def frame_times(
    tops: Sequence[Axes],
    bottoms: Sequence[Axes],
    motions: Sequence[Motion],
    titles: Sequence[str] = (),
) -> None:
    """Set the range of times; write names of waypoints and titles above the columns of panels.

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
    for column, (top, bottom) in enumerate(zip(tops, bottoms, strict=True)):
        _set_times(top, start, end)
        written = name_waypoints(top, marks) if marks is not None else []
        if titles:
            title_column(top, shortened([titles[column]], MOST_LEGEND_LETTERS)[0], written)
        bottom.set_xlabel("time [s]")


def picture_title(motions: Sequence[Motion], default: str) -> str:
    """Scenario, planner if there is but one, and whether the check failed."""
    first = motions[0]
    name = first.scenario.name if first.scenario is not None else ""
    parts = [part for part in (name, first.label if len(motions) == 1 else "") if part]
    failed = [motion.label for motion in motions if motion.ok is False]
    if failed:
        which = "" if len(motions) == 1 else f" of {', '.join(failed)}"
        parts.append(f"check{which} FAILED")
    return " · ".join(parts) or default


def motion_legend(figure: Figure, motions: Sequence[Motion], title: str) -> None:
    """Put the title above the panels and, if there are several motions, say which is which."""
    from matplotlib.lines import Line2D

    handles, names = [], []
    if len(motions) > 1:
        names = shortened([motion.label for motion in motions], MOST_LEGEND_LETTERS)
        handles = [
            Line2D([], [], color=colour(i), ls=dashes(i), lw=2.0) for i in range(len(motions))
        ]
    add_legend(figure, handles, names, "upper", title)


def _set_times(axis: Axes, start: float, end: float) -> None:
    """Set the range of times, with a little room at both ends."""
    room = MARGIN * (end - start)
    axis.set_xlim(start - room, end + room)


def name_waypoints(axis: Axes, marks: Marks) -> list[Text]:
    """Write the waypoints' names above a panel; where they are too many, some are left out.

    Args:
        axis: The panel; its range of times has been set.
        marks: The waypoints.

    Returns:
        The names written.
    """
    figure: Any = axis.figure
    start, end = axis.get_xlim()
    width = panel_width(axis)
    at = (marks.time - start) / (end - start) * width
    names = shortened(marks.names, MOST_LETTERS)
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
        for time, name in zip(marks.time, names, strict=True)
    ]
    renderer = figure.canvas.get_renderer()
    boxes = [text.get_window_extent(renderer) for text in texts]
    widths = np.array([box.width for box in boxes]) * 72.0 / figure.dpi
    height = max(box.height for box in boxes) * 72.0 / figure.dpi
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
