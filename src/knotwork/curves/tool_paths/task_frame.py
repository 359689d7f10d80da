"""`TaskFrame`: a frame at rest, or moved by joints with known positions over time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.extended_curve import ExtendedCurve
from knotwork.curves.tool_paths.rotations import multiply


@dataclass(frozen=True, eq=False)
class KnownJoints:
    """Consecutive joints with a common origin and known positions over time.

    Attributes:
        placement: `pin.SE3` of their axes at position 0, in those of the joint before them.
        axis: Unit vector of each joint in these axes, shape (e, 3).
        is_revolute: Whether each joint is revolute; otherwise prismatic.
        curve: Joint positions over time [rad or m].
        name: Name of the frame that they move.
    """

    placement: pin.SE3
    axis: FloatArray
    is_revolute: tuple[bool, ...]
    curve: ExtendedCurve
    name: str = ""


class ToolMotion(NamedTuple):
    """Pose and motion of a tool at k times.

    Attributes:
        position: Positions [m], shape (k, 3).
        rotation: Rotations, shape (k, 3, 3).
        twist: Twists, linear, then angular [m/s, rad/s], shape (k, 6).
        acceleration: Derivatives of the twists, shape (k, 6).
    """

    position: FloatArray
    rotation: FloatArray
    twist: FloatArray
    acceleration: FloatArray


class FrameDerivatives(NamedTuple):
    """Homogeneous matrices of a moving frame and their time derivatives, at k times.

    Attributes:
        matrix: Matrices [m], shape (k, 4, 4).
        rate: First derivatives, shape (k, 4, 4).
        change: Second derivatives, shape (k, 4, 4).
    """

    matrix: FloatArray
    rate: FloatArray
    change: FloatArray

    def with_placement(self, placement: pin.SE3) -> FrameDerivatives:
        """Motion of a frame fixed in this one."""
        return FrameDerivatives(*(X @ placement.homogeneous for X in self))

    def compose(self, inner: FrameDerivatives) -> FrameDerivatives:
        """The motion of a frame from its motion in this one, by the product rule."""
        X, dX, ddX = self
        Y, dY, ddY = inner
        return FrameDerivatives(X @ Y, dX @ Y + X @ dY, ddX @ Y + 2.0 * dX @ dY + X @ ddY)


@dataclass(frozen=True, eq=False)
class TaskFrame:
    """A frame at rest or in motion, relative to a link of the robot or the cell.

    Its fixed points are given in two ways: at a time, and at rest, with all joints at 0.

    Attributes:
        joints: Joints that move the frame, the outermost first; none for a frame at rest.
        placement: `pin.SE3` in the axes of the last joint.
        link: Link of the robot that carries the frame with its joints; empty for the cell.
    """

    joints: tuple[KnownJoints, ...] = ()
    placement: pin.SE3 = field(default_factory=pin.SE3.Identity)
    link: str = ""

    @property
    def is_moving(self) -> bool:
        """Whether joints move the frame relative to its link or the cell."""
        return bool(self.joints)

    def rests_on(self, link: str) -> bool:
        """Whether the frame is at rest relative to a link, or to the cell if the name is empty."""
        return not self.joints and self.link == link

    @property
    def rest_placement(self) -> pin.SE3:
        """Placement in the base frame where all joints are at 0."""
        placed = pin.SE3.Identity()
        for joints in self.joints:
            placed = placed * joints.placement
        return placed * self.placement

    def inside(self, placement: pin.SE3) -> TaskFrame:
        """A frame fixed in this one."""
        return replace(self, placement=self.placement * placement)

    def with_joints(
        self, axis: FloatArray, is_revolute: tuple[bool, ...], curve: ExtendedCurve, name: str = ""
    ) -> TaskFrame:
        """This frame with joints added at its origin; arguments of `KnownJoints`."""
        added = KnownJoints(self.placement, axis, is_revolute, curve, name)
        return TaskFrame((*self.joints, added), pin.SE3.Identity(), self.link)

    def motion(self, t: ArrayLike, placement: pin.SE3 | None = None) -> FrameDerivatives:
        """Motion at times (k,) [s] of the frame, or of another placement in the last axes."""
        times = np.asarray(t, dtype=float)
        zeros = np.zeros((len(times), 4, 4))
        frame = FrameDerivatives(zeros + np.eye(4), zeros, zeros)
        for joints in self.joints:
            frame = frame.with_placement(joints.placement)
            rows = (joints.curve(times, order).T for order in range(3))
            for axis, is_revolute, *row in zip(joints.axis, joints.is_revolute, *rows, strict=True):
                frame = frame.compose(_joint_motion(axis, is_revolute, *row))
        return frame.with_placement(self.placement if placement is None else placement)

    def placement_at(self, time: float) -> pin.SE3:
        """Placement in the base frame at a time [s]."""
        return pin.SE3(self.motion([time]).matrix[0])

    def pose_at(self, pose: pin.SE3, time: float) -> pin.SE3:
        """Pose at a time [s] of a pose fixed in the frame, given at rest."""
        if not self.joints:
            return pose
        return self.placement_at(time) * self.rest_placement.actInv(pose)

    def pose_at_rest(self, pose: pin.SE3, time: float) -> pin.SE3:
        """Inverse of `pose_at`."""
        if not self.joints:
            return pose
        return self.rest_placement * self.placement_at(time).actInv(pose)

    def tool_at(self, t: ArrayLike, tool: ToolMotion) -> ToolMotion:
        """Motion at times (k,) [s] of a tool that moves in the frame, given at rest."""
        if not self.joints:
            return tool
        X, dX, ddX = self._since_rest(t)
        R, dR, ddR = (matrix[:, :3, :3] for matrix in (X, dX, ddX))
        p, dp, ddp = (matrix[:, :3, 3] for matrix in (X, dX, ddX))
        r, v, w = tool.position, tool.twist[:, :3], tool.twist[:, 3:]
        a, b = tool.acceleration[:, :3], tool.acceleration[:, 3:]
        inverse = R.transpose(0, 2, 1)
        linear = multiply(dR, r) + dp + multiply(R, v)
        angular = _skew_vector(dR @ inverse) + multiply(R, w)
        linear_acceleration = multiply(ddR, r) + ddp + 2.0 * multiply(dR, v) + multiply(R, a)
        angular_acceleration = _skew_vector(ddR @ inverse) + multiply(dR, w) + multiply(R, b)
        return ToolMotion(
            multiply(R, r) + p,
            R @ tool.rotation,
            np.hstack((linear, angular)),
            np.hstack((linear_acceleration, angular_acceleration)),
        )

    def twist_at(self, pose: pin.SE3, twist: pin.Motion, time: float) -> pin.Motion:
        """Velocity at a time [s] of a tool with a pose and a twist in the frame, given at rest."""
        position, rotation = np.array(pose.translation), np.array(pose.rotation)
        tool = ToolMotion(position[None], rotation[None], twist.vector[None], np.zeros((1, 6)))
        return pin.Motion(self.tool_at([time], tool).twist[0])

    def relative_motion(
        self, t: ArrayLike, position: FloatArray, rotation: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Motion of tools relative to the frame, as if it were at rest.

        Args:
            t: Times [s], shape (k,).
            position: Positions in the base frame [m], shape (k, 3).
            rotation: Rotations, shape (k, 3, 3).
            velocity: Velocities [m/s], shape (k, 3).
        """
        if not self.joints:
            return position, rotation, velocity
        X, dX, _ = self._since_rest(t)
        inverse = X[:, :3, :3].transpose(0, 2, 1)
        local = multiply(inverse, position - X[:, :3, 3])
        slip = velocity - dX[:, :3, 3] - multiply(dX[:, :3, :3], local)
        return local, inverse @ rotation, multiply(inverse, slip)

    def _since_rest(self, t: ArrayLike) -> FrameDerivatives:
        """`motion` of the frame that coincides with the base frame at rest."""
        return self.motion(t, self.placement * self.rest_placement.inverse())


