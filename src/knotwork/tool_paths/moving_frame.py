"""`MovingFrame`: a frame that known motions carry, one on another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.polynomial.endless import EndlessCurve
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class KnownJoints:
    """Joints one after the other, all at one origin, whose positions are known at all times.

    Attributes:
        placement: `pin.SE3` of their axes at position 0, in what carries them.
        axis: Of each, in these axes, of length 1, shape (e, 3).
        turns: Which of them turn; others slide.
        curve: Their positions [rad or m].
    """

    placement: pin.SE3
    axis: FloatArray
    turns: tuple[bool, ...]
    curve: EndlessCurve


class ToolMotion(NamedTuple):
    """How a tool is placed and moves, at k times.

    Attributes:
        position: [m], shape (k, 3).
        rotation: Shape (k, 3, 3).
        twist: Linear, then angular [m/s, rad/s], shape (k, 6).
        acceleration: Its derivative, shape (k, 6).
    """

    position: FloatArray
    rotation: FloatArray
    twist: FloatArray
    acceleration: FloatArray


class FrameMotion(NamedTuple):
    """Homogeneous matrices of a frame that moves, and their derivatives in time, at k times.

    Attributes:
        place: Shape (k, 4, 4) [m].
        rate: Its derivative, shape (k, 4, 4).
        change: The derivative of that, shape (k, 4, 4).
    """

    place: FloatArray
    rate: FloatArray
    change: FloatArray

    def fixed(self, placement: pin.SE3) -> FrameMotion:
        """The motion of a frame that rides along at a place."""
        return FrameMotion(*(one @ placement.homogeneous for one in self))

    def carried(self, other: FrameMotion) -> FrameMotion:
        """The motion of a frame, from its motion in this one: the product rule."""
        X, dX, ddX = self
        Y, dY, ddY = other
        return FrameMotion(X @ Y, dX @ Y + X @ dY, ddX @ Y + 2.0 * dX @ dY + X @ ddY)

    def carried_tool(self, tool: ToolMotion) -> ToolMotion:
        """The motion of a tool, from its motion in the frame."""
        turn, turning, bending = (one[:, :3, :3] for one in self)
        shift, sliding, pull = (one[:, :3, 3] for one in self)
        r, (v, w), (a, b) = tool.position, _halves(tool.twist), _halves(tool.acceleration)
        back = turn.transpose(0, 2, 1)
        linear = _times(turning, r) + sliding + _times(turn, v)
        angular = _vector(turning @ back) + _times(turn, w)
        faster = _times(bending, r) + pull + 2.0 * _times(turning, v) + _times(turn, a)
        spin = _vector(bending @ back) + _times(turning, w) + _times(turn, b)
        return ToolMotion(
            _times(turn, r) + shift,
            turn @ tool.rotation,
            np.hstack((linear, angular)),
            np.hstack((faster, spin)),
        )

    def seen(
        self, position: FloatArray, rotation: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Points [m], rotations and velocities [m/s] of the base frame, as they are in the frames.

        Args:
            position: Shape (k, 3).
            rotation: Shape (k, 3, 3).
            velocity: Shape (k, 3).
        """
        back = self.place[:, :3, :3].transpose(0, 2, 1)
        place = _times(back, position - self.place[:, :3, 3])
        slip = velocity - self.rate[:, :3, 3] - _times(self.rate[:, :3, :3], place)
        return place, back @ rotation, _times(back, slip)


