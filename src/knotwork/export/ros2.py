"""ROS 2: `trajectory_msgs/msg/JointTrajectory` and `control_msgs/action/FollowJointTrajectory`.

joint_trajectory_controller interpolates points of positions and velocities by cubics, and points
with accelerations as well by quintics (method `spline`, the default). So the knots alone
define the motion.

A message gives times in nanoseconds. A point is up to 1/2 ns off its knot, and the last one up to
1 ns early. There are two ways to fill a point. The one with the smaller error bound is taken.

* The motion at the time in the message. Then a piece includes up to 1/2 ns of the next piece.
  The two differ by the jump J of the acceleration at the knot, so by J·1/2 ns in velocity. The
  shape functions of a cubic's end velocities are at most 4/27 of its length H. So a position is off
  by at most (4/27) H (J0 + J1)·1/2 ns for the jumps at both ends of a piece, and J·(1/2 ns)².
  Without a jump of the acceleration there is no error. Between quintics the jerk may jump, which
  gives 1/2 ns·J in acceleration; its shape functions are at most 0.01728 H².
* The motion at the knot. Then a piece is up to 1 ns too short or long and up to 1/2 ns early or
  late. With the peak velocity V, a position is off by at most (1/2 + 2·4/27) V·1 ns, and for
  quintics (1/2 + 2·16/81) V·1 ns + 4·0.01728 H A·1 ns with the peak acceleration A.

The controller holds the last point, up to 1 ns early, where the motion still has its end velocity.
See `replay_bound`.

The message starts at `time_from_start` 0: the arm must be at the first point when it is sent, and
stand there or move as the point says.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from knotwork.errors import ExportError, InputError
from knotwork.errors.arguments import flag
from knotwork.export.lossless import Points, motion_points
from knotwork.export.packages import needed
from knotwork.trajectory import JointTrajectory

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from knotwork.trajectory.exportable import MessageOptions

NANOSECONDS = 1_000_000_000
LONGEST = 2**31 - 1
"""`builtin_interfaces/msg/Duration` counts whole seconds in 32 bits [s]."""

CUBIC_SHAPE = 4.0 / 27.0
"""Largest value of s - 2s² + s³ on [0, 1]: effect of an end velocity on a cubic."""

QUINTIC_SHAPE = 16.0 / 81.0
"""Largest value of s - 6s³ + 8s⁴ - 3s⁵ on [0, 1], for a quintic (at s = 1/3)."""

ACCELERATION_SHAPE = 0.01728
"""Largest value of s²(1 - s)³/2 on [0, 1]: effect of an end acceleration on a quintic."""

STANDING = 1e-7
"""The controller treats a smaller last velocity as zero [rad/s or m/s]."""

MESSAGE = "trajectory_msgs/msg/JointTrajectory"
GOAL = "control_msgs/action/FollowJointTrajectory"
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_VALUES = ("positions", "velocities", "accelerations")


def ticks(trajectory: JointTrajectory) -> list[int]:
    """Times of the points after the start [ns], each rounded once, so that errors don't add up.

    The exact difference of a knot's time and the start time is rounded to the nearest integer, but
    the last one never beyond the end.

    Raises:
        ExportError: Two knots round to the same nanosecond.
        InputError: The motion is longer than a message can hold.
    """
    if trajectory.duration > LONGEST:
        raise InputError(
            f"the motion lasts {trajectory.duration:.9g} s; a ROS 2 duration is at most {LONGEST} s"
        )
    times = trajectory.breaks.tolist()
    exact = [(Fraction(time) - Fraction(times[0])) * NANOSECONDS for time in times]
    rounded = [round(tick) for tick in exact]
    rounded[-1] = min(rounded[-1], math.floor(exact[-1]))
    for i in range(1, len(rounded)):
        if rounded[i] <= rounded[i - 1]:
            raise ExportError(
                f"knots {i - 1} and {i} at {times[i]:.12g} s are {times[i] - times[i - 1]:.3g} s "
                "apart and round to the same nanosecond, the resolution of ROS 2; choose "
                "knots farther apart",
                time=times[i],
            )
    return rounded


def ros2_dict(
    motion: JointTrajectory | Points, **options: Unpack[MessageOptions]
) -> dict[str, Any]:
    """Give the message as plain data: its fields by name, nested as in the message.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> message = ros2_dict(lift)
    >>> message["joint_names"], message["points"][1]["positions"]
    (['lift'], [1.0])

    Args:
        motion: The motion, or points of it from `motion_points`.
        options: See `knotwork.trajectory.exportable.MessageOptions`.

    Raises:
        ExportError: The points can't define the motion; see `motion_points`.
        InputError: The tolerance can't be met, or a time does not fit into a message.
    """
    points, goal = _points(motion, **options)
    message = _message(points)
    return {"trajectory": message} if goal else message


def _points(
    motion: JointTrajectory | Points,
    *,
    goal: bool = False,
    accelerations: bool = False,
    fit: float | None = None,
) -> tuple[Points, bool]:
    """Points of a message, and whether it is part of a goal."""
    goal = flag(goal, "goal")
    return motion_points(motion, accelerations=accelerations, fit=fit), goal


def _message(points: Points) -> dict[str, Any]:
    curve = points.trajectory
    after_start = ticks(curve)
    timed, own = _bounds(curve, points.with_acceleration)
    times = curve.breaks
    if timed <= own:
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
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": list(curve.joint_names),
        "points": rows,
    }


def to_ros2(motion: JointTrajectory | Points, **options: Unpack[MessageOptions]) -> str:
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
    points, goal = _points(motion, **options)
    lines = [f"# {GOAL + ' goal' if goal else MESSAGE}: {points.describe()}."]
    message = _message(points)
    lines.append(_first_line(points.trajectory))
    if max(abs(v) for v in message["points"][-1]["velocities"]) > STANDING:
        lines.append(
            "# The last point has a velocity: joint_trajectory_controller accepts that only with "
            "allow_nonzero_velocity_at_trajectory_end."
        )
    data = {"trajectory": message} if goal else message
    # Rows of numbers on a line each; YAML 1.1, which ROS 2's tools read.
    text = yaml.dump(data, Dumper=_DUMPER, default_flow_style=None, sort_keys=False, width=LONGEST)
    return "\n".join(lines) + "\n" + text


def _first_line(curve: JointTrajectory) -> str:
    """Comment on the required state of the arm when a message is sent."""
    moving = {
        name: ", ".join(
            f"{joint} {value:.6g}"
            for joint, value in zip(curve.joint_names, curve(curve.start_time, order), strict=True)
            if abs(value) > STANDING
        )
        for order, name in ((1, "velocity"), (2, "acceleration"))
    }
    if not moving["velocity"]:
        return "# The arm must be at rest at the first point when this is sent."
    pulled = f" and acceleration ({moving['acceleration']}; per s²)" * bool(moving["acceleration"])
    return (
        f"# The motion begins at a velocity ({moving['velocity']}; rad/s or m/s){pulled}: the "
        "arm must already move like this at the first point when this is sent, not be at rest "
        "there."
    )


def to_ros2_message(motion: JointTrajectory | Points, **options: Unpack[MessageOptions]) -> Any:
    """Make the ROS 2 message object itself, where ROS 2's Python packages can be imported.

    It is a `trajectory_msgs.msg.JointTrajectory`, or with `goal` a
    `control_msgs.action.FollowJointTrajectory.Goal`. Arguments are those of `ros2_dict`.

    Raises:
        InputError: ROS 2 can't be imported, or as for `ros2_dict`.
    """
    points, goal = _points(motion, **options)
    how = "source a ROS 2 installation that has it"
    messages = needed("trajectory_msgs.msg", "a ROS 2 message object", how)
    duration = needed("builtin_interfaces.msg", "a ROS 2 message object", how).Duration
    data = _message(points)
    message = messages.JointTrajectory(joint_names=data["joint_names"])
    for row in data["points"]:
        time = duration(**row.pop("time_from_start"))
        message.points.append(messages.JointTrajectoryPoint(**row, time_from_start=time))
    if not goal:
        return message
    action = needed("control_msgs.action", "a FollowJointTrajectory goal", how)
    return action.FollowJointTrajectory.Goal(trajectory=message)


def replay_bound(trajectory: JointTrajectory, *, accelerations: bool = False) -> float:
    """Bound on the error of a replayed position due to times in whole nanoseconds [rad or m].

    It holds for all joints and all time, up to rounding of the positions; the module's docstring
    derives it.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1 / 3], [[0], [1]], [[0], [0]])
    >>> 0 < replay_bound(lift) < 2e-9
    True

    Args:
        trajectory: A motion defined by its knots.
        accelerations: Whether the points have accelerations.
    """
    end_speed = float(np.abs(trajectory.velocity(trajectory.end_time)).max())
    return min(_bounds(trajectory, accelerations)) + end_speed * 1e-9


def _bounds(trajectory: JointTrajectory, accelerations: bool) -> tuple[float, float]:
    """Bounds for points at the times in the message, and at the knots."""
    order = 3 if accelerations else 2
    h = np.diff(trajectory.breaks)[:, None]
    jumps = np.zeros((trajectory.breaks.size, len(trajectory.joint_names)))
    jumps[1:-1] = np.abs(trajectory.polynomial.jumps(order))
    sums = float(((jumps[:-1] + jumps[1:]) * h ** (order - 1)).max())
    shape = ACCELERATION_SHAPE if accelerations else CUBIC_SHAPE
    timed = shape * sums * 0.5e-9 + float(jumps.max()) * 0.25e-18
    peak = float(trajectory.extrema("velocity").peak.max())
    own = (0.5 + 2.0 * (QUINTIC_SHAPE if accelerations else CUBIC_SHAPE)) * peak
    if accelerations:
        peak = float(trajectory.extrema("acceleration").peak.max())
        own += 4.0 * ACCELERATION_SHAPE * float(h.max()) * peak
    return timed, own * 1e-9
