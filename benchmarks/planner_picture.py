"""The figure of the page on planners: peaks of each, median and worst, from the saved results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from knotwork.view import save_figure
from knotwork.view.style import COLOURS, DARK, GRID, WRONG
from planner_tables import named

KINDS = ("smooth", "near", "arbitrary")
PEAKS = ("peak velocity / cubic", "peak accel. / cubic", "peak jerk / paper")
# Okabe and Ito's colours; markers for prints without colours.
RATIOS = {1: (COLOURS[0], "o"), 10: (COLOURS[1], "s"), 100: (WRONG, "^")}


def draw(data: dict[str, Any], path: Path) -> None:
    """Draw a row of panels for each kind of tasks: a marker at the median, a line to the worst."""
    from matplotlib.figure import Figure

    planners = list(dict.fromkeys(row["planner"] for row in data["rows"]))[::-1]
    labels = [named(planner, data) for planner in planners]
    figure = Figure(figsize=(9.0, 10.5), layout="constrained")
    axes = figure.subplots(len(KINDS), len(PEAKS), sharex="col", sharey=True)
    for kind, line in zip(KINDS, axes, strict=True):
        for name, axis in zip(PEAKS, line, strict=True):
            for i, (ratio, (colour, marker)) in enumerate(RATIOS.items()):
                rows = {
                    planners.index(row["planner"]) - 0.22 * (i - 1): row["figures"][name]
                    for row in data["rows"]
                    if (row["kind"], row["ratio"]) == (kind, ratio) and row["figures"].get(name)
                }
                medians, worst = zip(*rows.values(), strict=True)
                axis.hlines([*rows], medians, worst, color=colour, lw=1.2)
                axis.plot(medians, [*rows], marker, color=colour, ms=4)
            axis.axvline(1.0, color=DARK, lw=0.8, zorder=0)
            axis.set_xscale("log")
            axis.xaxis.set_major_formatter("{x:g}")
            axis.xaxis.set_minor_formatter("")
            axis.set_title(f"{kind}: {name}", fontsize=8)
            axis.set_yticks(range(len(planners)), labels, fontsize=7)
            axis.tick_params(axis="x", labelsize=7, labelbottom=True)
            axis.grid(axis="y", color=GRID, lw=0.6)
            axis.spines[["top", "right"]].set_visible(False)
    handles = [
        axes[0][0].plot([], [], marker, color=colour, label=f"longest interval {ratio} x shortest")[
            0
        ]
        for ratio, (colour, marker) in RATIOS.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    save_figure(figure, path)