@dataclass(frozen=True, eq=False)
class MovingFrame:
    """A frame in motion.

    Attributes:
        joints: What carries it, the outermost first; none if it stands.
        placement: `pin.SE3` in the axes of the last of them.
        link: Link of the robot that carries all this; empty for the base.
    """

    joints: tuple[KnownJoints, ...]
    placement: pin.SE3
    link: str = ""

    @property
    def moves(self) -> bool:
        """Whether anything carries it."""
        return bool(self.joints)

    @property
    def rest(self) -> pin.SE3:
        """Placement in the base frame where all joints are at 0."""
        placed = pin.SE3.Identity()
        for one in self.joints:
            placed = placed * one.placement
        return placed * self.placement

    def inside(self, placement: pin.SE3) -> MovingFrame:
        """A frame that is placed in this one and rides along."""
        return replace(self, placement=self.placement * placement)

    def moved(self, axis: FloatArray, turns: tuple[bool, ...], curve: EndlessCurve) -> MovingFrame:
        """This frame with joints of its own at its origin; arguments as of `KnownJoints`."""
        own = KnownJoints(self.placement, axis, turns, curve)
        return MovingFrame((*self.joints, own), pin.SE3.Identity(), self.link)

    def motion(self, t: ArrayLike, placement: pin.SE3 | None = None) -> FrameMotion:
        """Its motion at times [s], shape (k,); or that of another placement in the last axes."""
        times = np.asarray(t, dtype=float)
        nothing = np.zeros((len(times), 4, 4))
        found = FrameMotion(nothing + np.eye(4), nothing, nothing)
        for one in self.joints:
            found = found.fixed(one.placement)
            rows = (one.curve(times, order).T for order in range(3))
            for axis, turns, *row in zip(one.axis, one.turns, *rows, strict=True):
                found = found.carried(_joint(axis, turns, *row))
        return found.fixed(self.placement if placement is None else placement)

    def at(self, time: float) -> pin.SE3:
        """Placement in the base frame at a time [s]."""
        return pin.SE3(self.motion([time]).place[0])

    def carried(self, pose: pin.SE3, time: float) -> pin.SE3:
        """Where a pose is at a time [s] that rides along, given while the frame is at rest."""
        return self.at(time) * self.rest.actInv(pose)

    def uncarried(self, pose: pin.SE3, time: float) -> pin.SE3:
        """The pose that `carried` brings to a given one."""
        return self.rest * self.at(time).actInv(pose)

    def carried_twist(self, pose: pin.SE3, twist: pin.Motion, time: float) -> pin.Motion:
        """Velocity of a tool that moves in the frame, in base axes.

        Args:
            pose: Of the tool while the frame is at rest.
            twist: Of the tool in the frame, in base axes while it is at rest.
            time: When [s].
        """
        position, rotation = np.array(pose.translation), np.array(pose.rotation)
        tool = ToolMotion(position[None], rotation[None], twist.vector[None], np.zeros((1, 6)))
        return pin.Motion(self.since_rest([time]).carried_tool(tool).twist[0])

    def since_rest(self, t: ArrayLike) -> FrameMotion:
        """`motion` of what is at the base frame where all joints are at 0, and rides along."""
        return self.motion(t, self.placement * self.rest.inverse())


def woven(frame: MovingFrame | None, weave: EndlessCurve) -> MovingFrame:
    """A frame, or the base, with a motion added in base axes while it is at rest [m]."""
    frame = MovingFrame((), pin.SE3.Identity()) if frame is None else frame
    return frame.inside(frame.rest.inverse()).moved(np.eye(3), (False,) * 3, weave)


def _halves(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    return vectors[:, :3], vectors[:, 3:]


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    return (matrices @ vectors[:, :, None])[..., 0]


def _vector(matrices: FloatArray) -> FloatArray:
    """The vectors of the skew-symmetric parts of matrices."""
    return (
        np.stack([matrices[:, k - 1, k - 2] - matrices[:, k - 2, k - 1] for k in range(3)], 1) / 2
    )


def _joint(
    axis: FloatArray, turns: bool, q: FloatArray, v: FloatArray, a: FloatArray
) -> FrameMotion:
    """How a joint places and moves what it carries, in its own axes."""
    place = np.tile(np.eye(4), (len(q), 1, 1))
    rate, change = np.zeros_like(place), np.zeros_like(place)
    if turns:
        skew = pin.skew(axis)
        turn = np.array([pin.exp3(angle * axis) for angle in q]).reshape(-1, 3, 3)
        v, a = v[:, None, None], a[:, None, None]
        place[:, :3, :3], rate[:, :3, :3] = turn, v * skew @ turn
        change[:, :3, :3] = (a * skew + v**2 * (skew @ skew)) @ turn
    else:
        for matrix, row in ((place, q), (rate, v), (change, a)):
            matrix[:, :3, 3] = row[:, None] * axis
    return FrameMotion(place, rate, change)
