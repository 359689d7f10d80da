"""A picture of a study: verdict and figures over one or two varied values."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import InputError
from knotwork.view.panel import dress, new_axes, new_figure
from knotwork.view.style import DARK, GRID, LARGE, number, printable, settings, shorten_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from knotwork.waypoints import FloatArray

PASSED_ROW = "passed"
PASSED_COLOUR, OTHER_COLOUR = "#009E73", "#B8B8B8"
# Reasons, most frequent first; distinct in lightness, too. Further ones share one colour.
REASON_COLOURS = ("#D55E00", "#404040", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442", "#0072B2")
EQUAL_FIGURES = 1e-3
"""Relative difference below which figures of rows are equal."""
STUDY_LABEL_LETTERS = 40
"""Number of letters in a line of a title."""
MOST_DOTS = 1000
"""Largest number of dots drawn one by one in a vector file."""
DEFAULT_FIGURES = [
    "clearance",
    "smallest_singular_value",
    "duration",
    "velocity_use",
    "path_deviation",
]
"""Figures of which the first one that differs between rows is drawn by default."""


@dataclass(frozen=True, eq=False)
class VariedValue:
    """A varied value of a study.

    Attributes:
        title: Its title.
        at: Value of each row, or for words the index of its name, shape (n,).
        names: The words; empty for numbers.
    """

    title: str
    at: FloatArray
    names: Sequence[str] = ()


class DrawnStudy:
    """A study prepared for pictures.

    Attributes:
        name: Name of the study.
        kinds: For each row that it passed, or the reason of its failure, shape (n,).
        palette: A colour for passing rows, and for each of the reasons, most frequent first.
        grid: Whether the values make a grid; otherwise they vary together, like random samples.
        varied: The varied values.
    """

    def __init__(self, study: Any) -> None:
        self._study, self.name = study, str(study.name)
        pairs = zip(study["verdict"], study["reason"], strict=True)
        self.kinds = np.array(
            [verdict if verdict == PASSED_ROW else reason for verdict, reason in pairs], str
        )
        counts = Counter(self.kinds[self.kinds != PASSED_ROW].tolist())
        reasons = [kind for kind, _ in counts.most_common()]
        self.palette = {PASSED_ROW: PASSED_COLOUR} | dict.fromkeys(reasons, OTHER_COLOUR)
        self.palette |= dict(zip(reasons, REASON_COLOURS, strict=False))
        self.grid = len(study.together) != 1
        self.varied = [self._varied_value(column) for axis in study.together for column in axis]

    def _varied_value(self, column: str) -> VariedValue:
        values, title = self._study[column], printable(self._study.titles[column])
        if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
            return VariedValue(title, np.array(values, float))
        texts = [str(value).lower() if isinstance(value, bool) else str(value) for value in values]
        names = list(dict.fromkeys(texts))
        at = np.array([names.index(text) for text in texts], float)
        return VariedValue(printable(column), at, shorten_names(names, 24))

    def label(self, figure: str) -> str:
        """Title of a figure, with its unit."""
        known = self._study.figures[figure]
        unit = self._study.units.shown(0.0, known.unit)[1]
        return f"{known.title} [{unit}]" if unit else known.title

    def values(self, figure: str) -> FloatArray:
        """A figure by row, NaN for a row without it or a failed one, shape (n,)."""
        factor = self._study.units.shown(1.0, self._study.figures[figure].unit)[0]
        values = np.array(self._study[figure], float)  # None becomes NaN
        return np.where((self.kinds == PASSED_ROW) & np.isfinite(values), factor * values, np.nan)


def plot_study(study: Any, figures: Sequence[str] | None = None) -> Figure:
    """Draw the verdict, and figures of the passing rows, over one or two varied values.

    Two make maps of dots; one makes curves, with verdicts along the lower edge.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 1}]
    >>> study = kw.sweep({"waypoints": lift}, {"waypoints[1].after": "1:2:3"}, workers=0)
    >>> [axes.get_ylabel() for axes in plot_study(study, ["duration"]).axes]
    ['duration [s]']

    Args:
        study: Result of `knotwork.sweep`.
        figures: Names of the figures; by default one that differs between rows.

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
        figures = [name for name in DEFAULT_FIGURES if _differ(drawn.values(name))][:1]
    with settings():
        if len(drawn.varied) == 2:
            figure = new_figure(1, 1 + len(figures))
            names = ["", *figures]
            panels = figure.subplots(1, len(names), squeeze=False, sharey=True)[0]
            for axes, name in zip(panels, names, strict=True):
                _draw_map(axes, drawn, name)
        else:
            rows = figures or [""]
            figure = new_figure(len(rows), 1)
            panels = new_axes(figure, len(rows), 1)[:, 0]
            for axes, name in zip(panels, rows, strict=True):
                _draw_curve(axes, drawn, name)
            panels[-1].set_xlabel(textwrap.fill(drawn.varied[0].title, STUDY_LABEL_LETTERS))
        _write_around(drawn, figure)
    return figure


