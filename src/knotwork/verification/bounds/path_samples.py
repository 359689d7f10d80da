"""Samples of the tool and the nearest points of a path, and bounds between samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.extended_curve import stack_curves
from knotwork.curves.tool_paths.path_progress import track_arc_length
from knotwork.curves.tool_paths.rotations import rotation_angle
from knotwork.curves.tool_paths.task_frame import KnownJoints
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.joint_tree import JointTree, join_trees, joint_tree, make_serial_chain
from knotwork.verification.bounds.adaptive import VALUE_ROUNDING
from knotwork.verification.bounds.free_turn import free_angles
from knotwork.verification.bounds.link_motion import carrier_of, tree_motion
from knotwork.verification.bounds.rate_bounds import Intervals, joint_rates
from knotwork.waypoints import PoseFreedom

if TYPE_CHECKING:
    from knotwork.curves.tool_paths import TimedPath


class PathSamples(NamedTuple):
    """The tool at k times, and the nearest points of the path.

    Attributes:
        s: Arc lengths of the nearest points [m], shape (k,).
        distance: Distances of the tool from them [m], shape (k,).
        rotation_difference: Frobenius norm of the difference of the rotations, shape (k,).
        velocity: Velocity of the tool [m/s], shape (k, 3).
        tangent: Direction of the path, shape (k, 3).
        angles: Free turn, travel and work angle, see `free_angles` [rad], shape (k, 3).
    """

    s: FloatArray
    distance: FloatArray
    rotation_difference: FloatArray
    velocity: FloatArray
    tangent: FloatArray
    angles: FloatArray

    @property
    def angle(self) -> FloatArray:
        """Angles from the orientation of the path [rad], shape (k,)."""
        return rotation_angle(self.rotation_difference)

    @property
    def along_speed(self) -> FloatArray:
        """Speed along the path, negative backwards [m/s], shape (k,)."""
        return np.asarray((self.velocity * self.tangent).sum(axis=1))


class ToolMotionBounds(NamedTuple):
    """Bounds of the tool on n intervals, shape (n,) each.

    Attributes:
        acceleration: Acceleration of the tool [m/s²].
        jerk: Jerk of the tool [m/s³].
        spin: Angular speed of the tool [rad/s].
        rotation: Frobenius norm of the second derivative of the tool's rotation [1/s²].
        rounding: Rounding error of the tool's position [m], velocity [m/s] and rotation.
    """

    acceleration: FloatArray
    jerk: FloatArray
    spin: FloatArray
    rotation: FloatArray
    rounding: FloatArray


class PathStretch:
    """One stretch of a path, and the motion that follows it.

    Args:
        robot: The arm.
        curve: Joint positions, trailing shape (d,).
        timed_path: The path and its timing.
        start, end: Interval of the stretch [s].
        freedom: Freedom of the poses.
        clock: Time in the path's timing as a function of time in `curve`; by default they are the
            same. Only for paths without a clock of their own.

    Attributes:
        low, high: Arc lengths at the start and end of the stretch [m].
    """

    def __init__(
        self,
        robot: Robot,
        curve: PiecewisePolynomial,
        timed_path: TimedPath,
        start: float,
        end: float,
        freedom: PoseFreedom | None = None,
        clock: PiecewisePolynomial | None = None,
    ) -> None:
        self.robot, self.curve, self.timed_path, self.freedom = robot, curve, timed_path, freedom
        self.clock = clock
        self.tree, self.positions = joint_tree(robot.model), curve
        self.joint, self.lever = carrier_of(robot.model, robot.require_tool())
        if timed_path.has_own_clock:
            base, frame_joints = robot.base_placement.inverse(), timed_path.woven_frame.joints
            self.tree = tree_from(frame_joints, self.tree, base)
            self.joint += len(self.tree.parent) - 1 - robot.model.nv
            self.positions = append_joints(curve, frame_joints)
        self.low, self.high = self.timed_arc_length(np.array([start, end])).tolist()

    def timed_arc_length(self, t: FloatArray) -> FloatArray:
        """Arc lengths that the timing prescribes at times [s], shape (k,)."""
        times = t if self.clock is None else self.clock(t)
        return self.timed_path.arc_length(
            np.clip(times, self.timed_path.start_time, self.timed_path.end_time)
        )

    def sample(self, t: FloatArray) -> PathSamples:
        """Sample at increasing times from the start of the stretch [s], shape (k,)."""
        path = self.timed_path.tool_path
        tip, columns, J = joint_axes(self.robot).compute_poses_and_jacobians(self.curve(t))
        velocity = np.einsum("ijk,kj->ki", J[:3], self.curve(t, 1))
        position, rotation, velocity = self.timed_path.woven_frame.relative_motion(
            t, tip.T, columns.transpose(2, 1, 0), velocity
        )
        s = track_arc_length(path, position, self.timed_arc_length(t), (self.low, self.high))
        # at the end, the direction of this stretch, because the next one may have another direction
        inside = np.clip(s, self.low, np.nextafter(self.high, self.low))
        distance, rotation_difference = path.deviations(
            position, rotation, s, axis=self.freedom is not None
        )
        angles = np.zeros((len(s), 3))
        if self.freedom is not None:
            angles = free_angles(self.freedom, path.rotation(s), rotation)
        return PathSamples(
            s, distance, rotation_difference, velocity, path.derivatives(s, 1, inside)[1], angles
        )

    def bounds(self, t: FloatArray) -> ToolMotionBounds:
        """Bound the motion on the n intervals between increasing times [s], shape (n + 1,)."""
        middle = 0.5 * (t[1:] + t[:-1])
        breaks = self.positions.x
        piece = np.clip(np.searchsorted(breaks, middle) - 1, 0, len(breaks) - 2)
        start = np.maximum(t[:-1] - breaks[piece], 0.0)
        rates = joint_rates(self.positions, Intervals(piece, start, np.diff(t)))
        moved = tree_motion(self.tree, rates.bounds)
        point, rotation = moved.point(self.joint, self.lever), moved.rotation(self.joint)[1]
        spin = moved.angular[self.joint][0]
        turned = 1.0 + rates.size[self.tree.is_angle].sum(axis=0)
        rounding = VALUE_ROUNDING * turned * (point[0] + point[1] + 1.0)
        return ToolMotionBounds(point[2], point[3], spin, rotation, rounding)


def tree_from(frame_joints: Sequence[KnownJoints], arm: JointTree, root: Any) -> JointTree:
    """The joints of an arm relative to a moving frame at its placement with joints at 0.

    Args:
        frame_joints: Joints that move the frame, the outermost first.
        arm: The arm's joints.
        root: Placement of the root of the arm's URDF in the base frame, `pin.SE3`.

    Returns:
        The joints; positions are those of the arm, followed by those of the frame in order.
    """
    reversed_joints: list[tuple[Any, Any, bool, int]] = []
    placement = pin.SE3.Identity()
    for known in frame_joints:
        placement = placement * known.placement
    firsts = np.cumsum([0, *(len(known.is_revolute) for known in frame_joints)]).tolist()
    for known, first in reversed(list(zip(frame_joints, firsts, strict=False))):
        for k in reversed(range(len(known.is_revolute))):
            reversed_joints.append((placement, -known.axis[k], known.is_revolute[k], first + k))
            placement = pin.SE3.Identity()
        placement = placement * known.placement.inverse()
    placements, axes, turns, columns = zip(*reversed_joints, strict=True)
    carrier_chain, carried_by = make_serial_chain(placements, np.array(axes), turns), len(columns)
    tree = join_trees(carrier_chain, arm, placement * root, carried_by)
    count = len(arm.parent) - 1
    arm_columns = [column - carried_by for column in tree.column[carried_by + 1 :]]
    columns = -1, *(count + column for column in columns), *arm_columns
    return replace(tree, column=columns)


def append_joints(
    curve: PiecewisePolynomial, frame_joints: Sequence[KnownJoints]
) -> PiecewisePolynomial:
    """Positions of an arm's joints, followed by those of its frame, over the arm's time."""
    span = curve.x[[0, -1]].tolist()
    return stack_curves(curve, *(known.curve.between(*span) for known in frame_joints))
