"""Define a task in Python, without YAML: plan it, check it, and store the result.

    python examples/scenario_in_code.py [FOLDER]

A Panda picks up at A, passes B at 0.2 m/s and sets down at C. Parts of a task have the fields of a
scenario file, in SI. The task, its trajectory, samples and report are written into FOLDER.
"""

import sys
from math import pi
from pathlib import Path

import knotwork as kw
from knotwork.task import Pose, PoseWaypoint, Velocity

DOWN = [pi, 0, 0]  # roll, pitch, yaw [rad]: the tool points down
TASK = kw.Task(
    robot="panda",
    end_acceleration="zero",
    waypoints=[  # s, m, m/s
        PoseWaypoint(name="A", pose=Pose(position=[0.45, -0.30, 0.25], rpy=DOWN)),
        PoseWaypoint(
            name="B",
            after=1.5,
            pose=Pose(position=[0.50, 0.00, 0.40], rpy=DOWN),
            velocity=Velocity(linear=[0.0, 0.2, 0.0]),
        ),
        PoseWaypoint(name="C", after=1.5, pose=Pose(position=[0.45, 0.30, 0.25], rpy=DOWN)),
    ],
)


def main(folder: Path) -> None:
    """Plan the task and write what came out."""
    plan = kw.plan(TASK)
    plan.report.raise_if_failed()

    trajectory = plan.trajectory
    print(f"{trajectory.duration:g} s by {trajectory.origin}, {len(trajectory.breaks)} knots")
    speed = trajectory.extrema("velocity").peak
    for joint, most in zip(trajectory.joint_names, speed, strict=True):
        print(f"  {joint}: at most {most:.3f} rad/s")
    for path in [*plan.save(folder), TASK.save(folder / "task.yaml")]:
        print(f"wrote {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "scenario_in_code"))
