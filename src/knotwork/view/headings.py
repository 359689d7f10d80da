"""Headings and legends of panels: names of waypoints, titles of columns, legends."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.view.drawn_motions import Marks, Motion
from knotwork.view.style import (
    DARK,
    LARGE,
    LOOKS,
    NORMAL,
    SMALL,
    WRONG,
    colour,
    dashes,
    least_height,
    printable,
    shortened,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

MOST_LETTERS, MOST_LEGEND_LETTERS, MOST_TITLE_LETTERS, MOST_REASON_LETTERS = 16, 26, 50, 84
# Gap between names, in points; width of letters, as a fraction of the font size.
GAP, LETTER, LINE = 4.0, 0.65, 1.3
MARGIN = 0.012
# Steps between numbers beside a panel, where it is high enough.
MOST_NUMBERS = 5
# Shortest drawn contact, as a fraction of the motion.
LEAST_SPAN = 0.003
SEGMENTS = ("tool path", "way", "wait")


def head_and_foot(
    figure: Figure,
    motions: Sequence[Motion],
    title: str,
    curves: Sequence[str],
    *,
    columns: int = 1,
    titles: Sequence[str] = (),
    overlaid: bool = False,
    apart: bool = False,
    grows: bool = True,
) -> None:
    """Write everything around drawn panels, and common marks.

    Args:
        figure: The picture.
        motions: The drawn motions.
        title: Title of the picture.
        curves: Names of the curves, in the order of colours.
        columns: Number of panels next to each other.
        titles: Titles of the columns, if any.
        overlaid: The curves are motions, whose failures are named.
        apart: Each motion has its own column.
        grows: As for `settle`.
    """
    curve_legend(figure, curves, title, [one.reason for one in motions] if overlaid else ())
    mark_segments(figure.axes[:columns], motions[0])
    for i, one in enumerate(motions):
        mark_contacts(figure.axes[i :: len(motions)] if apart else figure.axes, one)
    explain_marks(figure, len(motions) if overlaid else 1)
    frame_times(figure.axes[:columns], figure.axes[-columns:], motions, titles)
    settle(figure, len(figure.axes) // columns, grows=grows)


def frame_times(
    tops: Sequence[Axes],
    bottoms: Sequence[Axes],
    motions: Sequence[Motion],
    titles: Sequence[str] = (),
) -> None:
    """Set the range of times; write names of waypoints and titles above the columns of panels.

    Everything else must have been drawn: the space above the panels depends on their width.

    Args:
        tops: The first panel of each column.
        bottoms: The last panel of each column.
        motions: The drawn motions; the waypoints of the first one are named.
        titles: Titles of the columns, if any.
    """
    start = min(float(motion.curve.x[0]) for motion in motions)
    end = max(float(motion.curve.x[-1]) for motion in motions)
    marks = motions[0].marks
    if marks is not None:
        start, end = min(start, float(marks.time[0])), max(end, float(marks.time[-1]))
    margin = MARGIN * (end - start)
    for top, bottom in zip(tops, bottoms, strict=True):
        top.set_xlim(start - margin, end + margin)
        bottom.set_xlabel("time [s]")
    figure: Any = tops[0].figure
    figure.draw_without_rendering()
    for top in tops:
        if marks is not None:
            name_waypoints(top, marks)
    for top, title in zip(tops, titles, strict=False):
        (short,) = shortened([title], MOST_LEGEND_LETTERS)
        top.set_title(short, fontsize=NORMAL, weight="bold")


def mark_segments(tops: Sequence[Axes], motion: Motion) -> None:
    """Mark tool paths, clear motions, waits and events on the upper edge of the first panels."""
    start, end = float(motion.curve.x[0]), float(motion.curve.x[-1])
    events = [one for one in motion.trajectory.events if start <= one.time <= end]
    switched = ", ".join(dict.fromkeys(one.said for one in events))
    marked = {"event": [one.time for one in events]}
    for kind in SEGMENTS:
        spans = (
            (max(one.start, start), min(one.end, end), np.nan)
            for one in motion.trajectory.segments
            if one.kind == kind and one.end > start and one.start < end
        )
        marked[kind] = [time for span in spans for time in span]
    for top in tops:
        upright: dict[str, Any] = {"transform": top.get_xaxis_transform(), "clip_on": False}
        for kind, times in marked.items():
            if times:
                gid = f"event:{switched}" if kind == "event" else kind
                top.plot(times, [1.0] * len(times), gid=gid, **LOOKS[kind], **upright)


def mark_contacts(axes: Sequence[Axes], motion: Motion) -> None:
    """Mark contacts of bodies over the whole height of panels."""
    low, high = (float(at) for at in motion.curve.x[[0, -1]])
    least = 0.5 * LEAST_SPAN * (high - low)
    look: dict[str, Any] = LOOKS["contact"] | {"lw": 0.0}
    shown = [one for one in motion.contacts if one[0] <= high and one[1] >= low]
    for axis, (start, end) in product(axes, shown):
        span = [max(start - least, low), min(end + least, high)]
        upright = axis.get_xaxis_transform()
        axis.fill_between(span, 0.0, 1.0, transform=upright, gid="contact", **look)
        for text in axis.texts:
            if text.get_gid() == "note":
                text.set_bbox(None)  # it would break the mark off


def picture_title(motions: Sequence[Motion], default: str) -> str:
    """Scenario, planner if there is only one, and a failed check."""
    first = motions[0]
    (name,) = shortened([first.scenario.name], MOST_TITLE_LETTERS)
    parts = [part for part in (name, first.label if len(motions) == 1 else "") if part]
    failed = [motion.label for motion in motions if motion.ok is False]
    if failed:
        which = "" if len(motions) == 1 else f" of {', '.join(failed)}"
        parts.append(f"check{which} FAILED")
    return " · ".join(parts) or default


def curve_legend(
    figure: Figure, curves: Sequence[str], title: str, reasons: Sequence[str] = ()
) -> None:
    """Put the title above the panels, and below it names of curves, in the order of colours.

    Args:
        figure: The picture.
        curves: The names.
        title: Title of the picture.
        reasons: Reason of each curve's failure, or an empty text; a reason is red.
    """
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour(i), ls=dashes(i), lw=2.0) for i in range(len(curves))]
    names = shortened(curves, MOST_LEGEND_LETTERS)
    reason_texts = [
        textwrap.shorten(printable(one), MOST_REASON_LETTERS, placeholder=" …") for one in reasons
    ] or [""] * len(names)
    words = [
        f"{name}: {why}" if why else name for name, why in zip(names, reason_texts, strict=True)
    ]
    legend = add_legend(figure, handles, words, "upper", title)
    for text, why in zip(legend.get_texts(), reason_texts, strict=True):
        if why:
            text.set_color(WRONG)


def name_waypoints(axis: Axes, marks: Marks) -> None:
    """Write the waypoints' names above a panel; some are left out if there are too many.

    Args:
        axis: The panel, laid out, with its range of times set.
        marks: The waypoints.
    """
    figure: Any = axis.figure
    at = axis.transData.transform([(time, 0.0) for time in marks.time])[:, 0] * 72.0 / figure.dpi
    names = shortened(marks.names, MOST_LETTERS)
    widths = LETTER * SMALL * np.array([len(name) for name in names])
    level = np.all(np.diff(at) >= 0.5 * (widths[1:] + widths[:-1]) + GAP)
    kept = range(len(at)) if level else _thinned(at, LINE * SMALL)
    above = axis.secondary_xaxis("top")
    above.set_xticks(marks.time[kept], [names[i] for i in kept], fontsize=SMALL, color=DARK)
    above.tick_params(length=0, rotation=0 if level else 90)
    above.spines["top"].set_visible(False)


def _thinned(at: np.ndarray[Any, Any], least: float) -> list[int]:
    """Indices of positions at least this far apart, with the first and the last one."""
    last = len(at) - 1
    kept = [0]
    for i in range(1, last):
        if at[i] - at[kept[-1]] >= least and at[last] - at[i] >= least:
            kept.append(i)
    if at[last] - at[kept[-1]] >= least:
        kept.append(last)
    return kept


def add_legend(
    figure: Figure, handles: Sequence[Any], names: Sequence[str], place: str, title: str = ""
) -> Legend:
    """Put a legend above or below the panels, in as many columns as fit.

    Args:
        figure: The picture.
        handles: Marks to explain.
        names: Their names.
        place: `"upper"` or `"lower"`.
        title: Title of the legend.
    """
    size = NORMAL if place == "upper" else SMALL
    longest = max((len(name) for name in names), default=1)
    width = 72.0 * figure.get_figwidth() - 20.0
    columns = max(1, min(len(names), int(width / (0.58 * size * longest + 3.9 * size))))
    columns = -(-len(names) // -(-len(names) // columns)) if names else 1
    outside: Any = f"outside {place} center"
    # names that start with an underscore would be left out
    legend = figure.legend(
        handles,
        [str(i) for i in range(len(names))],
        loc=outside,
        ncols=columns,
        frameon=False,
        fontsize=size,
        title=printable(title) or None,
        title_fontsize=LARGE if place == "upper" else SMALL,
        handlelength=2.8,
        columnspacing=1.6,
        borderaxespad=0.3,
    )
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(name)
    return legend


def explain_marks(figure: Figure, rows: int = 1) -> None:
    """Explain the marks of the panels below them.

    Args:
        figure: The picture, with everything drawn.
        rows: Number of motions whose knots are shown in a panel.
    """
    from matplotlib.lines import Line2D

    artists = [one for axis in figure.axes for one in (*axis.lines, *axis.collections)]
    marks = dict(str(one.get_gid()).partition(":")[::2] for one in artists)
    shown = set(marks)
    words = {
        "waypoint": "waypoint",
        "asked": "given",
        "knots": "knot" if rows == 1 else "knots of each",
        "limit": "limit",
        "band": "given speed along the path",
        "tolerance": "tolerance",
        "jump": "jump",
        "broken": "limit exceeded",
        "beyond": "beyond the tolerance",
        "worst": "worst",
        "contact": "collision",
        **{kind: kind for kind in (*SEGMENTS, "event")},
    }
    handles: dict[str, Any] = {kind: Line2D([], [], **LOOKS[kind]) for kind in words}
    handles["jump"].set_marker("o")
    used = [kind for kind in words if kind in shown]
    events = textwrap.shorten(marks.get("event", ""), MOST_REASON_LETTERS, placeholder=" …")
    title = f"events: {events}" if events else ""
    if used:
        names = [words[one] for one in used]
        add_legend(figure, [handles[one] for one in used], names, "lower", title)


def settle(figure: Figure, rows: int, *, grows: bool = True) -> None:
    """Lay the figure out for the last time, so that drawing it again gives the same result.

    If permitted, it grows if names and legends left its rows of panels too low.
    """
    figure.draw_without_rendering()
    height, least = figure.axes[0].get_window_extent().height / figure.dpi, least_height(rows)
    if grows and height < least:
        figure.set_figheight(figure.get_figheight() + rows * (least - height))
        figure.draw_without_rendering()
    for axis in figure.axes:
        _thin_numbers(axis, axis.get_window_extent().height * 72.0 / figure.dpi)
    figure.set_layout_engine("none")


def _thin_numbers(axis: Axes, height: float) -> None:
    """Leave as many numbers beside a panel of a height, in points, as can be read."""
    from matplotlib.ticker import MaxNLocator

    sizes = [float(label.get_fontsize()) for label in axis.get_yticklabels()]
    most = int(height / (1.5 * max(sizes, default=SMALL)))
    if isinstance(axis.yaxis.get_major_locator(), MaxNLocator) and most < MOST_NUMBERS:
        axis.yaxis.set_major_locator(MaxNLocator(max(most, 1)))
