"""A picture of a study: verdict and figures over one or two varied values."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import InputError
from knotwork.view.style import (
    DARK,
    GRID,
    LARGE,
    SMALL,
    dress,
    new_figure,
    number,
    printable,
    rounded,
    settings,
    shortened,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PASSED = "passed"
PASSED_COLOUR, OTHER_COLOUR = "#009E73", "#B8B8B8"
# Reasons, most frequent first; distinct in lightness, too. Further ones share one colour.
REASON_COLOURS = ("#D55E00", "#404040", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442", "#0072B2")
LEAST_SPREAD = 1e-3
"""Relative difference below which figures of rows are equal."""
LABEL = 40
"""Number of letters in a line of a label."""
MOST_SHAPES = 5000
"""Largest number of cells or dots drawn one by one in a vector file."""
UNASKED = ("clearance", "smallest_singular_value", "duration", "velocity_use", "path_deviation")
"""Figures of which the first one that differs between rows is drawn by default."""


@dataclass(frozen=True, eq=False)
class _Places:
    """Positions of rows along one direction of a picture.

    Attributes:
        title: The varied value.
        at: Position of each row, shape (n,).
        names: Names of the positions 0, 1, …; empty if values are drawn to scale.
        words: Whether the names are words, not numbers.
    """

    title: str
    at: Any
    names: Sequence[str] = ()
    words: bool = False

    def dress(self, axis: Any) -> None:
        """Label an axis of a panel."""
        from matplotlib.ticker import FuncFormatter, MaxNLocator

        names = self.names
        axis.set_label_text(textwrap.fill(self.title, LABEL))
        if not names:
            return
        axis.set_major_locator(MaxNLocator("auto", integer=True))
        axis.set_major_formatter(
            FuncFormatter(lambda at, _: names[round(at)] if 0 <= round(at) < len(names) else "")
        )
        if self.words and axis.axis_name == "x":
            axis.set_tick_params(rotation=25)


class DrawnStudy:
    """A study prepared for pictures.

    Attributes:
        name: Name of the study.
        kinds: For each row that it passed, or the reason of its failure, shape (n,).
        palette: A colour for passing rows, and for each of the reasons, most frequent first.
        codes: Index of the colour of each row, shape (n,).
        dots: Whether the values vary together, like random samples; otherwise they make a grid.
        varied: Positions of the rows by varied value.
    """

    def __init__(self, study: Any) -> None:
        self._study, self.name = study, str(study.name)
        pairs = zip(study["verdict"], study["reason"], strict=True)
        self.kinds = np.array([one if one == PASSED else why for one, why in pairs], str)
        counts = Counter(self.kinds[self.kinds != PASSED].tolist())
        reasons = [kind for kind, _ in counts.most_common()]
        self.palette = {PASSED: PASSED_COLOUR} | dict.fromkeys(reasons, OTHER_COLOUR)
        self.palette |= dict(zip(reasons, REASON_COLOURS, strict=False))
        self.codes = np.array([[*self.palette].index(kind) for kind in self.kinds], float)
        columns = [column for axis in study.together for column in axis]
        self.dots = len(study.together) == 1
        in_order = len(columns) == 2 and not self.dots
        self.varied = [self._places(column, in_order) for column in columns]

    def _places(self, column: str, in_order: bool) -> _Places:
        values, title = self._study[column], printable(self._study.titles[column])
        if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
            at = np.array(values, float)
            if not in_order:
                return _Places(title, at)
            distinct, at = np.unique(at, return_inverse=True)
            return _Places(title, at.astype(float), [rounded(value, 4) for value in distinct])
        texts = [str(value).lower() if isinstance(value, bool) else str(value) for value in values]
        names = list(dict.fromkeys(texts))
        at = np.array([names.index(name) for name in texts], float)
        return _Places(printable(column), at, shortened(names, 24), words=True)

    @property
    def verdict_look(self) -> dict[str, Any]:
        """Colours of the codes, for Matplotlib."""
        from matplotlib.colors import ListedColormap

        colours = list(self.palette.values())
        return {"cmap": ListedColormap(colours), "vmin": -0.5, "vmax": len(colours) - 0.5}

    def label(self, figure: str) -> str:
        """Title of a figure, with its unit."""
        known = self._study.figures[figure]
        unit = self._study.units.shown(0.0, known.unit)[1]
        return f"{known.title} [{unit}]" if unit else known.title

    def values(self, figure: str) -> Any:
        """A figure by row, NaN for a row without it or a failed one, shape (n,)."""
        factor = self._study.units.shown(1.0, self._study.figures[figure].unit)[0]
        given = np.array(self._study[figure], float)  # None becomes NaN
        return np.where((self.kinds == PASSED) & np.isfinite(given), factor * given, math.nan)


def plot_study(study: Any, figures: Sequence[str] | None = None) -> Figure:
    """Draw the verdict, and figures of the passing rows, over one or two varied values.

    Two make a map: of cells, or of dots if they vary together, like random samples; one makes
    curves.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    >>> study = kw.sweep({"waypoints": lift}, {"waypoints[1].after": "1:2:3"}, workers=0)
    >>> [axes.get_ylabel() for axes in plot_study(study, ["duration"]).axes]
    ['duration [s]']

    Args:
        study: Result of `knotwork.sweep`.
        figures: Names of the figures; by default some that differ between rows.

    Raises:
        InputError: There are no rows, more than two values are varied, or a figure is unknown or in
            none of the rows.
    """
    drawn = DrawnStudy(study)
    if not len(drawn.kinds):
        raise InputError("there are no rows to draw yet")
    if len(drawn.varied) > 2:
        raise InputError(
            f"{len(drawn.varied)} values are varied, and a picture shows one or two; "
            "knotwork view STUDY shows any two of them"
        )
    for name in figures or ():
        if name not in study.figures:
            raise InputError(f"unknown figure {name!r}; accepted: {', '.join(study.figures)}")
        if not np.isfinite(drawn.values(name)).any():
            raise InputError(f"no row that passes has the figure {name!r}")
    if figures is None:
        figures = [name for name in UNASKED if _differ(drawn.values(name))][:1]
    with settings():
        figure = (_draw_map if len(drawn.varied) == 2 else _draw_curves)(drawn, figures)
        _write(drawn, figure)
    return figure


def _write(study: DrawnStudy, figure: Figure) -> None:
    """Write the study's name and the number of passing rows at the top, and the verdicts below."""
    from matplotlib.patches import Patch

    counts = Counter(study.kinds.tolist())
    (name,) = shortened([study.name], LABEL)
    figure.suptitle(f"{name}: {counts[PASSED]} of {len(study.kinds)} rows pass", fontsize=LARGE)
    others = [kind for kind in counts if study.palette[kind] == OTHER_COLOUR]
    shown = {
        f"{printable(kind)} ({counts[kind]})": colour
        for kind, colour in study.palette.items()
        if counts[kind] and kind not in others
    }
    if others:
        count = sum(counts[kind] for kind in others)
        shown[f"{len(others)} other reasons ({count})"] = OTHER_COLOUR
    handles = [Patch(color=colour, label=text) for text, colour in shown.items()]
    columns = 2 if max(map(len, shown)) > LABEL // 2 else 4
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)


