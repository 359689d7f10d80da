"""Pictures of a study: which kind shows what is varied, and which figures are drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import InputError
from knotwork.view.study_curves import draw_curves
from knotwork.view.study_maps import draw_maps
from knotwork.view.study_parallel import draw_parallel
from knotwork.view.study_rows import DrawnStudy, Places, Rows, differ
from knotwork.view.style import settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PANELS = 24
"""Of small multiples; more combinations than these have room for are parallel coordinates."""
UNASKED = ("clearance", "smallest_singular_value", "duration", "velocity_use", "path_deviation")
"""Figures of which the first that differs between rows is drawn unasked."""


def plot_study(study: Rows, figures: Sequence[str] | None = None) -> Figure:
    """Draw the verdict, and figures of the rows that pass, over what is varied.

    One varied value makes curves. Two make a map of cells, or of dots where they go together, as
    random samples do. More make a map for each combination of the others. Three or more that go
    together, and combinations that are too many, make parallel coordinates.

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
    names = _chosen(study, drawn, figures)
    with settings():
        figure = _drawn(drawn, names)
        drawn.write_heading(figure)
    return figure


def _chosen(study: Rows, drawn: DrawnStudy, figures: Sequence[str] | None) -> list[str]:
    for name in figures or ():
        if name not in study.figures:
            known = ", ".join(study.figures)
            raise InputError(f"unknown figure {name!r}; accepted: {known}")
        if not np.isfinite(drawn.values(name)).any():
            raise InputError(f"no row that passes has the figure {name!r}")
    if figures is not None:
        return list(figures)
    return [name for name in UNASKED if differ(drawn.values(name))][:1]


def _drawn(study: DrawnStudy, names: list[str]) -> Figure:
    across, rest = _split(study.axes)
    panels = math.prod(len(set(zip(*(one.at for one in axis), strict=True))) for axis in rest)
    if len(across) > 2 or panels > MOST_PANELS:
        return draw_parallel(study, names)
    others = [one for axis in rest for one in axis]
    if len(across) == 1:
        return draw_curves(study, across[0], names)
    x, y = across
    if x.names is not None and y.names is None:  # names have more room upright
        x, y = y, x
    dots = any(len(axis) == 2 for axis in study.axes if x in axis)
    return draw_maps(study, x, y, others, names, dots)


def _split(axes: list[list[Places]]) -> tuple[list[Places], list[list[Places]]]:
    """What a panel has across and up, and the axes each of whose values has a panel.

    Values that go together stay together, the most of them in one panel. Where none do, those
    that have the most values make the map, numbers before names.
    """
    widest = max(axes, key=len)
    if len(widest) > 1:
        return widest, [axis for axis in axes if axis is not widest]
    order = sorted(axes, key=lambda axis: (axis[0].names is not None, -len(axis[0].values)))
    across = [axis for axis in axes if any(axis is one for one in order[:2])]
    return [axis[0] for axis in across], [axis for axis in axes if axis not in across]