def _write_around(study: DrawnStudy, figure: Figure) -> None:
    """Write the study's name and the number of passing rows at the top, and the verdicts below."""
    from matplotlib.patches import Patch

    counts = Counter(study.kinds.tolist())
    (name,) = shorten_names([study.name], STUDY_LABEL_LETTERS)
    figure.suptitle(f"{name}: {counts[PASSED_ROW]} of {len(study.kinds)} rows pass", fontsize=LARGE)
    shown = {kind: colour for kind, colour in study.palette.items() if counts[kind]}
    handles = [
        Patch(color=colour, label=f"{printable(kind)} ({counts[kind]})")
        for kind, colour in shown.items()
    ]
    columns = 2 if max(map(len, shown)) > STUDY_LABEL_LETTERS // 2 else 4
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)


def _draw_curve(axes: Axes, study: DrawnStudy, name: str) -> None:
    """Draw a figure over one value, with verdicts as dots along the lower edge."""
    (x,) = study.varied
    colours = [study.palette[kind] for kind in study.kinds]
    edge, margin = axes.get_xaxis_transform(), 0.04 * np.ptp(x.at) or 0.5
    axes.set_xlim(x.at.min() - margin, x.at.max() + margin)
    axes.scatter(x.at, 0.0 * x.at, c=colours, transform=edge, clip_on=False, zorder=3)
    if name:
        order = np.argsort(x.at, kind="stable")
        style = "o" if x.names else ".-"  # words have no order in which to join them
        axes.plot(x.at[order], study.values(name)[order], style, color=DARK)
        axes.set_ylabel(textwrap.fill(study.label(name), STUDY_LABEL_LETTERS // 2))
        axes.margins(y=0.12)
    else:
        axes.set_yticks([])
    if x.names:
        axes.set_xticks(range(len(x.names)), x.names, rotation=25)


def _draw_map(axes: Axes, study: DrawnStudy, name: str) -> None:
    """Draw the verdict, or a figure of the passing rows, as dots over two values."""
    dress(axes)
    axes.grid(visible=False)
    x, y = sorted(study.varied, key=lambda value: bool(value.names))  # names have space upright
    look: dict[str, Any] = {"c": [study.palette[kind] for kind in study.kinds]}
    if name:
        axes.scatter(x.at, y.at, s=4.0, color=GRID)  # rows without the figure
        look = {"c": study.values(name), "cmap": "viridis"}
    sides = [len(np.unique(value.at)) for value in (x, y)]
    across = max(sides) if study.grid else len(x.at) ** 0.5
    look |= {
        "linewidths": 0.0,
        "s": min(max(200.0 / across, 2.5), 14.0) ** 2,
        "marker": "s" if study.grid else "o",
    }
    dots = axes.scatter(x.at, y.at, rasterized=len(x.at) > MOST_DOTS, **look)
    for value, axis in ((x, axes.xaxis), (y, axes.yaxis)):
        axis.set_label_text(textwrap.fill(value.title, STUDY_LABEL_LETTERS))
        if value.names:
            axis.set_ticks(range(len(value.names)), value.names)
    axes.label_outer()
    if name:
        bar = axes.figure.colorbar(dots, ax=axes, pad=0.02, format=lambda at, _: number(at))
        bar.set_label(textwrap.fill(study.label(name), STUDY_LABEL_LETTERS))


def _differ(values: FloatArray) -> bool:
    """Whether values of a figure differ by more than rounding; NaN are left out."""
    known = values[np.isfinite(values)]
    return len(known) > 0 and bool(np.ptp(known) > EQUAL_FIGURES * np.abs(known).max())
