"""Contents of the sampled formats: times, the joints' quantities, and the tool's pose and twist."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.curves.trajectory.sampling import make_sample_times
from knotwork.errors import InputError
from knotwork.errors.arguments import require_flag
from knotwork.files.export.labels import labels_at
from knotwork.files.export.lossless import MotionPoints, motion_points
from knotwork.joint_quantities import MOTION_QUANTITIES

if TYPE_CHECKING:
    from knotwork.robot import Robot

DEFAULT_RATE = 100.0
"""Default sampling rate [Hz]."""

MAX_TABLE_VALUES = 20_000_000
"""Maximum number of values in a table, about 400 MB of text.

More indicate a mistake in the rate.
"""

TOOL_COLUMNS = {
    "tool_position": ("tool.position", "xyz", "m"),
    "tool_quaternion": ("tool.quaternion", "xyzw", ""),
    "tool_linear_velocity": ("tool.linear_velocity", "xyz", "m_per_s"),
    "tool_angular_velocity": ("tool.angular_velocity", "xyz", "rad_per_s"),
}
"""Names, components and unit of the columns of each quantity of the tool centre point, in the axes
of the robot's base; quaternions are scalar-last."""


@dataclass(frozen=True, eq=False)
class MotionTable:
    """A motion at a sequence of times.

    Attributes:
        trajectory: The motion itself.
        time: Times [s], shape (s,).
        joints: `"position"`, `"velocity"` and so on [rad or m, and per second], each (s, d).
        tool: As in `TOOL_COLUMNS`, each of shape (s, 3) or, for the quaternion, (s, 4); empty
            without a robot.
        note: Accuracy of the motion defined by the rows.
        labels: `"segment"` and `"event"`, a text for each row; or empty.
    """

    trajectory: JointTrajectory
    time: FloatArray
    joints: Mapping[str, FloatArray]
    tool: Mapping[str, FloatArray]
    note: str
    labels: Mapping[str, list[str]]

    def columns(self) -> dict[str, FloatArray]:
        """All columns by name, each of shape (s,).

        Names end in the units of their values: `time_s` [s], `elbow.velocity_rad_per_s` [rad/s].
        """
        columns, motion = {"time_s": self.time}, self.trajectory
        for quantity, table in self.joints.items():
            order = MOTION_QUANTITIES.index(quantity)
            per = "_per_s" * (order > 0) + f"{order}" * (order > 1)
            joints = zip(motion.joint_names, motion.joint_units, table.T, strict=True)
            for name, unit, values in joints:
                columns[f"{name}.{quantity}_{unit}{per}"] = values
        for key, values in self.tool.items():
            name, components, unit = TOOL_COLUMNS[key]
            for i, component in enumerate(components):
                label = "_".join(part for part in (name, component, unit) if part)
                if label in columns:
                    raise InputError(f"a joint and the tool both have a column {label!r}")
                columns[label] = values[:, i]
        return columns


def motion_table(
    motion: JointTrajectory | MotionPoints,
    *,
    rate: float | None = None,
    knots_only: bool = False,
    accelerations: bool = False,
    tolerance: float | None = None,
    robot: Robot | None = None,
    labels: bool | None = None,
) -> MotionTable:
    """Sample a motion, or take the points that define it.

    >>> import knotwork as kw
    >>> table = motion_table(kw.plan("paper_case").trajectory, rate=10)
    >>> table.joints["velocity"].shape
    (251, 1)

    Args:
        motion: The motion; for knots, also points of it from `motion_points`.
        rate: Samples per second [Hz], by default 100; the last one is at the end of the motion.
        knots_only: Take points that define the whole motion instead of samples.
        accelerations: These points have accelerations too, for quintics instead of cubics.
        tolerance: Insert points until the motion is met within this tolerance [rad or m].
        robot: Robot, for pose and twist of the tool.
        labels: Include the names of segments and events; by default if there are events.

    Raises:
        ExportError: The points can't define the motion; see `motion_points`.
        InputError: Options contradict each other, the rate makes too many values, or
            the robot has other joints or is not a robot.
    """
    if require_flag(knots_only, "knots_only"):
        if rate is not None:
            raise InputError("a rate of samples and knots_only are both given; choose one")
        points = motion_points(motion, accelerations=accelerations, tolerance=tolerance)
        trajectory = points.trajectory
        time = trajectory.breaks
        quantities = MOTION_QUANTITIES[: 3 if accelerations else 2]
        note = points.describe()
    else:
        if accelerations or tolerance is not None:
            raise InputError(
                "accelerations and tolerance apply to knots: samples have accelerations anyway and "
                "are exact at their times; use knots_only (--knots-only) or leave them out"
            )
        if isinstance(motion, MotionPoints):
            raise InputError("points can't be sampled; give the trajectory, or knots_only")
        trajectory = motion
        rate = DEFAULT_RATE if rate is None else rate
        time = _sample_times(motion, rate, has_tool=robot is not None)
        quantities = MOTION_QUANTITIES
        note = f"{time.size} samples at {rate:g} Hz"
    joints = {name: trajectory(time, order) for order, name in enumerate(quantities)}
    tool = {} if robot is None else _tool(trajectory, robot, time)
    named = bool(trajectory.events) if labels is None else require_flag(labels, "labels")
    texts = labels_at(trajectory, time) if named else {}
    return MotionTable(trajectory, time, joints, tool, note, texts)


def _sample_times(motion: JointTrajectory, rate: float, *, has_tool: bool) -> FloatArray:
    """Times of samples [s], at most as many as a table may have."""
    columns = 1 + len(MOTION_QUANTITIES) * len(motion.joint_names)
    if has_tool:
        columns += sum(len(components) for _, components, _ in TOOL_COLUMNS.values())
    return make_sample_times(
        motion.start_time, motion.end_time, rate, max_samples=MAX_TABLE_VALUES // columns
    )


def _tool(trajectory: JointTrajectory, robot: Robot, time: FloatArray) -> dict[str, FloatArray]:
    """Pose and twist of the tool centre point at times of shape (s,)."""
    import pinocchio as pin

    if not hasattr(robot, "forward_and_jacobian"):
        raise InputError(
            f"robot is {robot!r}; it must be a Robot, as from knotwork.load_robot, or None"
        )
    curve = trajectory.reordered(
        robot.joint_names, robot.joint_units, owner=f"robot {robot.name!r}"
    )
    q, v = curve.position(time), curve.velocity(time)
    rows = []
    previous = np.array([0.0, 0.0, 0.0, 1.0])
    for position, velocity in zip(q, v, strict=True):
        pose, jacobian = robot.forward_and_jacobian(position)
        twist = jacobian @ velocity
        quaternion = pin.SE3ToXYZQUAT(pose)[3:]
        # q and -q are the same rotation; take the one nearer to the previous sample
        previous = quaternion if quaternion @ previous >= 0.0 else -quaternion
        rows.append((pose.translation.copy(), previous, twist[:3], twist[3:]))
    return dict(zip(TOOL_COLUMNS, map(np.array, zip(*rows, strict=True)), strict=True))
