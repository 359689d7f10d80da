"""The figure of the page on planners: peaks of each, median and worst, from the saved results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from planner_tables import named

KINDS = ("smooth", "near", "arbitrary")
PEAKS = ("peak velocity / cubic", "peak accel. / cubic", "peak jerk / paper")
# Okabe and Ito's colours; markers for prints without colours.
RATIOS = {1: ("#0072B2", "o"), 10: ("#E69F00", "s"), 100: ("#D55E00", "^")}


def draw(data: dict[str, Any], path: Path) -> None:
    """Draw a row of panels for each kind of tasks: a marker at the median, a line to the worst."""
    from matplotlib.figure import Figure

    planners = list(dict.fromkeys(row["planner"] for row in data["rows"]))[::-1]
    labels = [named(planner, data) for planner in planners]
    figure = Figure(figsize=(9.0, 10.5), layout="constrained")
    axes = figure.subplots(len(KINDS), len(PEAKS), sharex="col", sharey=True)
    for kind, line in zip(KINDS, axes, strict=True):
        for name, axis in zip(PEAKS, line, strict=True):
            for row in data["rows"]:
                if row["kind"] != kind or not row["figures"].get(name):
                    continue
                median, worst = row["figures"][name]
                colour, marker = RATIOS[row["ratio"]]
                shift = 0.22 * (list(RATIOS).index(row["ratio"]) - 1)
                y = planners.index(row["planner"]) - shift
                axis.plot([median, worst], [y, y], color=colour, lw=1.2)
                axis.plot(median, y, marker, color=colour, ms=4)
            axis.axvline(1.0, color="0.6", lw=0.8, zorder=0)
            axis.set_xscale("log")
            axis.xaxis.set_major_formatter("{x:g}")
            axis.xaxis.set_minor_formatter("")
            axis.set_title(f"{kind}: {name}", fontsize=8)
            axis.set_yticks(range(len(planners)), labels, fontsize=7)
            axis.tick_params(axis="x", labelsize=7, labelbottom=True)
            axis.grid(axis="y", color="0.92", lw=0.6)
            axis.spines[["top", "right"]].set_visible(False)
    handles = [
        axes[0][0].plot([], [], marker, color=colour, label=f"longest interval {ratio} x shortest")[
            0
        ]
        for ratio, (colour, marker) in RATIOS.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    figure.savefig(path, dpi=100, metadata={"Software": ""})
