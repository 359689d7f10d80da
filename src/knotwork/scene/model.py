"""The collision model of a task: its bodies, and which pairs of them are checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.endless import EndlessCurve, side_by_side
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, place_joints
from knotwork.scene.bodies import Body
from knotwork.scene.distances import DistanceMeter
from knotwork.tool_paths.moving_frame import KnownJoints, MovingFrame
from knotwork.waypoints import FloatArray

NoteKind = Literal["warning", "information"]

TOOL = "tool"

MOVE_TOGETHER = "they move as one"
NEITHER_MOVES = "neither moves"


class IgnoredPair(NamedTuple):
    """Two bodies that are not checked against one another.

    Attributes:
        first, second: Their names.
        reason: Why not.
    """

    first: str
    second: str
    reason: str


class Pair(NamedTuple):
    """Two bodies that are checked against one another.

    Attributes:
        first, second: Their places among the bodies; the second one moves with the robot.
        margin: Clearance to keep [m].
        around: One of them stands around, so that the motion can be led past it.
    """

    first: int
    second: int
    margin: float
    around: bool


Carriers = Mapping[tuple[str, tuple[KnownJoints, ...]], tuple[int, Any]]


def riding(carriers: Carriers, frame: MovingFrame, time: float | None = None) -> tuple[int, Any]:
    """The joint that carries a frame, and what brings poses of the base to its axes.

    Args:
        carriers: As `CollisionModel` has them.
        frame: One of them.
        time: When the poses are meant [s]; by default where the frame's joints are at 0.
    """
    joint, placement = carriers[frame.link, frame.joints]
    joint_axes = MovingFrame(frame.joints, pin.SE3.Identity())
    at = joint_axes.rest if time is None else joint_axes.at(time)
    return joint, placement * at.inverse()


@dataclass(frozen=True, eq=False)
class CollisionModel:
    """Bodies, and the pairs of them that are checked.

    Attributes:
        joints: The robot's joints, and those of what moves as it is known to.
        bodies: All bodies.
        pairs: Pairs to check.
        ignored: Pairs of bodies that are not checked, with the reason.
        missing: Sentences on links whose shapes can't be had.
        bare: Names of links that have shapes to be seen, but none for collisions.
        notes: Plausible slips, and pairs that are not checked: `"warning"` or `"information"`, and
            the sentence.
        known: Positions of the joints that follow the robot's.
        carriers: What carries what rides along with a moving frame, by its `key`: a joint, and
            `pin.SE3` of its link, in its axes.
        robots: Of each other robot by name its `Robot`, and the joint that is its root; its own
            follow it.
    """

    joints: JointTree
    bodies: tuple[Body, ...]
    pairs: tuple[Pair, ...]
    ignored: tuple[IgnoredPair, ...]
    missing: tuple[str, ...] = ()
    bare: tuple[str, ...] = ()
    notes: tuple[tuple[NoteKind, str], ...] = ()
    known: tuple[EndlessCurve, ...] = ()
    carriers: Carriers = field(default_factory=dict)
    robots: Mapping[str, tuple[Robot, int]] = field(default_factory=dict)

    def whole(self, curve: PiecewisePolynomial) -> PiecewisePolynomial:
        """Positions of all joints over the time of the robot's, trailing shape (d,)."""
        if not self.known:
            return curve
        span = curve.x[[0, -1]].tolist()
        return side_by_side(curve, *(one.between(*span) for one in self.known))

    def placed(self, q: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotations and origins of all joints, as `place_joints` gives them.

        Args:
            q: Positions of the robot's joints [rad or m], shape (k, d).
            time: When [s], shape (k,).
        """
        return place_joints(self.joints, np.hstack((q, *(one(time) for one in self.known))))

    def riding(self, frame: MovingFrame, time: float | None = None) -> tuple[int, Any]:
        """The joint that carries a moving frame, and what brings poses of the base to its axes.

        Args:
            frame: One that carries something in the scene.
            time: When the poses are meant [s]; by default where the frame's joints are at 0.
        """
        return riding(self.carriers, frame, time)

    @property
    def bare_links_note(self) -> str:
        """A sentence on the links that have no collision shapes, or nothing if all have."""
        *others, last = self.bare or ("",)
        if not others:
            text = f"link {last} has no collision shapes and is not checked for collisions"
            return text if last else ""
        listed = f"{', '.join(others)} and {last}"
        return f"links {listed} have no collision shapes and are not checked for collisions"

    @property
    def ignored_pairs_notes(self) -> list[str]:
        """A sentence for each reason why pairs that move to one another are not checked."""
        pairs: dict[str, list[str]] = {}
        for one in self.ignored:
            if one.reason not in (MOVE_TOGETHER, NEITHER_MOVES):
                pairs.setdefault(one.reason, []).append(f"{one.first} and {one.second}")
        return [f"not checked, as {reason}: {'; '.join(named)}" for reason, named in pairs.items()]

    @cached_property
    def meter(self) -> DistanceMeter:
        """Measures distances."""
        return DistanceMeter()
