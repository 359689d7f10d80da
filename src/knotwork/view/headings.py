"""Titles, legends and names around the panels of a picture."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.view.shown_motion import ShownMotion, WaypointValues
from knotwork.view.style import (
    DARK,
    LARGE,
    MARK_LOOKS,
    NORMAL,
    SMALL,
    WRONG,
    colour,
    dashes,
    printable,
    shorten_names,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

NAME_LETTERS, CURVE_LETTERS, TITLE_LETTERS, REASON_LETTERS = 16, 26, 50, 84
"""Maximum numbers of letters of waypoints, curves, titles, and reasons of a failure."""
LETTER_WIDTH = 0.62
"""Width of a letter, as a fraction of the font size."""
TIME_MARGIN = 0.012
"""Margin around the times of a motion, as a fraction of its duration."""
MIN_SPAN = 0.003
"""Minimum drawn duration of a contact, as a fraction of the motion."""
SEGMENTS = ("tool path", "way", "wait")
MIN_HEIGHT, LOW_HEIGHT, MANY_ROWS = 1.5, 1.1, 4
"""Smallest height of a panel [in], of one of more rows than this, and this number of rows."""


def write_around(
    figure: Figure,
    motions: Sequence[ShownMotion],
    title: str,
    curves: Sequence[str],
    *,
    titles: Sequence[str] = ("",),
    grows: bool = True,
) -> None:
    """Mark segments and contacts in drawn panels, and write titles, names and legends around them.

    Args:
        figure: The picture.
        motions: The drawn motions; the waypoints of the first one are named.
        title: Title of the picture.
        curves: Names of the curves, in the order of colours: of motions, if there are several.
        titles: Titles of the columns.
        grows: Let the figure grow if names and legends leave its panels too low.
    """
    columns = len(titles)
    tops = figure.axes[:columns]
    reasons = [motion.failure_text for motion in motions] if len(motions) > 1 else ()
    _add_curve_legend(figure, curves, title, reasons)
    for axes in tops:
        _mark_segments(axes, motions[0])
    for motion in motions:
        _mark_contacts(figure.axes, motion)
    _add_mark_legend(figure, motions[0])
    _set_times(figure.axes, motions)
    for axes in figure.axes[-columns:]:
        axes.set_xlabel("time [s]")
    figure.align_ylabels()
    figure.draw_without_rendering()
    for axes, heading in zip(tops, shorten_names(titles, CURVE_LETTERS), strict=True):
        if motions[0].waypoint_values is not None:
            _name_waypoints(axes, motions[0].waypoint_values)
        if axes.get_title(loc="right"):  # above the note
            above: Any = ("axes fraction", axes._right_title)  # type: ignore[attr-defined]
            look: dict[str, Any] = {"ha": "center", "va": "bottom", "weight": "bold"}
            axes.annotate(heading, (0.5, 1.2), xycoords=above, fontsize=NORMAL, **look)
        else:
            axes.set_title(heading, fontsize=NORMAL, weight="bold")
    rows = len(figure.axes) // columns
    figure.draw_without_rendering()
    height = figure.axes[0].get_window_extent().height / figure.dpi
    missing = (MIN_HEIGHT if rows <= MANY_ROWS else LOW_HEIGHT) - height
    if grows and missing > 0.0:
        figure.set_figheight(figure.get_figheight() + rows * missing)
        figure.draw_without_rendering()
    figure.set_layout_engine("none")  # a second call gives the same result


def picture_title(motions: Sequence[ShownMotion], default: str) -> str:
    """Scenario, planner if there is only one, and a failed check."""
    first = motions[0]
    (name,) = shorten_names([first.scenario.name], TITLE_LETTERS)
    parts = [part for part in (name, first.label if len(motions) == 1 else "") if part]
    failed = [motion.label for motion in motions if motion.failures]
    if failed:
        names = "" if len(motions) == 1 else f" of {', '.join(failed)}"
        parts.append(f"check{names} FAILED")
    return " · ".join(parts) or default


def _set_times(axes: Sequence[Axes], motions: Sequence[ShownMotion]) -> None:
    times = [motion.curve.x for motion in motions]
    times += [] if motions[0].waypoint_values is None else [motions[0].waypoint_values.time]
    start, end = min(float(x[0]) for x in times), max(float(x[-1]) for x in times)
    margin = TIME_MARGIN * (end - start)
    for panel in axes:
        panel.set_xlim(start - margin, end + margin)


def _mark_segments(axes: Axes, motion: ShownMotion) -> None:
    """Mark tool paths, clear motions, waits and events on the upper edge of a panel."""
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


def _name_waypoints(axes: Axes, marks: WaypointValues) -> None:
    """Write the names of the waypoints above a panel; only some of them if there are too many."""
    figure: Any = axes.figure
    x = axes.transData.transform([(time, 0.0) for time in marks.time])[:, 0] * 72 / figure.dpi
    names = shorten_names(marks.names, NAME_LETTERS)
    widths = LETTER_WIDTH * SMALL * np.array([len(name) + 1 for name in names])
    level = bool(np.all(np.diff(x) >= 0.5 * (widths[1:] + widths[:-1])))
    shown = [0]
    for i in range(1, len(x)):
        if level or x[i] - x[shown[-1]] >= 1.3 * SMALL:
            shown.append(i)
    above = axes.secondary_xaxis("top")
    above.set_xticks(marks.time[shown], [names[i] for i in shown], fontsize=SMALL, color=DARK)
    above.tick_params(length=0, rotation=0 if level else 90)
    above.spines["top"].set_visible(False)


def _add_curve_legend(
    figure: Figure, curves: Sequence[str], title: str, reasons: Sequence[str]
) -> None:
    """Put the title above the panels, and below it names of curves; failures in red."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour(i), ls=dashes(i), lw=2.0) for i in range(len(curves))]
    texts = shorten_names(curves, CURVE_LETTERS)
    for i, reason in enumerate(reasons):
        if reason:
            reason = textwrap.shorten(printable(reason), REASON_LETTERS, placeholder=" …")
            texts[i] += f": {reason}"
    legend = _add_legend(figure, handles, texts, "upper", title)
    for text, reason in zip(legend.get_texts(), reasons, strict=False):
        if reason:
            text.set_color(WRONG)


def _add_mark_legend(figure: Figure, motion: ShownMotion) -> None:
    """Explain the marks of the panels below them, and name the events."""
    from matplotlib.lines import Line2D

    artists = [artist for axes in figure.axes for artist in (*axes.lines, *axes.collections)]
    artists += [patch for axes in figure.axes for patch in axes.patches]
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
        [
            str(i) for i in range(len(names))
        ],  # names that start with an underscore would be left out
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
