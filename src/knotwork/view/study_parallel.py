"""Parallel coordinates of a study: a line a row across upright axes, for more than two values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.view.study_rows import LETTER, PASSED, DrawnStudy, Places, wrapped
from knotwork.view.style import DARK, NORMAL, WIDTH, new_figure, number, shortened

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_LINES = 2000
"""Of more rows so many, evenly spread, are drawn."""
FEW = 40
"""Lines that are drawn strongly."""
MOST_MARKS = 20
"""Names on one axis."""
BAND = 0.5
"""Part of the room between places that rows of the same place are spread over."""


def draw_parallel(study: DrawnStudy, names: Sequence[str]) -> Figure:
    """Draw what is varied, then figures."""
    scales = [places for axis in study.axes for places in axis]
    scales += [Places(study.label(name), study.values(name), None) for name in names]
    marks = [_marks(one) for one in scales]
    longest = max(len(text) for one in marks for text, _ in one)
    each = max(1.5, LETTER * longest + 0.3, 0.9 * WIDTH / len(scales))
    figure = new_figure(2, 1)
    figure.set_figwidth(max(WIDTH, each * len(scales)))
    axis = figure.subplots()
    # those that pass last: they lie above the others
    rank = np.argsort(np.argsort(study.kinds == PASSED, kind="stable"), kind="stable")
    lines = np.stack([_heights(one, rank) for one in scales], axis=1)
    chosen = np.unique(np.linspace(0, len(lines) - 1, min(len(lines), MOST_LINES)).astype(int))
    few = len(chosen) <= FEW
    look: dict[str, Any] = {"linewidth": 1.4 if few else 0.7, "alpha": 0.9 if few else 0.5}
    for i in chosen[np.argsort(rank[chosen])]:
        axis.plot(lines[i], color=study.palette[study.kinds[i]], **look)
    for i, one in enumerate(marks):
        axis.axvline(i, color=DARK, linewidth=1.0)
        for text, height in one:
            box = {"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 0.5}
            place: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points", "bbox": box}
            axis.annotate(text, (i, height), va="center", zorder=4, **place)
    axis.set(xlim=(-0.02, len(scales) - 0.98), ylim=(-0.08, 1.08), yticks=[])
    axis.set_xticks(
        range(len(scales)), [wrapped(one.title, 0.9 * each, NORMAL - 1) for one in scales]
    )
    axis.spines[:].set_visible(False)
    axis.tick_params("x", length=0)
    study.write_legend(figure)
    return figure


def _span(one: Places) -> tuple[float, float]:
    low, high = float(np.nanmin(one.at)), float(np.nanmax(one.at))
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _marks(one: Places) -> list[tuple[str, float]]:
    """What is written beside an axis, and how high from 0 to 1."""
    low, high = _span(one)
    if one.names is None:
        ends = np.unique([np.nanmin(one.at), np.nanmax(one.at)])
        return [(number(float(f"{v:.5g}")), (v - low) / (high - low)) for v in ends]
    names = shortened(one.names, 14)
    shown = range(0, len(names), -(-len(names) // MOST_MARKS))
    return [(names[i], (i - low) / (high - low)) for i in shown]


def _heights(one: Places, rank: Any) -> Any:
    """Height of each row; those of one place are spread by rank, so that all can be seen."""
    low, high = _span(one)
    known = one.values[np.isfinite(one.values)]
    spread = 0.0
    if len(known) < len(rank) / 2:
        spread = min(0.1, BAND / len(known))
    return (one.at - low) / (high - low) + spread * (rank / len(rank) - 0.5)
