"""Maps of a study: the verdict and figures of its rows over what is varied."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from knotwork.errors import InputError
from knotwork.view.style import DARK, dress, new_figure, printable, settings, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS = 24
"""Of small multiples; more columns than these have room for are drawn as parallel coordinates."""
MOST_LINES = 2000
"""Of parallel coordinates; of more rows so many, evenly spread, are drawn."""
MOST_REASONS = 7
PASSED_COLOUR, OTHER_COLOUR = "#009E73", "#B8B8B8"
# Reasons, most frequent first; told apart by lightness, too.
REASON_COLOURS = ("#D55E00", "#404040", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442", "#0072B2")
PASSED = "passed"


class FigureColumn(Protocol):
    """What a column of figures is: `knotwork.sweeps.RowFigure`."""

    @property
    def title(self) -> str:
        """In words."""

    @property
    def unit(self) -> str:
        """SI unit."""


class Rows(Protocol):
    """What is drawn: `knotwork.Study`."""

    @property
    def name(self) -> str:
        """Name of the scenario."""

    @property
    def varied(self) -> tuple[str, ...]:
        """Columns of what is varied."""

    @property
    def figures(self) -> Mapping[str, FigureColumn]:
        """What is known of each figure."""

    def __getitem__(self, column: str) -> list[Any]:
        """Values of a column."""


@dataclass(frozen=True)
class _Places:
    """Where rows are along one axis of a map.

    Attributes:
        title: What is varied.
        at: Place of each row, shape (n,).
        values: The places that there are, in order.
        names: Of the places, where values are no numbers.
    """

    title: str
    at: Any
    values: Any
    names: list[str] | None

    def dress(self, axis: Any) -> None:
        """Label an axis of a panel."""
        if self.names is not None:
            axis.set_ticks(range(len(self.names)), self.names)


def plot_study(study: Rows, figures: Sequence[str] | None = None) -> Figure:
    """Draw the verdict, and figures of the rows that pass, over what is varied.

    One varied value makes curves, two make maps, and more a map for each combination of the others,
    or where these are too many parallel coordinates. Values that differ in every row, as random
    ones do, make dots.

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
    verdict = _kinds(study)
    if not verdict:
        raise InputError("there are no rows to draw yet")
    names = _chosen(study, figures)
    with settings():
        return _drawn(study, names)


def _kinds(study: Rows) -> list[str]:
    """For each row that it passed, or why it did not."""
    pairs = zip(study["verdict"], study["reason"], strict=True)
    return [verdict if verdict == PASSED else reason for verdict, reason in pairs]


def _chosen(study: Rows, figures: Sequence[str] | None) -> list[str]:
    if figures is not None:
        for name in figures:
            if name not in study.figures:
                known = ", ".join(study.figures)
                raise InputError(f"unknown figure {name!r}; accepted: {known}")
            if not _passing(study, name):
                raise InputError(f"no row that passes has the figure {name!r}")
        return list(figures)
    wanted = ("clearance", "smallest_singular_value", "duration", "velocity_use", "path_deviation")
    return [name for name in wanted if len(set(_passing(study, name))) > 1][:1]


def _passing(study: Rows, name: str) -> list[float]:
    pairs = zip(study[name], study["verdict"], strict=True)
    return [
        value
        for value, verdict in pairs
        if verdict == PASSED and value is not None and math.isfinite(value)
    ]


def _figure_values(study: Rows, name: str) -> Any:
    """A figure by row, NaN where a row does not pass or does not have it, shape (n,)."""
    pairs = zip(study[name], study["verdict"], strict=True)
    values = [math.nan if v is None or verdict != PASSED else v for v, verdict in pairs]
    return np.where(np.isfinite(values), values, np.nan)


def _places(study: Rows, column: str) -> _Places:
    values = study[column]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        at = np.array(values, float)
        return _Places(column, at, np.unique(at), None)
    names = list(dict.fromkeys(str(value) for value in values))
    order = {name: i for i, name in enumerate(names)}
    at = np.array([order[str(value)] for value in values], float)
    return _Places(column, at, np.arange(len(names), dtype=float), shortened(names, 24))


