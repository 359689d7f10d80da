"""ROS 2: `trajectory_msgs/msg/JointTrajectory` and `control_msgs/action/FollowJointTrajectory`.

joint_trajectory_controller interpolates points of positions and velocities by cubics, and points
with accelerations as well by quintics (method `spline`, the default). Thus the knots alone
define the motion.

A message has times in nanoseconds. A point is within 1/2 ns of its knot, and the last one is up to
1 ns early. A point has the values of the motion at the time in the message. Thus a piece includes
up to 1/2 ns of the next piece. If the acceleration jumps by J at the knot, the velocity differs by
J·1/2 ns; without a jump there is no error. The controller stays at the last point, up to 1 ns
early. The message starts at `time_from_start` 0. When it is sent, the arm must have the position
and the velocity of the first point.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import yaml

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError, InputError
from knotwork.errors.arguments import require_flag
from knotwork.files.export.lossless import MotionPoints, motion_points
from knotwork.files.export.packages import import_package

NANOSECONDS = 1_000_000_000
MAX_DURATION = 2**31 - 1
"""`builtin_interfaces/msg/Duration` counts whole seconds in 32 bits [s]."""

NEGLIGIBLE_SPEED = 1e-7
"""The controller treats a smaller last velocity as zero [rad/s or m/s]."""

MESSAGE = "trajectory_msgs/msg/JointTrajectory"
GOAL = "control_msgs/action/FollowJointTrajectory"
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_VALUES = ("positions", "velocities", "accelerations")


def ticks(trajectory: JointTrajectory) -> list[int]:
    """Compute times of points after the start [ns], each rounded once, so errors don't add up.

    The exact difference of the time of a knot and the start time is rounded to the nearest integer.
    The last one is rounded down.

    Raises:
        ExportError: Two knots round to the same nanosecond.
        InputError: The motion is longer than a message can hold.
    """
    if trajectory.duration > MAX_DURATION:
        raise InputError(
            f"the motion lasts {trajectory.duration:.9g} s; a ROS 2 duration is at most "
            f"{MAX_DURATION} s"
        )
    times = trajectory.breaks.tolist()
    exact = [(Fraction(time) - Fraction(times[0])) * NANOSECONDS for time in times]
    rounded = [round(tick) for tick in exact]
    rounded[-1] = min(rounded[-1], math.floor(exact[-1]))
    for i in range(1, len(rounded)):
        if rounded[i] <= rounded[i - 1]:
            raise ExportError(
                f"knots {i} and {i + 1} at {times[i]:.12g} s are {times[i] - times[i - 1]:.3g} s "
                "apart and round to the same nanosecond, the resolution of ROS 2; choose "
                "knots farther apart",
                time=times[i],
            )
    return rounded


def ros2_dict(
    motion: JointTrajectory | MotionPoints,
    *,
    goal: bool = False,
    accelerations: bool = False,
    tolerance: float | None = None,
) -> dict[str, Any]:
    """Return the message as plain data: its fields by name, nested as in the message.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> message = ros2_dict(lift)
    >>> message["joint_names"], message["points"][1]["positions"]
    (['lift'], [1.0])

    Args:
        motion: The motion, or points of it from `motion_points`.
        goal: Give a goal of `FollowJointTrajectory`, which holds the message as `trajectory`.
        accelerations: Send accelerations too, which makes the controller join by quintics.
        tolerance: Insert points until the motion is met within it [rad or m]; by default the
            knots must define it exactly.

    Raises:
        ExportError: The points can't define the motion; see `motion_points`.
        InputError: The tolerance can't be met, or a time does not fit into a message.
    """
    points = motion_points(motion, accelerations=accelerations, tolerance=tolerance)
    curve = points.trajectory
    after_start = ticks(curve)
    start = Fraction(curve.start_time)
    sent = [float(start + Fraction(tick, NANOSECONDS)) for tick in after_start]
    times = np.clip(sent, curve.start_time, curve.end_time)
    tables = [curve(times, nu) for nu in range(3 if points.with_acceleration else 2)]
    rows = []
    for i, tick in enumerate(after_start):
        row: dict[str, Any] = {
            name: table[i].tolist() for name, table in zip(_VALUES, tables, strict=False)
        }
        sec, nanosec = divmod(tick, NANOSECONDS)
        row["time_from_start"] = {"sec": sec, "nanosec": nanosec}
        rows.append(row)
    message = {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": list(curve.joint_names),
        "points": rows,
    }
    return {"trajectory": message} if require_flag(goal, "goal") else message


def to_ros2(motion: JointTrajectory | MotionPoints, *, goal: bool = False, **options: Any) -> str:
    """Write a motion as YAML for `ros2 topic pub` or, as a goal, `ros2 action send_goal`.

    Both accept the text unchanged:

        ros2 topic pub --once TOPIC trajectory_msgs/msg/JointTrajectory "$(cat motion.yaml)"
        ros2 action send_goal ACTION control_msgs/action/FollowJointTrajectory "$(cat goal.yaml)"

    Positions are in rad or m, as in ROS. Arguments and errors are those of `ros2_dict`.

    >>> import knotwork as kw
    >>> text = to_ros2(kw.plan("ur5_deburring").trajectory)
    >>> text.splitlines()[2]
    'header:'
    """
    points = motion_points(motion, **options)
    data = ros2_dict(points, goal=goal, accelerations=points.with_acceleration)
    lines = [f"# {GOAL + ' goal' if goal else MESSAGE}: {points.describe()}."]
    lines.append(_first_line(points.trajectory))
    if np.abs(points.trajectory.knots.velocity[-1]).max() > NEGLIGIBLE_SPEED:
        lines.append(
            "# The last point has a velocity: joint_trajectory_controller accepts that only with "
            "allow_nonzero_velocity_at_trajectory_end."
        )
    # Each row of numbers is on one line. The tools of ROS 2 read YAML 1.1.
    text = yaml.dump(
        data, Dumper=_DUMPER, default_flow_style=None, sort_keys=False, width=MAX_DURATION
    )
    return "\n".join(lines) + "\n" + text


def _first_line(curve: JointTrajectory) -> str:
    """Write a comment on the state that the arm must have when the message is sent."""
    velocity, acceleration = (curve(curve.start_time, order) for order in (1, 2))
    if np.abs(velocity).max() <= NEGLIGIBLE_SPEED:
        return "# The arm must be at rest at the first point when this is sent."
    state = ", ".join(
        f"{name} {v:.6g} and {a:.6g}"
        for name, v, a in zip(curve.joint_names, velocity, acceleration, strict=True)
    )
    return (
        f"# The motion begins at a velocity and acceleration ({state}; per s and s²): the arm must "
        "already move like this at the first point when this is sent, not be at rest there."
    )


def to_ros2_message(
    motion: JointTrajectory | MotionPoints, *, goal: bool = False, **options: Any
) -> Any:
    """Make the ROS 2 message object. The Python packages of ROS 2 must be installed.

    It is a `trajectory_msgs.msg.JointTrajectory`, or with `goal` a
    `control_msgs.action.FollowJointTrajectory.Goal`. Arguments are those of `ros2_dict`.

    Raises:
        InputError: ROS 2 can't be imported, or as for `ros2_dict`.
    """
    how = "source a ROS 2 installation that has it"
    messages = import_package("trajectory_msgs.msg", "a ROS 2 message object", how)
    duration = import_package("builtin_interfaces.msg", "a ROS 2 message object", how).Duration
    data = ros2_dict(motion, **options)
    message = messages.JointTrajectory(joint_names=data["joint_names"])
    for row in data["points"]:
        time = duration(**row.pop("time_from_start"))
        message.points.append(messages.JointTrajectoryPoint(**row, time_from_start=time))
    if not require_flag(goal, "goal"):
        return message
    action = import_package("control_msgs.action", "a FollowJointTrajectory goal", how)
    return action.FollowJointTrajectory.Goal(trajectory=message)
