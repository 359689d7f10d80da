"""Define a task in Python, without YAML: plan it, check it, and store the result.

    python examples/scenario_in_code.py [FOLDER]

A Panda picks up at A, passes B at 0.2 m/s and sets down at C. The mapping has the keys of a
scenario file. The trajectory, its samples and the report are written into FOLDER.
"""

import sys
from pathlib import Path

import knotwork as kw

DOWN = [180, 0, 0]  # roll, pitch, yaw [deg]: the tool points down
TASK = {
    "robot": "panda",
    "units": {"angle": "deg"},
    "end_acceleration": "zero",
    "waypoints": [  # s, m, m/s
        {"name": "A", "pose": {"position": [0.45, -0.30, 0.25], "rpy": DOWN}},
        {
            "name": "B",
            "after": 1.5,
            "pose": {"position": [0.50, 0.00, 0.40], "rpy": DOWN},
            "velocity": {"linear": [0.0, 0.2, 0.0]},
        },
        {"name": "C", "after": 1.5, "pose": {"position": [0.45, 0.30, 0.25], "rpy": DOWN}},
    ],
}


def main(folder: Path) -> None:
    """Plan the task and write what came out."""
    plan = kw.plan(TASK)
    plan.report.raise_if_failed()

    trajectory = plan.trajectory
    print(f"{trajectory.duration:g} s by {trajectory.planner}, {len(trajectory.breaks)} knots")
    speed = trajectory.extrema("velocity").peak
    for joint, most in zip(trajectory.joint_names, speed, strict=True):
        print(f"  {joint}: at most {most:.3f} rad/s")
    for path in plan.save(folder):
        print(f"wrote {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "scenario_in_code"))
