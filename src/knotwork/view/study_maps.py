"""Maps of a study: a panel of cells or dots for the verdict and each figure, or many of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.view.study_rows import DrawnStudy, Places, combinations, differ, wrapped
from knotwork.view.style import DARK, GRID, NORMAL, SMALL, new_figure, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_DOTS = 5000
"""That are drawn one by one in a file of lines."""
PANEL = 3.0
"""Width of a panel of several [in]."""


def draw_maps(
    study: DrawnStudy,
    x: Places,
    y: Places,
    rest: Sequence[Places],
    names: Sequence[str],
    dots: bool,
) -> Figure:
    """Draw verdict and figures over two of the values that are varied.

    Args:
        study: What is drawn.
        x: Where rows are.
        y: The same.
        rest: What else is varied: each combination of its values has panels of its own.
        names: Of the figures.
        dots: Whether a row is a dot, and not a cell.
    """
    panels = list(combinations(rest, len(x.at), PANEL))
    # a verdict that is everywhere the same is said in the heading
    shown = ["", *names] if not names or len(set(study.kinds)) > 1 else list(names)
    across = len(shown) if len(panels) == 1 else min(len(panels), 3 if len(panels) <= 12 else 4)
    down = -(-len(panels) // across) * (1 if len(panels) == 1 else len(shown))
    figure = new_figure(down, across)
    axes = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
    titles = max(title.count("\n") + 1 for title, _ in panels) if rest else 0
    figure.set_figheight(figure.get_figheight() + 0.15 * titles * down)
    width, height = figure.get_size_inches() / (across, down) - (0.9, 0.8 + 0.15 * titles)
    for block, name in zip(axes.reshape(len(shown), -1), shown, strict=True):
        values = study.values(name) if name else None
        for i, axis in enumerate(block):
            if i >= len(panels):
                axis.set_axis_off()
                continue
            if i + across >= len(panels):
                axis.tick_params("x", labelbottom=True)
                if name == shown[-1] or len(panels) == 1:
                    axis.set_xlabel(wrapped(x.title, PANEL))
            title, rows = panels[i]
            axis.set_title(title, fontsize=SMALL)
            if values is None:
                _draw_verdict(axis, x, y, rows, study, dots)
            else:
                drawn = _draw_figure(axis, x, y, rows, values, dots)
            x.dress(axis.xaxis, width)
            y.dress(axis.yaxis, height)
        if values is not None:
            room = 0.55 * figure.get_figheight() * -(-len(panels) // across) / down
            _scale(figure, list(block), drawn, values, wrapped(study.label(name), room))
    figure.supylabel(wrapped(y.title, 0.6 * figure.get_figheight()), fontsize=NORMAL)
    if "" in shown:
        study.write_legend(figure)
    return figure


def _scale(figure: Figure, block: list[Axes], drawn: Any, values: Any, label: str) -> None:
    """Draw the scale of a figure beside its panels."""
    bar = figure.colorbar(drawn, ax=block, pad=0.02, format=lambda value, _: number(value))
    if not differ(values):
        bar.set_ticks([np.nanmin(values)])
    bar.set_label(label)


def _size(rows: Any) -> float:
    """Of a dot [pt²]: smaller where there are many."""
    return min(max(4000 / max(1, int(np.count_nonzero(rows))), 6.0), 36.0)


def _draw_verdict(
    axis: Axes, x: Places, y: Places, rows: Any, study: DrawnStudy, dots: bool
) -> None:
    for kind, colour in study.palette.items():
        here = rows & (study.kinds == kind)
        if not dots:
            draw_cells(axis, x, y, here, colour)
        elif here.any():
            look: dict[str, Any] = {"color": colour, "s": _size(rows), "linewidths": 0}
            axis.scatter(x.at[here], y.at[here], rasterized=len(rows) > MOST_DOTS, **look)


def draw_cells(axis: Axes, x: Places, y: Places, rows: Any, colour: str) -> None:
    """Fill the cells of rows with a colour; those side by side are one rectangle."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if rows.any():
        outline = Path.make_compound_path(*map(Path, _rectangles(x, y, rows)))
        axis.add_patch(PathPatch(outline, facecolor=colour, edgecolor=colour, linewidth=0.3))
    axis.set(xlim=x.edges[[0, -1]], ylim=y.edges[[0, -1]])


def _rectangles(x: Places, y: Places, rows: Any) -> Iterator[Any]:
    for height, line in enumerate(_grid(x, y, rows, rows, False)):
        ends = np.flatnonzero(np.diff(np.concatenate([[0], line, [0]])))
        low, high = y.edges[height : height + 2]
        for left, right in x.edges[ends.reshape(-1, 2)]:
            yield [(left, low), (right, low), (right, high), (left, high), (left, low)]


def _draw_figure(axis: Axes, x: Places, y: Places, rows: Any, values: Any, dots: bool) -> Any:
    look: dict[str, Any] = {"cmap": "viridis", "vmin": np.nanmin(values), "vmax": np.nanmax(values)}
    if not np.isfinite(values[rows]).any():
        middle: dict[str, Any] = {"transform": axis.transAxes, "ha": "center", "va": "center"}
        axis.text(0.5, 0.5, "no row passes", color=DARK, fontsize=SMALL, zorder=3, **middle)
    if dots:
        look |= {"s": _size(rows), "rasterized": len(rows) > MOST_DOTS}
        look |= {"edgecolors": DARK, "linewidths": 0.5}  # seen in the dark, too
        return axis.scatter(x.at[rows], y.at[rows], c=values[rows], **look)
    axis.set_facecolor(GRID)
    grid = np.ma.masked_invalid(_grid(x, y, rows, values, np.nan))
    return axis.pcolormesh(x.edges, y.edges, grid, rasterized=True, **look)


def _grid(x: Places, y: Places, rows: Any, values: Any, empty: Any) -> Any:
    """Values of rows by their cell."""
    grid = np.full((len(y.values), len(x.values)), empty)
    at = np.searchsorted(y.values, y.at[rows]), np.searchsorted(x.values, x.at[rows])
    grid[at] = values[rows]
    return grid
