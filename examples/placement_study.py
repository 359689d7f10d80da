"""Where may the workpiece stand? Plan the deburring task with its block in 41 x 36 places.

    python examples/placement_study.py [FOLDER] [PLACES] [ANGLES]

The block is moved along x and turned about its corner. The picture shows which places pass all
checks, why the others do not, and how far the arm keeps from singularities. The study is kept in
the folder: start it again after an interrupt, and it goes on where it was.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import knotwork as kw

FIGURE = "smallest_singular_value"


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
    kinds = {reason: f"C{k}" for k, reason in enumerate(["", *study.reasons])}
    figure, (reasons, figures) = plt.subplots(1, 2, figsize=(13, 6), layout="constrained")
    for reason, colour in kinds.items():
        rows = [row for row in study.rows() if (row["reason"] or "") == reason]
        at = [row[across] for row in rows], [row[up] for row in rows]
        reasons.scatter(*at, color=colour, s=9, label=f"{reason or 'passed'} ({len(rows)})")
    passed = [row for row in study.rows() if row["verdict"] == "passed"]
    at = [row[across] for row in passed], [row[up] for row in passed]
    dots = figures.scatter(*at, c=[row[FIGURE] for row in passed], s=9)
    figure.colorbar(dots, label=study.figures[FIGURE].title)
    figure.legend(loc="outside lower center", ncols=4)
    for axes in (reasons, figures):
        axes.set(xlabel=study.titles[across], ylabel=study.titles[up])
    figure.savefig(file)


if __name__ == "__main__":
    main(
        Path(sys.argv[1] if len(sys.argv) > 1 else "placement_study"),
        *(int(count) for count in sys.argv[2:4]),
    )
