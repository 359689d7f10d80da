"""Looking things up in a figure."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.transforms import Bbox

QUANTITIES = ("position", "velocity", "acceleration", "jerk")
"""Of the rows of a picture of joints."""


def lines(axis: Axes, kind: str) -> list[Line2D]:
    """Lines of a kind: `curve`, `jump`, `exceeded`, `asked`, `limit`."""
    return [line for line in axis.lines if str(line.get_gid()).split(":")[0] == kind]


def data(line: Line2D) -> tuple[Any, Any]:
    return np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)


def collections(axis: Axes, kind: str) -> list[Any]:
    return [
        one
        for one in (*axis.collections, *axis.patches)
        if str(one.get_gid()).split(":")[0] == kind
    ]


def notes(figure: Figure) -> list[str]:
    """Notes above panels."""
    return [" ".join(axis.get_title(loc="right").split()) for axis in figure.axes]


def label(axis: Axes) -> str:
    return " ".join(axis.get_ylabel().split())


def waypoint_names(axis: Axes) -> list[Text]:
    return [label for above in axis.child_axes for label in above.get_xticklabels()]


def legend_words(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def heading(figure: Figure) -> str:
    return figure.legends[0].get_title().get_text()


def written(figure: Figure) -> Iterator[tuple[str, Bbox]]:
    """Everything written in a figure with its box in pixels, as it was laid out."""
    figure.draw_without_rendering()  # only so legends place their texts
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    texts: list[Text] = list(figure.texts)
    for axis in figure.axes:
        texts += [
            axis.xaxis.label,
            axis.yaxis.label,
            axis.title,
            axis._right_title,  # type: ignore[attr-defined]
            *axis.texts,
            *waypoint_names(axis),
        ]
        low, high = sorted(axis.get_xlim())
        texts += [
            tick.label1
            for tick in axis.xaxis.get_major_ticks()
            if low <= tick.get_loc() <= high and tick.label1.get_visible()
        ]
        low, high = sorted(axis.get_ylim())
        texts += [
            tick.label1 for tick in axis.yaxis.get_major_ticks() if low <= tick.get_loc() <= high
        ]
    for legend in figure.legends:
        texts += [legend.get_title(), *legend.get_texts()]
    for text in texts:
        if text.get_visible() and text.get_text().strip():
            yield text.get_text(), text.get_window_extent(renderer)


def overlaps(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts whose boxes overlap by more than a pixel."""
    found = []
    for (one, a), (other, b) in combinations(written(figure), 2):
        width = min(a.x1, b.x1) - max(a.x0, b.x0)
        height = min(a.y1, b.y1) - max(a.y0, b.y0)
        if width > 1.0 and height > 1.0:
            found.append((one, other))
    return found


def outside(figure: Figure) -> list[str]:
    """Texts that leave the figure by more than a pixel."""
    width, height = figure.bbox.width, figure.bbox.height
    return [
        text
        for text, box in written(figure)
        if box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1
    ]