def _drawn(study: Rows, names: list[str]) -> Figure:
    places = [_places(study, column) for column in study.varied]
    # Two numbers with the most values make the map, the others its panels.
    order = sorted(places, key=lambda one: (one.names is not None, -len(one.values)))
    across = sorted(order[:2], key=places.index)
    rest = [one for one in places if one not in across]
    panels = list(_combinations(rest, len(places[0].at)))
    if len(panels) > MOST_PANELS:
        figure = _parallel(study, places, names)
    elif len(across) == 1:
        figure = _curves(study, across[0], names)
    else:
        figure = _maps(study, across[0], across[1], panels, names)
    figure.suptitle(_heading(study))
    return figure


def _heading(study: Rows) -> str:
    kinds = _kinds(study)
    return f"{printable(study.name)}: {kinds.count(PASSED)} of {len(kinds)} rows pass"


def _combinations(rest: Sequence[_Places], count: int) -> Iterator[tuple[str, Any]]:
    """A title and the rows of each combination of values, all rows if there are none."""
    if not rest:
        yield "", np.ones(count, bool)
        return
    keys = np.stack([one.at for one in rest], axis=1)
    for key in np.unique(keys, axis=0):
        parts = [
            f"{one.title} = {one.names[int(v)] if one.names is not None else f'{v:g}'}"
            for one, v in zip(rest, key, strict=True)
        ]
        yield printable("\n".join(parts)), (keys == key).all(axis=1)


def _palette(study: Rows) -> dict[str, str]:
    """A colour for rows that pass, and for each of the reasons."""
    kinds = _kinds(study)
    reasons = sorted(set(kinds) - {PASSED}, key=lambda kind: (-kinds.count(kind), kind))
    colours = dict(zip(reasons[:MOST_REASONS], REASON_COLOURS, strict=False))
    colours |= dict.fromkeys(reasons[MOST_REASONS:], OTHER_COLOUR)
    return {PASSED: PASSED_COLOUR, **colours}


def _legend(figure: Figure, study: Rows) -> None:
    from matplotlib.patches import Patch

    kinds, palette = _kinds(study), _palette(study)
    shown = [
        Patch(color=colour, label=f"{printable(kind)} ({kinds.count(kind)})")
        for kind, colour in palette.items()
        if kind in kinds
    ]
    figure.legend(handles=shown, loc="outside lower center", ncols=4, frameon=False)


def _maps(
    study: Rows, x: _Places, y: _Places, panels: list[tuple[str, Any]], names: list[str]
) -> Figure:
    columns = 1 + len(names) if names else min(3, len(panels))
    cells = [(title, rows, name) for title, rows in panels for name in ("", *names)]
    lines = -(-len(cells) // columns)
    figure = new_figure(lines, columns)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).ravel()
    kinds, palette = np.array(_kinds(study)), _palette(study)
    for axis, (title, rows, name) in zip(axes, cells, strict=False):
        if not name:
            _verdict_map(axis, x, y, rows, kinds, palette)
            axis.set_title(title, fontsize="medium")
        else:
            drawn = _figure_map(axis, x, y, rows, study, name)
            figure.colorbar(drawn, ax=axis, label=_label(study, name))
        for one, way in ((x, axis.xaxis), (y, axis.yaxis)):
            one.dress(way)
        if axis.get_subplotspec().is_last_row():
            axis.set_xlabel(printable(x.title))
        if axis.get_subplotspec().is_first_col():
            axis.set_ylabel(printable(y.title))
    for axis in axes[len(cells) :]:
        axis.set_axis_off()
    _legend(figure, study)
    return figure


def _label(study: Rows, name: str) -> str:
    known = study.figures[name]
    return f"{known.title} [{known.unit}]" if known.unit else known.title


def _verdict_map(
    axis: Axes, x: _Places, y: _Places, rows: Any, kinds: Any, palette: Mapping[str, str]
) -> None:
    from matplotlib.colors import ListedColormap

    index = {kind: i for i, kind in enumerate(palette)}
    values = np.array([index[kind] for kind in kinds], float)
    look = {"cmap": ListedColormap(list(palette.values())), "vmin": -0.5}
    _coloured(axis, x, y, rows, values, {**look, "vmax": len(palette) - 0.5})


