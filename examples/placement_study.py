"""Where may the workpiece stand? Plan the deburring task with its block in 41 x 36 places.

    python examples/placement_study.py [FOLDER] [PLACES] [ANGLES]

The block is moved along x and turned about its corner. The picture shows which places pass all
checks, why the others do not, and how far the arm keeps from singularities. The study is kept in
the folder: start it again after an interrupt, and it goes on where it was.
"""

import sys
from pathlib import Path

import knotwork as kw
from knotwork.view import save_figure


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
    best = study.best("smallest_singular_value")
    x, angle = (best[name] for name in study.varied)
    print(f"farthest from singularities: x = {x:g} mm, turned by {angle:g} degrees")
    study.freeze(best["row"], folder / "best.yaml")
    picture = save_figure(study.plot(["smallest_singular_value"]), folder / "placement.svg")
    print(f"wrote {picture}")


if __name__ == "__main__":
    main(
        Path(sys.argv[1] if len(sys.argv) > 1 else "placement_study"),
        *(int(count) for count in sys.argv[2:4]),
    )
