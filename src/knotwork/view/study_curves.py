"""Curves of a study: verdict and figures over one value that is varied."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from knotwork.view.study_maps import draw_cells
from knotwork.view.study_rows import DrawnStudy, Places, wrapped
from knotwork.view.style import DARK, dress, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STRIP = 0.35
"""Height of the verdict's strip, as a part of that of a figure's panel."""


def draw_curves(study: DrawnStudy, x: Places, names: Sequence[str]) -> Figure:
    """Draw a strip of the verdict, and below it a panel for each figure."""
    figure = new_figure(1 + len(names), 1)
    below = 1.5 if x.names is not None else 0.0
    figure.set_figheight(below + (figure.get_figheight() if names else 2.2))
    ratios = [STRIP, *[1.0] * len(names)]
    axes = figure.subplots(1 + len(names), 1, sharex=True, squeeze=False, height_ratios=ratios)
    first, *others = axes[:, 0]
    line = Places("", np.zeros(len(x.at)), None)
    for kind, colour in study.palette.items():
        draw_cells(first, x, line, study.kinds == kind, colour)
    first.set_yticks([])
    order = np.argsort(x.at, kind="stable")
    room = 0.6 * figure.get_figheight() / max(1, len(names))
    for axis, name in zip(others, names, strict=True):
        # names have no order in which to join them
        style = ".-" if x.names is None else "o"
        axis.plot(x.at[order], study.values(name)[order], style, color=DARK)
        axis.set_ylabel(wrapped(study.label(name), room))
        dress(axis)
    x.dress(axes[-1, 0].xaxis, 0.8 * figure.get_figwidth())
    axes[-1, 0].set_xlabel(wrapped(x.title, 0.8 * figure.get_figwidth()))
    study.write_legend(figure)
    return figure
