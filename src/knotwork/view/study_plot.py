"""Pictures of a study: verdict and figures over the varied values, as a map or as columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import InputError
from knotwork.view.study_rows import PASSED, DrawnStudy, Places, differ, wrapped
from knotwork.view.style import (
    DARK,
    GRID,
    NORMAL,
    SMALL,
    WIDTH,
    dress,
    new_figure,
    number,
    settings,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_SHAPES = 5000
"""Cells or dots that are drawn one by one in a file of lines."""
STRIP = 0.35
"""Height of the verdict above a curve, as a part of that of a figure's panel."""
COLUMN = 2.8
"""Width of one of several columns [in]."""
UNASKED = ("clearance", "smallest_singular_value", "duration", "velocity_use", "path_deviation")
"""Figures of which the first that differs between rows is drawn unasked."""


def plot_study(study: Any, figures: Sequence[str] | None = None) -> Figure:
    """Draw the verdict, and figures of the rows that pass, over the varied values.

    One varied value makes curves, two make a map: of cells, or of dots where they go together, as
    random samples do. Of more each has a column, with a dot a row.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    >>> study = kw.sweep({"waypoints": lift}, {"waypoints[1].after": "1:2:3"}, workers=0)
    >>> [axes.get_ylabel() for axes in plot_study(study, ["duration"]).axes]
    ['', 'duration [s]']

    Args:
        study: What `knotwork.sweep` returns.
        figures: Names of the figures; by default some that differ between rows.

    Raises:
        InputError: There are no rows, or a figure is unknown or in none of them.
    """
    drawn = DrawnStudy(study)
    if not len(drawn.kinds):
        raise InputError("there are no rows to draw yet")
    for name in figures or ():
        if name not in study.figures:
            raise InputError(f"unknown figure {name!r}; accepted: {', '.join(study.figures)}")
        if not np.isfinite(drawn.values(name)).any():
            raise InputError(f"no row that passes has the figure {name!r}")
    if figures is None:
        figures = [name for name in UNASKED if differ(drawn.values(name))][:1]
    varied = [one for axis in drawn.axes for one in axis]
    with settings():
        figure = (_draw_map if len(varied) == 2 else _draw_columns)(drawn, varied, figures)
        drawn.write_heading(figure)
    return figure


def _draw_columns(study: DrawnStudy, columns: list[Places], names: Sequence[str]) -> Figure:
    """Draw a column for each value: the verdict, and below it a panel for each figure.

    The verdict is a strip of cells over the only value; over several it is dots, those of the rows
    that pass above the others.
    """
    rows = 1 + len(names)
    alone = len(columns) == 1
    figure = new_figure(rows, len(columns))
    figure.set_figwidth(max(WIDTH, COLUMN * len(columns)))
    below = 1.5 if any(x.names is not None for x in columns) else 0.0
    figure.set_figheight(below + (figure.get_figheight() if names or not alone else 2.2))
    ratios = [STRIP if alone else 1.0, *[1.0] * len(names)]
    axes = figure.subplots(
        rows, len(columns), sharex="col", sharey="row", squeeze=False, height_ratios=ratios
    )
    # at random, so that the density of dots shows how many rows pass there
    random = np.random.default_rng(0).random(len(study.kinds))
    rank = np.argsort(np.lexsort((random, study.kinds == PASSED)))
    high = Places("", np.zeros(len(rank)) if alone else rank.astype(float), None)
    height = 0.6 * figure.get_figheight() / rows
    width = 0.8 * figure.get_figwidth() / len(columns)
    for column, x in zip(axes.T, columns, strict=True):
        first, *others = column
        _draw(first, x, high, study.codes, dots=not alone, **study.verdict_look)
        first.set_yticks([])
        order = np.argsort(x.at, kind="stable")
        # only numbers of one value have an order in which to join them
        style = ".-" if alone and x.names is None else "o"
        for axis, name in zip(others, names, strict=True):
            axis.plot(x.at[order], study.values(name)[order], style, color=DARK, markersize=4.0)
            dress(axis)
        x.dress(column[-1].xaxis, width)
        column[-1].set_xlabel(wrapped(x.title, width))
    for axis, name in zip(axes[1:, 0], names, strict=True):
        axis.set_ylabel(wrapped(study.label(name), height))
    study.write_legend(figure)
    return figure


def _draw_map(study: DrawnStudy, varied: list[Places], names: Sequence[str]) -> Figure:
    """Draw verdict and figures side by side over two values."""
    # names have more space upright
    x, y = sorted(varied, key=lambda one: one.names is not None)
    # a verdict that is the same everywhere is in the heading
    shown = ["", *names] if not names or len(set(study.kinds)) > 1 else list(names)
    dots = len(study.axes) == 1
    edges = {"edgecolors": DARK, "linewidths": 0.5} if dots else {}  # seen in the dark, too
    figure = new_figure(1, len(shown))
    axes = figure.subplots(1, len(shown), squeeze=False, sharex=True, sharey=True)[0]
    width, height = figure.get_size_inches() / (len(shown), 1) - (0.9, 0.8)
    for axis, name in zip(axes, shown, strict=True):
        values = study.values(name) if name else study.codes
        low, high = np.nanmin(values), np.nanmax(values)
        look = (
            {"vmin": low, "vmax": high, "cmap": "viridis", **edges} if name else study.verdict_look
        )
        drawn = _draw(axis, x, y, values, dots=dots, **look)
        x.dress(axis.xaxis, width)
        y.dress(axis.yaxis, height)
        axis.set_xlabel(wrapped(x.title, width))
        if name:
            ticks = None if differ(values) else [low]
            bar = figure.colorbar(
                drawn, ax=axis, pad=0.02, ticks=ticks, format=lambda at, _: number(at)
            )
            bar.set_label(wrapped(study.label(name), 0.55 * figure.get_figheight()))
    figure.supylabel(wrapped(y.title, 0.6 * figure.get_figheight()), fontsize=NORMAL)
    if "" in shown:
        study.write_legend(figure)
    return figure


def _draw(axis: Axes, x: Places, y: Places, values: Any, *, dots: bool, **look: Any) -> Any:
    """Draw a value for each row in colours; rows whose value is NaN are left out."""
    here = np.isfinite(values)
    if not here.any():
        middle: dict[str, Any] = {"transform": axis.transAxes, "ha": "center", "va": "center"}
        axis.text(0.5, 0.5, "no row passes", color=DARK, fontsize=SMALL, zorder=3, **middle)
    if dots:
        size = min(max(4000 / len(here), 6.0), 36.0)
        look["rasterized"] = len(here) > MOST_SHAPES
        return axis.scatter(x.at[here], y.at[here], c=values[here], s=size, **look)
    axis.set_facecolor(GRID)
    grid = np.full((len(y.values), len(x.values)), np.nan)
    grid[np.searchsorted(y.values, y.at[here]), np.searchsorted(x.values, x.at[here])] = values[
        here
    ]
    look["rasterized"] = grid.size > MOST_SHAPES
    return axis.pcolormesh(x.edges, y.edges, np.ma.masked_invalid(grid), **look)
