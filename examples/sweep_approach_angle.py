"""Sweep the angle at which a UR5 holds its tool over 100 scenarios, and plot what it costs.

    python examples/sweep_approach_angle.py [FOLDER]

The motion is the edge alone: the tool enters it at its speed and leaves it at its speed, so that no
way there or back hides what the angle costs. The picture shows the peak joint speed over the angle.
Angles at which the arm can't do the task are shaded, with the reason printed.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import knotwork as kw
from knotwork.view import save_figure

ANGLES = np.linspace(-50.0, 98.5, 100)


def task(angle: float) -> dict[str, object]:
    """Follow 150 mm of an edge at 50 mm/s, the tool tilted by an angle [deg]."""
    along = [  # [mm], [deg], [mm/s]
        {
            "name": f"edge {i}",
            "time": i,  # [s]
            "pose": {"position": [50 * i, 0, 0], "rpy": [angle - 180, 0, 180]},
            "velocity": {"linear": [50, 0, 0]},
        }
        for i in range(4)
    ]
    return {
        "robot": "ur5",
        "units": {"length": "mm", "angle": "deg"},
        "tool": {"frame": "tool0", "offset": {"position": [0, 0, 180], "rpy": [0, 0, 0]}},
        "frames": {"block": {"position": [700, -75, 200], "rpy": [0, 0, 90]}},
        "frame": "block",
        "waypoints": along,
    }


def main(folder: Path) -> None:
    """Plan every angle and draw the result."""
    speed = np.full(len(ANGLES), np.nan)
    for i, angle in enumerate(ANGLES):
        try:
            plan = kw.plan(task(float(angle)))
        except kw.InputError as error:  # out of reach, at a singularity, too fast
            print(f"{angle:6.1f} deg: {error}")
            continue
        if plan.report.ok:
            speed[i] = np.degrees(plan.trajectory.extrema("velocity").peak.max())
        else:
            print(f"{angle:6.1f} deg: {plan.report.failures[0]}")
    if np.isnan(speed).all():
        sys.exit("the arm can't do the task at any of these angles")
    best = int(np.nanargmin(speed))
    print(f"slowest joints at {ANGLES[best]:.0f} deg: {speed[best]:.1f} deg/s")
    print(f"{np.isnan(speed).sum()} of {len(ANGLES)} angles can't be done")

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    axes.plot(ANGLES, speed, ".-", color="#0072B2")
    step = ANGLES[1] - ANGLES[0]
    for angle in ANGLES[np.isnan(speed)]:
        axes.axvspan(angle - step / 2, angle + step / 2, color="#E4E4E4", linewidth=0)
    axes.set(xlabel="tilt of the tool [deg]", ylabel="peak joint speed [deg/s]", ylim=(0, None))
    axes.set_title("Tilt of the tool and peak joint speed (shaded: can't be done)")
    print(f"wrote {save_figure(figure, folder / 'sweep.svg')}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "sweep_approach_angle"))
