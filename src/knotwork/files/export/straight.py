"""Joint positions for receivers that interpolate by straight lines, and their error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError, InputError
from knotwork.errors.arguments import require_number
from knotwork.files.export.lossless import MAX_EXPORTED_POINTS, largest_difference, receive_within

if TYPE_CHECKING:
    from knotwork.robot import Robot

ARM_AXES = 6
"""Number of revolute axes of an arm for controllers of KUKA, ABB and FANUC."""
AXES_ACCEPTED = (
    f"accepted: {ARM_AXES} revolute joints, and up to {ARM_AXES} external axes (prismatic, or "
    "`external_axes` of the robot; in Python robot=plan.joints.robot)"
)
LINE_TOLERANCE = 1e-3
"""Default error of straight lines between points [rad or m]."""
TIME_TICK = 1e-3
"""Resolution of times in programs [s]."""
CONTINUE_ADVICE = "; to continue another motion, stop it first (plan.stop), and begin at the stop"
_SIX_DECIMALS = np.radians(0.5e-6)
"""Rounding error of six decimals of an angle in deg [rad]."""
STRAIGHT: Mapping[str, Any] = {
    "krl": {"rounding": _SIX_DECIMALS},
    "rapid": {"rounding": _SIX_DECIMALS},
    # FANUC's angles have four decimals, and its third one is the sum of two joints
    "ls": {"rounding": 200.0 * _SIX_DECIMALS},
    "rsi": {"cycle": 0.004},
    "egm": {"cycle": 0.004},
    "j519": {"cycle": 0.008},
    "franka": {"cycle": 0.001},
}
"""Options of `straight_points` for formats of positions."""
CONTROLLER_UNITS = {"rad": ("deg", np.degrees(1.0)), "m": ("mm", 1e3)}
"""Units of positions in files for controllers by the unit of a joint, and their factors."""
RESTING_SPEED = 1e-9
"""Speed below which a joint is at rest [rad/s or m/s]."""


@dataclass(frozen=True, eq=False)
class StraightPoints:
    """Positions of a motion at a sequence of times, which the receiver joins by straight lines.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> points = straight_points(lift, cycle=0.25)
    >>> points.time.size, round(points.error, 6)
    (5, 0.035264)

    Attributes:
        trajectory: The motion.
        time: Times since the motion's start [s], shape (n,); the last one may be after its end.
        position: Positions [rad or m], shape (n, d).
        error: Largest error of straight lines between the positions [rad or m].
    """

    trajectory: JointTrajectory
    time: FloatArray
    position: FloatArray
    error: float

    def describe(self) -> str:
        """Describe the number of positions, and their error."""
        error = f"at most {bound_text(self.error)} [rad or m]"
        return f"{self.time.size} points; straight lines between them are off the motion by {error}"


def bound_text(value: float, digits: int = 3) -> str:
    """Text of an upper bound, rounded up to few digits.

    >>> bound_text(0.00091027)
    '0.000911'
    """
    if value <= 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return f"{math.ceil(value / unit * (1.0 - 1e-12)) * unit:.{digits}g}"


def arm_joints(trajectory: JointTrajectory, robot: Robot | None) -> list[int]:
    """Indices of an arm's revolute joints, without external axes of a given robot."""
    outer = robot.external_axes if robot is not None else ()
    joints = zip(trajectory.joint_names, trajectory.joint_units, strict=True)
    return [i for i, (name, unit) in enumerate(joints) if unit == "rad" and name not in outer]


def from_horizontal(points: StraightPoints, robot: Robot | None = None) -> FloatArray:
    """Positions with FANUC's J3, which counts from the horizontal, shape (n, d).

    It is joint 3 less joint 2 of a URDF of ROS-Industrial.

    Raises:
        ExportError: There are more than six joints, and the arm's are unknown.
    """
    q = points.position.copy()
    arm = arm_joints(points.trajectory, robot)
    if len(arm) > ARM_AXES:
        raise ExportError(f"the arm has {len(arm)} revolute joints; {AXES_ACCEPTED}")
    if len(arm) > 2:
        q[:, arm[2]] -= q[:, arm[1]]
    return q