def _figure_map(axis: Axes, x: _Places, y: _Places, rows: Any, study: Rows, name: str) -> Any:
    values = _figure_values(study, name)
    known = values[np.isfinite(values)]
    look = {"cmap": "viridis", "vmin": known.min(), "vmax": known.max()}
    axis.set_facecolor("#E4E4E4")
    return _coloured(axis, x, y, rows, values, look)


def _coloured(
    axis: Axes, x: _Places, y: _Places, rows: Any, values: Any, look: Mapping[str, Any]
) -> Any:
    """Cells of a grid, or dots where the rows are on none."""
    wide, high = len(x.values), len(y.values)
    if wide * high > 4 * len(x.at[rows]) + 16:
        return axis.scatter(x.at[rows], y.at[rows], c=values[rows], s=14, **look)
    grid = np.full((high, wide), np.nan)
    place = np.searchsorted(y.values, y.at[rows]), np.searchsorted(x.values, x.at[rows])
    grid[place] = values[rows]
    return axis.pcolormesh(
        _edges(x.values), _edges(y.values), np.ma.masked_invalid(grid), rasterized=True, **look
    )


def _edges(values: Any) -> Any:
    """Edges of the cells around values."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def _curves(study: Rows, x: _Places, names: list[str]) -> Figure:
    figure = new_figure(1 + len(names), 1)
    ratios = [0.35, *[1.0] * len(names)]
    axes = figure.subplots(1 + len(names), 1, sharex=True, squeeze=False, height_ratios=ratios)
    kinds, palette = np.array(_kinds(study)), _palette(study)
    first, *others = axes[:, 0]
    line = _Places("", np.zeros(len(x.at)), np.zeros(1), None)
    _verdict_map(first, x, line, np.ones(len(x.at), bool), kinds, palette)
    first.set_yticks([])
    order = np.argsort(x.at, kind="stable")
    for axis, name in zip(others, names, strict=True):
        axis.plot(x.at[order], _figure_values(study, name)[order], ".-", color=DARK)
        axis.set_ylabel(_label(study, name))
        dress(axis)
    axes[-1, 0].set_xlabel(printable(x.title))
    x.dress(axes[-1, 0].xaxis)
    _legend(figure, study)
    return figure


def _parallel(study: Rows, places: Sequence[_Places], names: list[str]) -> Figure:
    """A line a row across upright axes: what is varied, then figures."""
    figures = [_Places(_label(study, one), _figure_values(study, one), None, None) for one in names]
    scales = [*places, *figures]
    kinds, palette = _kinds(study), _palette(study)
    figure = new_figure(2, 1)
    axis = figure.subplots()
    heights = []
    for i, one in enumerate(scales):
        at, own = one.at, one.names
        low, high = np.nanmin(at), np.nanmax(at)
        heights.append(np.zeros(len(at)) + 0.5 if low == high else (at - low) / (high - low))
        marks = [(low, 0.0), (high, 1.0)] if low != high else [(low, 0.5)]
        axis.axvline(i, color=DARK, linewidth=1.0)
        for value, height in marks:
            text = own[int(value)] if own is not None else f"{value:g}"
            axis.annotate(text, (i, height), (4, 0), "data", "offset points", va="center")
    lines = np.stack(heights, axis=1)
    chosen = np.unique(np.linspace(0, len(lines) - 1, min(len(lines), MOST_LINES)).astype(int))
    for i in sorted(chosen, key=lambda k: kinds[k] == PASSED):
        axis.plot(lines[i], color=palette[kinds[i]], linewidth=0.7, alpha=0.5)
    axis.set_xticks(range(len(scales)), [printable(one.title) for one in scales])
    axis.tick_params("x", rotation=20)
    axis.set_yticks([])
    axis.spines[:].set_visible(False)
    _legend(figure, study)
    return figure
