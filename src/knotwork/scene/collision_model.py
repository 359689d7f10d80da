"""`CollisionModel`: the bodies of a task, and the pairs of them that are checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.extended_curve import ExtendedCurve, stack_curves
from knotwork.curves.tool_paths.task_frame import KnownJoints, TaskFrame
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, place_joints
from knotwork.scene.bodies import Body

TOOL_BODY = "tool"

LAST_MOMENT = 1e-6
"""Time before the end [s] from which an object that appears at the last waypoint is checked."""


class Exclusion(Enum):
    """Reasons of the exclusion of a pair, as clauses of a message."""

    MOVE_TOGETHER = "they move as one"
    NEITHER_MOVES = "neither moves"
    NOT_MOVED_BY_ROBOT = "no joint of the robot moves one of them to the other"
    ADJACENT = "a joint joins them"
    CARRIED = "the tool carries it"
    BY_ROBOT = "the robot's file ignores it"
    BY_SRDF = "the SRDF disables it"
    ALLOWED = "the scenario allows it"
    IGNORED = "the scenario ignores it"
    SELF_CHECK_OFF = "the scenario says `self: false`"


class ExcludedPair(NamedTuple):
    """Two bodies excluded from the check.

    Attributes:
        first, second: Names of the bodies.
        exclusion: Reason of the exclusion.
        srdf_reason: Reason that the SRDF gives, if it excludes them; else empty.
    """

    first: str
    second: str
    exclusion: Exclusion
    srdf_reason: str = ""

    @property
    def reason(self) -> str:
        """Reason of the exclusion, as a clause."""
        return f"{self.exclusion.value}{self.srdf_reason and f' ({self.srdf_reason})'}"


class Pair(NamedTuple):
    """Two bodies that are checked for collisions.

    Attributes:
        first, second: Their indices among the bodies; the second one moves with the robot.
        required_clearance: Required clearance [m].
        involves_scene: Whether one of them belongs to the scene, so that `way: clear` may help.
    """

    first: int
    second: int
    required_clearance: float
    involves_scene: bool


FrameCarriers = Mapping[tuple[str, tuple[KnownJoints, ...]], tuple[int, Any]]


def find_carrier(
    carriers: FrameCarriers, frame: TaskFrame, time: float | None = None
) -> tuple[int, Any]:
    """Find the joint that carries a frame, and the transform of base poses into its axes.

    Args:
        carriers: Attribute of `CollisionModel`.
        frame: The frame.
        time: Time of the poses [s]; by default they are given at rest.
    """
    joint, placement = carriers[frame.link, frame.joints]
    joint_axes = TaskFrame(frame.joints)
    at = joint_axes.rest_placement if time is None else joint_axes.placement_at(time)
    return joint, placement * at.inverse()


@dataclass(frozen=True, eq=False)
class CollisionModel:
    """Bodies of a task, and the pairs of them that are checked.

    Attributes:
        tree: The robot's joints, and those of known motions.
        bodies: All bodies.
        pairs: Pairs to check.
        excluded: Pairs of bodies that are not checked, with the reason.
        missing_shapes_notes: Sentences on links whose shapes are not available.
        bare: Names of links with visual shapes but no collision shapes.
        known_motions: Positions over time of the joints that follow the robot's in `tree`.
        carriers: For each frame, by its link and joints, the joint that carries it and the
            placement of its link in that joint's axes, `pin.SE3`.
        robots: Each other robot by name: its `Robot`, and the joint of its root, which its own
            joints follow.
    """

    tree: JointTree
    bodies: tuple[Body, ...]
    pairs: tuple[Pair, ...]
    excluded: tuple[ExcludedPair, ...]
    missing_shapes_notes: tuple[str, ...] = ()
    bare: tuple[str, ...] = ()
    known_motions: tuple[ExtendedCurve, ...] = ()
    carriers: FrameCarriers = field(default_factory=dict)
    robots: Mapping[str, tuple[Robot, int]] = field(default_factory=dict)

    @property
    def presence(self) -> FloatArray:
        """Time interval of the presence of each pair of bodies [s], shape (p, 2)."""
        bodies = [(self.bodies[pair.first], self.bodies[pair.second]) for pair in self.pairs]
        presence = [(max(a.start, b.start), min(a.end, b.end)) for a, b in bodies]
        return np.array(presence).reshape(-1, 2)

    def presence_within(self, start: float, end: float) -> FloatArray:
        """Time intervals in which pairs of bodies are checked during a motion [s], shape (p, 2).

        An interval without length is not checked: an object that is taken at the first waypoint, or
        released at the last one, counts as held there. Other objects that appear at the end are
        checked from `LAST_MOMENT` before it.

        Args:
            start: First time of the motion [s].
            end: Last time of the motion [s].
        """
        present, bodies = self.presence, self.bodies
        held = {body.name for body in bodies if body.kind == "held"}
        released = {i for i, body in enumerate(bodies) if body.name in held and body.kind != "held"}
        is_new = np.array([not released & {pair.first, pair.second} for pair in self.pairs], bool)
        appears, disappears = present.T
        is_last = is_new & (np.abs(appears - end) <= LAST_MOMENT) & (disappears > appears)
        presence = present.clip(start, end)
        presence[is_last] = end - LAST_MOMENT, end
        return presence

    def all_positions(self, curve: PiecewisePolynomial) -> PiecewisePolynomial:
        """Positions of all joints over the time of a robot's motion, trailing shape (d,)."""
        if not self.known_motions:
            return curve
        span = curve.x[[0, -1]].tolist()
        return stack_curves(curve, *(known.between(*span) for known in self.known_motions))

    def joint_placements(self, q: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotations and origins of all joints, as for `place_joints`.

        Args:
            q: Positions of the robot's joints [rad or m], shape (k, d).
            time: Times [s], shape (k,).
        """
        return place_joints(
            self.tree, np.hstack((q, *(known(time) for known in self.known_motions)))
        )

    @property
    def bare_links_note(self) -> str:
        """A sentence on links without collision shapes; empty if there are none."""
        *first, last = self.bare or ("",)
        if not first:
            text = f"link {last} has no collision shapes and is not checked for collisions"
            return text if last else ""
        listed = f"{', '.join(first)} and {last}"
        return f"links {listed} have no collision shapes and are not checked for collisions"

    @property
    def excluded_pairs_notes(self) -> list[str]:
        """A sentence for each reason why pairs that move relative to each other are excluded."""
        pairs: dict[str, list[str]] = {}
        for pair in self.excluded:
            if pair.exclusion not in (Exclusion.MOVE_TOGETHER, Exclusion.NEITHER_MOVES):
                pairs.setdefault(pair.reason, []).append(f"{pair.first} and {pair.second}")
        return [
            f"not checked, since {reason}: {'; '.join(named)}" for reason, named in pairs.items()
        ]
