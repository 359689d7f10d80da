"""Pairs of bodies checked for collisions, and the reasons of excluded ones."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from knotwork.errors import DocumentError, InputError
from knotwork.files.documents import parse_xml, read_text
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree
from knotwork.robot.urdf import MAX_URDF_BYTES, MAX_URDF_ELEMENTS
from knotwork.robot.urdf_rules import child_elements
from knotwork.scene.bodies import Body
from knotwork.scene.collision_model import (
    MOVE_TOGETHER,
    NEITHER_MOVES,
    IgnoredPair,
    NoteKind,
    Pair,
)
from knotwork.scene.robot_geometry import RobotGeometry, Touching, touching_pairs
from knotwork.scene.rules import ALLOWED, Reasons
from knotwork.task.scenario import Scene

ADJACENT = "a joint joins them"
CARRIED = "the tool carries it"
BY_ROBOT = "the robot's file ignores it"
OBJECT_KIND = "object"
NOT_ITSELF = "the scenario says `self: false`"
NOT_OURS = "no joint of the robot moves one of them to the other"


class Pairing:
    """Chooses the pairs of bodies to check.

    Args:
        robot: The robot.
        joints: Its joints, followed by those of known motions.
        scene: The surroundings, and the rules of the check.
        geometry: Its links, and the touching pairs of them.
        given: Reasons given by the scenario, by the identities of the two bodies.

    Attributes:
        notes: Plausible mistakes, and excluded pairs.
    """

    def __init__(
        self,
        robot: Robot,
        joints: JointTree,
        scene: Scene,
        geometry: RobotGeometry,
        given: Reasons,
    ) -> None:
        self.robot, self.scene, self.geometry, self.given = robot, scene, geometry, given
        self.own = joints.carriers[:, : len(geometry.joints.parent)]
        self.notes: list[tuple[NoteKind, str]] = []
        self.joined = robot.joined_links
        self.held = {item.name for item in scene.held}

    def pairs(self, bodies: Sequence[Body]) -> tuple[list[Pair], list[IgnoredPair]]:
        """Give the checked pairs, and the excluded ones with the reason."""
        pairs, ignored = [], []
        touching, by_files = self._touching_pairs(bodies), self._reasons_of_files()
        for i, first in enumerate(bodies):
            for j in range(i + 1, len(bodies)):
                second = bodies[j]
                if first.start >= second.end or second.start >= first.end:
                    continue
                together = first.joint == second.joint and first.kind == second.kind
                if together:
                    continue  # links of one part
                reason = self._reason(first, second, by_files)
                if reason is None and (i, j) in touching:
                    self._note_touching(first, second, touching[i, j])
                if reason is not None:
                    ignored.append(IgnoredPair(self._whose(first), self._whose(second), reason))
                    continue
                around = OBJECT_KIND in (first.kind, second.kind)
                second_moves = second.kind != OBJECT_KIND if around else bool(second.joint)
                order = (i, j) if second_moves else (j, i)
                pairs.append(Pair(*order, self.scene.margin if around else 0.0, around))
        return pairs, [pair for pair in dict.fromkeys(ignored) if pair.first != pair.second]

    def _whose(self, body: Body) -> str:
        """The name of a body, or of the other robot whose body it is."""
        robots = (
            robot.name for robot in self.scene.robots if body.name.startswith(f"{robot.name}/")
        )
        return next(robots, body.name) if body.kind == OBJECT_KIND else body.name

    def _reason(self, first: Body, second: Body, by_files: Reasons) -> str | None:
        """Reason why two bodies are always excluded."""
        if first.joint == second.joint:
            return MOVE_TOGETHER if first.joint else NEITHER_MOVES
        kinds = {first.kind, second.kind}
        if kinds <= {"link", "tool"} and not self.scene.rules.itself:
            return NOT_ITSELF
        reason = self.given.get(frozenset((first.identity, second.identity)))
        apart = first.apart or second.apart
        if reason is not None and not (reason == ALLOWED and apart):
            return reason  # only the gripper may touch an object, and only during this time
        if kinds == {OBJECT_KIND} and (self.own[first.joint] == self.own[second.joint]).all():
            return NOT_OURS
        if kinds == {"link"}:
            links = frozenset((first.link, second.link))
            return by_files.get(links) or (ADJACENT if links in self.joined else None)
        carried = "tool" in kinds and "link" not in kinds and {first.name, second.name} & self.held
        return CARRIED if carried and not apart else None

    def _note_touching(self, first: Body, second: Body, depth: float) -> None:
        """Warn that the robot or its tool touches itself at home, with the depth."""
        self.notes.append(
            (
                "warning",
                f"{second.name} and {first.name} touch at home, {1000 * depth:.3g} mm deep, and "
                "are checked; a shape may be in a wrong place or unit, or, if their shapes overlap "
                "by design, take the pair out with "
                f"`collisions: {{ignore: [[{second.name}, {first.name}]]}}`",
            )
        )

    def _reasons_of_files(self) -> Reasons:
        """Reasons in the robot's file and its SRDF for links, by the names of the pair."""
        reasons: Reasons = {}
        robot = self.robot
        if robot.srdf is not None:
            disabled = disabled_pairs(robot.srdf, robot.srdf.stat().st_mtime_ns)
            links = {*robot.frame_names}
            unknown = dict.fromkeys(
                name for pair in disabled for name in pair[:2] if name not in links
            )
            if unknown:
                fault = f"{robot.srdf} disables pairs of links that {robot.name!r} does not have"
                self.notes.append(("warning", f"{fault}: {', '.join(map(repr, unknown))}"))
            for first, second, why in disabled:
                text = f" ({why})" if why else ""
                reasons[frozenset((first, second))] = f"the SRDF disables it{text}"
        shaped = {body.link for body in self.geometry.links.bodies}
        bare = dict.fromkeys(n for pair in robot.ignored_pairs for n in pair if n not in shaped)
        if bare:
            named = ", ".join(map(repr, bare))
            fault = f"{robot.source}: collision.ignore names links without collision shapes"
            self.notes.append(("warning", f"{fault}, which changes nothing: {named}"))
        return reasons | {frozenset(pair): BY_ROBOT for pair in robot.ignored_pairs}

    def _touching_pairs(self, bodies: Sequence[Body]) -> Touching:
        """Pairs of the robot's links and its tool that touch at its home, by their indices."""
        tools = [i for i, body in enumerate(bodies) if body.kind == "tool"]
        pairs = [(i, j) for i in range(len(self.geometry.links.bodies)) for j in tools]
        return self.geometry.touching | touching_pairs(
            self.geometry.joints, bodies, pairs, self.robot
        )


@lru_cache(maxsize=32)
def disabled_pairs(path: Path, changed: int) -> tuple[tuple[str, str, str], ...]:
    """Read two links and the reason of each excluded pair.

    Args:
        path: The SRDF.
        changed: Time of its last change, the key of the cache.

    Raises:
        InputError: The file can't be read, or is not an SRDF.
    """
    try:
        text = read_text(path, max_bytes=MAX_URDF_BYTES)
        root = parse_xml(text.encode(), MAX_URDF_ELEMENTS).documentElement
    except DocumentError:
        raise
    except InputError as error:
        raise InputError(f"{path} is not an SRDF: {error}") from error
    if root is None or root.tagName != "robot":
        raise InputError(f"{path} is not an SRDF: its outermost element is not <robot>")
    return tuple(
        (
            element.getAttribute("link1"),
            element.getAttribute("link2"),
            element.getAttribute("reason").lower(),
        )
        for element in child_elements(root, "disable_collisions")
    )
