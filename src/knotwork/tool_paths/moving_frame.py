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


class FrameState(NamedTuple):
    """How frames are placed and move in the base frame, at k times.

    Attributes:
        rotation: Shape (k, 3, 3).
        origin: [m], shape (k, 3).
        twist: Linear, of the origin, then angular, in base axes [m/s, rad/s], shape (k, 6).
        acceleration: Its derivative, shape (k, 6).
    """

    rotation: FloatArray
    origin: FloatArray
    twist: FloatArray
    acceleration: FloatArray

    def carried(self, local: FrameState) -> FrameState:
        """The state of what moves in the frames, from its state in their axes."""
        turn, spin = self.rotation, self.twist[:, 3:]
        linear, angular, bend, change = (
            np.einsum("kij,kj->ki", turn, one)
            for one in (*_halves(local.twist), *_halves(local.acceleration))
        )
        arm = np.einsum("kij,kj->ki", turn, local.origin)
        velocity = np.cross(spin, arm)
        pull = np.cross(self.acceleration[:, 3:], arm) + np.cross(spin, velocity + 2.0 * linear)
        return FrameState(
            turn @ local.rotation,
            self.origin + arm,
            self.twist + np.hstack((velocity + linear, angular)),
            self.acceleration + np.hstack((pull + bend, np.cross(spin, angular) + change)),
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
        arm, back = position - self.origin, self.rotation.transpose(0, 2, 1)
        slip = velocity - self.twist[:, :3] - np.cross(self.twist[:, 3:], arm)
        return (
            np.einsum("kij,kj->ki", back, arm),
            back @ rotation,
            np.einsum("kij,kj->ki", back, slip),
        )


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

    def state(self, t: ArrayLike) -> FrameState:
        """Placement, velocity and acceleration at times [s], shape (k,)."""
        times = np.asarray(t, dtype=float)
        found = _still(pin.SE3.Identity(), len(times))
        for one in self.joints:
            found = found.carried(_still(one.placement, len(times)))
            q, v, a = (one.curve(times, order) for order in range(3))
            if not any(one.turns):  # what only slides is one step
                found = found.carried(_slid(q @ one.axis, v @ one.axis, a @ one.axis))
                continue
            for axis, turns, *row in zip(one.axis, one.turns, q.T, v.T, a.T, strict=True):
                found = found.carried(_joint(axis, turns, *row))
        return found.carried(_still(self.placement, len(times)))

    def at(self, time: float) -> pin.SE3:
        """Placement in the base frame at a time [s]."""
        found = self.state([time])
        return pin.SE3(found.rotation[0], found.origin[0])

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
        one = _still(pose, 1)._replace(twist=np.array([twist.vector]))
        return pin.Motion(self.since_rest([time]).carried(one).twist[0])

    def since_rest(self, t: ArrayLike) -> FrameState:
        """`state` of what is at the base frame where all joints are at 0, and rides along."""
        times = np.asarray(t, dtype=float)
        return self.state(times).carried(_still(self.rest.inverse(), len(times)))


def woven(frame: MovingFrame | None, weave: EndlessCurve) -> MovingFrame:
    """A frame, or the base, with a motion added in base axes while it is at rest [m]."""
    frame = MovingFrame((), pin.SE3.Identity()) if frame is None else frame
    return frame.inside(frame.rest.inverse()).moved(np.eye(3), (False,) * 3, weave)


def _halves(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    return vectors[:, :3], vectors[:, 3:]


def _still(placement: pin.SE3, k: int) -> FrameState:
    nothing = np.zeros((k, 6))
    turn, shift = np.array(placement.rotation), np.array(placement.translation)
    return FrameState(np.tile(turn, (k, 1, 1)), np.tile(shift, (k, 1)), nothing, nothing)


def _slid(place: FloatArray, speed: FloatArray, change: FloatArray) -> FrameState:
    still, nothing = np.tile(np.eye(3), (len(place), 1, 1)), np.zeros((len(place), 3))
    return FrameState(still, place, np.hstack((speed, nothing)), np.hstack((change, nothing)))


def _joint(
    axis: FloatArray, turns: bool, q: FloatArray, v: FloatArray, a: FloatArray
) -> FrameState:
    """How a joint places and moves what it carries, in its own axes."""
    along, nothing = (rate[:, None] * axis for rate in (q, v, a)), np.zeros((len(q), 3))
    place, speed, change = along
    if not turns:
        return _slid(place, speed, change)
    turn = np.array([pin.exp3(row) for row in place]).reshape(-1, 3, 3)
    return FrameState(turn, nothing, np.hstack((nothing, speed)), np.hstack((nothing, change)))