BASE_FRAME = TaskFrame()


def add_weave(frame: TaskFrame, weave: ExtendedCurve) -> TaskFrame:
    """Add a motion to a frame, in base axes at rest [m]."""
    return frame.inside(frame.rest_placement.inverse()).with_joints(np.eye(3), (False,) * 3, weave)


def _skew_vector(matrices: FloatArray) -> FloatArray:
    """Extract the vectors of the skew-symmetric parts of matrices."""
    differences = [matrices[:, k - 1, k - 2] - matrices[:, k - 2, k - 1] for k in range(3)]
    return np.stack(differences, 1) / 2


def _joint_motion(
    axis: FloatArray, is_revolute: bool, q: FloatArray, v: FloatArray, a: FloatArray
) -> FrameDerivatives:
    """Motion of the frame behind a joint, in the joint's axes."""
    placement = np.tile(np.eye(4), (len(q), 1, 1))
    rate, change = np.zeros_like(placement), np.zeros_like(placement)
    if is_revolute:
        skew = pin.skew(axis)
        turn = np.array([pin.exp3(angle * axis) for angle in q]).reshape(-1, 3, 3)
        v, a = v[:, None, None], a[:, None, None]
        placement[:, :3, :3], rate[:, :3, :3] = turn, v * skew @ turn
        change[:, :3, :3] = (a * skew + v**2 * (skew @ skew)) @ turn
    else:
        for matrix, row in ((placement, q), (rate, v), (change, a)):
            matrix[:, :3, 3] = row[:, None] * axis
    return FrameDerivatives(placement, rate, change)