def controller_axes(
    points: StraightPoints, q: FloatArray, robot: Robot | None
) -> tuple[FloatArray, FloatArray, dict[str, str]]:
    """Angles of the arm [deg], shape (n, 6), external axes, and their units: deg or mm."""
    units = points.trajectory.joint_units
    arm = arm_joints(points.trajectory, robot)
    external = [i for i in range(len(units)) if i not in arm]
    if len(arm) != ARM_AXES or len(external) > ARM_AXES:
        have = f"{len(arm)} revolute joints and {len(external)} external axes"
        raise ExportError(f"the arm has {have}; {AXES_ACCEPTED}")
    names = points.trajectory.joint_names
    shown = {names[i]: CONTROLLER_UNITS[units[i]] for i in external}
    factors = np.array([factor for _, factor in shown.values()])
    shown_units = {name: unit for name, (unit, _) in shown.items()}
    return np.degrees(q[:, arm]), q[:, external] * factors, shown_units


def straight_points(
    motion: JointTrajectory | StraightPoints,
    *,
    cycle: float | None = None,
    tolerance: float | None = None,
    rounding: float = 0.0,
) -> StraightPoints:
    """Take positions of a motion from rest to rest, and bound the error of lines between them.

    >>> import knotwork as kw
    >>> motion = kw.plan("ur5_deburring").trajectory
    >>> near, fine = (straight_points(motion, tolerance=tolerance) for tolerance in (1e-2, 1e-4))
    >>> near.time.size < fine.time.size, fine.error <= 1e-4
    (True, True)

    Args:
        motion: The motion; points of it are returned unchanged.
        cycle: Time between two positions [s]; the last one is at the end or just after it. By
            default there are as many as the tolerance needs, at whole milliseconds, and one at each
            event.
        tolerance: Tolerance of the lines in each joint [rad or m]; by default 1e-3.
        rounding: Rounding error of the positions in the file [rad or m].

    Raises:
        ExportError: A joint moves at an end; the message has a remedy.
        InputError: The tolerance is not positive, infeasible with a point per millisecond, or takes
            more than a million points.
    """
    if isinstance(motion, StraightPoints):
        return motion
    tolerance = LINE_TOLERANCE if tolerance is None else tolerance
    tolerance = require_number(tolerance, "tolerance", "rad or m", positive=True)
    require_rest_at_ends(motion)
    last = math.ceil(motion.duration / (cycle or TIME_TICK) * (1.0 - 1e-12))
    if cycle is not None:
        return _sample_positions(motion, np.arange(last + 1.0) * cycle, rounding)
    moments = [event.time - motion.start_time for event in motion.events]
    aim = tolerance
    while True:
        lines = receive_within(motion, 1, aim)
        near = np.round(np.append(lines.x[:-1] - motion.start_time, moments) / TIME_TICK)
        ticks = np.append(np.unique(near[near < last]), last)
        points = _sample_positions(motion, ticks * TIME_TICK, rounding)
        if points.error <= tolerance:
            return points
        if ticks.size > last:
            raise InputError(
                f"tolerance {tolerance:g} takes points nearer than 1 ms, or more digits than the "
                f"format has; accepted: {bound_text(points.error)} or more"
            )
        aim *= min(0.8, 0.9 * tolerance / points.error)


def _sample_positions(motion: JointTrajectory, time: FloatArray, rounding: float) -> StraightPoints:
    """Take positions at times since the start [s], and bound the error of lines between them."""
    if time.size > MAX_EXPORTED_POINTS:
        raise InputError(
            f"the motion takes {time.size} points; at most {MAX_EXPORTED_POINTS} are accepted"
        )
    clock = np.minimum(motion.start_time + time, motion.end_time)
    position = motion.position(clock)
    # the lines in pieces between the breaks of the motion
    fine = np.union1d(motion.breaks, clock)
    since = fine - motion.start_time
    lines = np.stack([np.interp(since, time, column) for column in position.T], axis=1)
    received = PiecewisePolynomial(two_point_coefficients(fine, (lines,)), fine)
    error = float(largest_difference(motion, received).max())
    return StraightPoints(motion, time, position, error + rounding)


def require_rest_at_ends(trajectory: JointTrajectory) -> None:
    """Check that a motion begins and ends at rest.

    Raises:
        ExportError: A joint moves there; the message has a remedy.
    """
    for time, where in ((trajectory.start_time, "starts"), (trajectory.end_time, "ends")):
        speeds = np.abs(trajectory.velocity(time))
        joint = int(speeds.argmax())
        if speeds[joint] > RESTING_SPEED:
            name, unit = trajectory.joint_names[joint], trajectory.joint_units[joint]
            raise ExportError(
                f"the motion {where} with joint {name!r} at {speeds[joint]:.3g} {unit}/s, and "
                "this format is for motions from rest to rest; add a waypoint with stop: true "
                f"{'before' if where == 'starts' else 'after'} it"
                f"{CONTINUE_ADVICE if where == 'starts' else ''}",
                joint=name,
                error=float(speeds[joint]),
                time=float(time),
            )
