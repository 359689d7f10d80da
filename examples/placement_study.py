"""Where may the workpiece stand? Plan the deburring task with its block in 41 x 36 places.

    python examples/placement_study.py [FOLDER] [PLACES] [ANGLES]

The block is moved along x and turned about its corner. The picture shows which places pass all
checks, why the others do not, and how far the arm keeps from singularities. The study is kept in
the folder: start it again after an interrupt, and it goes on where it was.
"""

import sys
from itertools import cycle
from pathlib import Path

from matplotlib.figure import Figure

import knotwork as kw
from knotwork.view import save_figure

FIGURE = "smallest_singular_value"
# Of places that pass, then of each reason.
COLOURS = ("#009E73", "#D55E00", "#404040", "#E69F00", "#56B4E9", "#CC79A7")
SQUARE = {"marker": "s", "s": 18, "linewidths": 0}


def main(folder: Path, places: int = 41, angles: int = 36) -> None:
    """Make the study, and draw it."""
    study = kw.sweep(
        "ur5_deburring",
        vary={
            "frames.block.position[0]": f"250:650:{places}",  # [mm]
            "frames.block.rpy[2]": f"0:350:{angles}",  # [deg]
        },
        out=folder,
        resume=(folder / "study.json").exists(),
    )
    print(f"{study.passed} of {len(study)} places pass")
    for reason, count in study.reasons.items():
        print(f"{count:5} {reason}")
    best = study.best(FIGURE)
    x, angle = (best[name] for name in study.varied)
    print(f"farthest from singularities: x = {x:g} mm, turned by {angle:g} degrees")
    study.freeze(best["row"], folder / "best.yaml")
    draw(study, folder / "placement.svg")
    print(f"wrote {folder / 'placement.svg'}")


def draw(study: kw.Study, file: Path) -> None:
    """Draw the reasons of all rows, and the figure of those that pass, over the two values."""
    across, up = study.varied
    kinds = zip(["", *study.reasons], cycle(COLOURS))
    figure = Figure(figsize=(10, 5), layout="constrained")
    reasons, figures = figure.subplots(1, 2, sharey=True)
    for reason, colour in kinds:
        rows = [row for row in study.rows() if (row["reason"] or "") == reason]
        at = [row[across] for row in rows], [row[up] for row in rows]
        label = f"{reason or 'passed'} ({len(rows)})"
        reasons.scatter(*at, color=colour, label=label, **SQUARE)
    passed = [row for row in study.rows() if row["verdict"] == "passed"]
    at = [row[across] for row in passed], [row[up] for row in passed]
    dots = figures.scatter(*at, c=[row[FIGURE] for row in passed], **SQUARE)
    figure.colorbar(dots, label=study.figures[FIGURE].title)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    reasons.set(ylabel=study.titles[up])
    for axes in (reasons, figures):
        axes.set(xlabel=study.titles[across])
    save_figure(figure, file)


if __name__ == "__main__":
    main(
        Path(sys.argv[1] if len(sys.argv) > 1 else "placement_study"),
        *(int(count) for count in sys.argv[2:4]),
    )
