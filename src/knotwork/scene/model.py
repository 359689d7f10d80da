"""The collision model of a task: its bodies, and which pairs of them are checked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

from knotwork.robot.joint_tree import JointTree
from knotwork.scene.bodies import Body
from knotwork.scene.distances import DistanceMeter

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


@dataclass(frozen=True, eq=False)
class CollisionModel:
    """Bodies, and the pairs of them that are checked.

    Attributes:
        joints: The robot's joints.
        bodies: All bodies.
        pairs: Pairs to check.
        ignored: Pairs of bodies that are not checked, with the reason.
        missing: Sentences on links whose shapes can't be had.
        bare: Names of links that have shapes to be seen, but none for collisions.
        notes: Plausible slips, and pairs that are not checked: `"warning"` or `"information"`, and
            the sentence.
    """

    joints: JointTree
    bodies: tuple[Body, ...]
    pairs: tuple[Pair, ...]
    ignored: tuple[IgnoredPair, ...]
    missing: tuple[str, ...] = ()
    bare: tuple[str, ...] = ()
    notes: tuple[tuple[NoteKind, str], ...] = ()

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