def _draw_curves(study: DrawnStudy, names: Sequence[str]) -> Figure:
    """Draw a panel for each figure over one value, with verdicts as dots along its lower edge."""
    (x,), rows = study.varied, max(1, len(names))
    figure = new_figure(rows, 1)
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    order = np.argsort(x.at, kind="stable")
    for i, axis in enumerate(axes):
        dress(axis)
        edge: dict[str, Any] = {"transform": axis.get_xaxis_transform(), "clip_on": False}
        size = min(max(4000 / len(x.at), 6.0), 36.0)
        axis.scatter(x.at, 0.0 * x.at, c=study.codes, s=size, zorder=3, **edge | study.verdict_look)
        if i < len(names):
            # words have no order in which to join them
            style = "o" if x.words else ".-"
            axis.plot(x.at[order], study.values(names[i])[order], style, color=DARK)
            axis.set_ylabel(textwrap.fill(study.label(names[i]), LABEL // 2))
            axis.margins(y=0.12)
        else:
            axis.set_yticks([])
    margin = 0.04 * np.ptp(x.at) or 0.5
    axes[-1].set_xlim(x.at.min() - margin, x.at.max() + margin)
    x.dress(axes[-1].xaxis)
    return figure


def _draw_map(study: DrawnStudy, names: Sequence[str]) -> Figure:
    """Draw verdict and figures side by side over two values."""
    x, y = sorted(study.varied, key=lambda one: one.words)  # names have more space upright
    # a uniform verdict is in the heading
    shown = ["", *names] if not names or len(study.palette) > 1 else list(names)
    figure = new_figure(1, len(shown))
    axes = figure.subplots(1, len(shown), squeeze=False, sharex=True, sharey=True)[0]
    for axis, name in zip(axes, shown, strict=True):
        values = study.values(name) if name else study.codes
        low = np.nanmin(values)
        ranged = {"vmin": low, "vmax": np.nanmax(values), "cmap": "viridis"}
        drawn = _draw(
            axis, x.at, y.at, values, ranged if name else study.verdict_look, dots=study.dots
        )
        x.dress(axis.xaxis)
        y.dress(axis.yaxis)
        axis.label_outer()
        if name:
            ticks = None if _differ(values) else [low]
            bar = figure.colorbar(
                drawn, ax=axis, pad=0.02, ticks=ticks, format=lambda at, _: number(at)
            )
            bar.set_label(textwrap.fill(study.label(name), LABEL))
    return figure


def _draw(axis: Axes, x: Any, y: Any, values: Any, look: dict[str, Any], *, dots: bool) -> Any:
    """Draw a value for each row in colours; rows whose value is NaN are left out."""
    here = np.isfinite(values)
    if not here.any():
        middle: dict[str, Any] = {"transform": axis.transAxes, "ha": "center", "va": "center"}
        axis.text(0.5, 0.5, "no row passes", color=DARK, fontsize=SMALL, zorder=3, **middle)
    raster = len(here) > MOST_SHAPES
    if dots:
        size = min(max(4000 / len(here), 6.0), 36.0)
        look = look | {"edgecolors": DARK, "linewidths": 0.5}  # visible in dark mode, too
        return axis.scatter(x[here], y[here], c=values[here], s=size, rasterized=raster, **look)
    axis.set_facecolor(GRID)
    grid = np.full((int(y.max()) + 1, int(x.max()) + 1), np.nan)
    grid[y.astype(int), x.astype(int)] = values
    rows, columns = map(np.arange, grid.shape)
    return axis.pcolormesh(columns, rows, np.ma.masked_invalid(grid), rasterized=raster, **look)


def _differ(values: Any) -> bool:
    """Whether values of a figure differ by more than rounding; NaN are left out."""
    known = values[np.isfinite(values)]
    return len(known) > 0 and bool(np.ptp(known) > LEAST_SPREAD * np.abs(known).max())
