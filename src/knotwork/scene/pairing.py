"""Which pairs of bodies are checked for collisions, and why others are not."""

from __future__ import annotations

from collections.abc import Sequence

from knotwork.robot import Robot
from knotwork.scenario import Scene
from knotwork.scene.alone import RobotAlone, home_of, touching_pairs
from knotwork.scene.bodies import Body, placed_links
from knotwork.scene.distances import DistanceMeter, nearest_of_bodies
from knotwork.scene.model import (
    AT_HOME,
    MOVE_TOGETHER,
    NEITHER_MOVES,
    TOOL,
    IgnoredPair,
    NoteKind,
    Pair,
)
from knotwork.scene.placements import place_joints
from knotwork.scene.srdf import disabled_pairs

ADJACENT = "a joint joins them"
CARRIED = "the tool carries it"
ALLOWED = "the scenario allows it"
IGNORED = "the scenario ignores it"
BY_ROBOT = "the robot's file ignores it"

DEEP = 0.02
"""A tool that is farther in a link at home than this [m] is plausibly a slip."""


class Pairing:
    """Chooses the pairs of bodies to check.

    Attributes:
        notes: What is plausibly a slip, or is not checked.
    """

    def __init__(self, robot: Robot, scene: Scene, alone: RobotAlone) -> None:
        self.robot, self.scene, self.alone, self.joints = robot, scene, alone, alone.joints
        self.notes: list[tuple[NoteKind, str]] = []

    def pairs(self, bodies: Sequence[Body]) -> tuple[list[Pair], list[IgnoredPair]]:
        """Give the pairs to check, and those that are not, with the reason."""
        pairs, ignored = [], []
        at_home = self._touching_at_home(bodies)
        reasons, by_files = self._given_reasons(), self._reasons_of_files()
        for i, first in enumerate(bodies):
            for j in range(i + 1, len(bodies)):
                second = bodies[j]
                if first.start >= second.end or second.start >= first.end:
                    continue
                reason: str | None
                if first.joint == second.joint:
                    if first.kind == second.kind:
                        continue  # links of one part, or objects
                    reason = MOVE_TOGETHER if first.joint else NEITHER_MOVES
                else:
                    own = {first.kind, second.kind} <= {"link", "tool"}
                    if own and not self.scene.rules.itself:
                        continue
                    names = frozenset((first.name, second.name))
                    reason = reasons.get(names)
                    if reason == ALLOWED and (first.apart or second.apart):
                        reason = None  # what takes it may touch it only then
                    reason = reason or (by_files.get(names) if own else None)
                    reason = reason or self._reason(first, second)
                    if reason is None and own and frozenset((i, j)) in at_home:
                        reason = AT_HOME
                        if TOOL in names:
                            self._note_home(bodies, i, j)
                if reason is not None:
                    ignored.append(IgnoredPair(first.name, second.name, reason))
                    continue
                order = (i, j) if second.joint else (j, i)
                around = "object" in (first.kind, second.kind)
                pairs.append(Pair(*order, self.scene.rules.margin if around else 0.0, around))
        return pairs, list(dict.fromkeys(ignored))

    def _note_home(self, bodies: Sequence[Body], i: int, j: int) -> None:
        """Say that the tool touches a link at home, and how deep it is in it."""
        rotation, origin = (x[0] for x in place_joints(self.joints, home_of(self.robot)[None]))
        near = nearest_of_bodies(DistanceMeter(), bodies[i], bodies[j], rotation, origin)
        link = next(body.name for body in (bodies[i], bodies[j]) if body.kind == "link")
        deep = near.distance < -DEEP
        slip = "; its shape may be in a wrong place or unit" if deep else ""
        self.notes.append(
            (
                "warning" if deep else "information",
                f"tool and {link} are not checked against one another, as {AT_HOME}: "
                f"{-1000 * near.distance:.3g} mm deep{slip}",
            )
        )

    def _reason(self, first: Body, second: Body) -> str | None:
        """Why two bodies are not checked: from what they are."""
        names = {first.name, second.name}
        kinds = {first.kind, second.kind}
        held = {one.name for one in self.scene.held}
        if TOOL in names and names & held and not (first.apart or second.apart):
            return CARRIED
        parent = self.joints.parent
        joined = first.joint in (parent[second.joint],) or second.joint == parent[first.joint]
        if kinds == {"link"} and joined:
            return ADJACENT
        return None

    def _reasons_of_files(self) -> dict[frozenset[str], str]:
        """Reasons that the robot's file and its SRDF give for links, by the names of the pair."""
        reasons: dict[frozenset[str], str] = {}
        robot = self.robot
        if robot.srdf is not None:
            disabled = disabled_pairs(robot.srdf, robot.srdf.stat().st_mtime_ns)
            links = {link for link, *_ in placed_links(robot)}
            unknown = dict.fromkeys(
                name for one in disabled for name in one[:2] if name not in links
            )
            if unknown:
                fault = f"{robot.srdf} disables pairs of links that {robot.name!r} does not have"
                self.notes.append(("warning", f"{fault}: {', '.join(map(repr, unknown))}"))
            for first, second, why in disabled:
                said = f" ({why})" if why else ""
                reasons[frozenset((first, second))] = f"the SRDF disables it{said}"
        shaped = {body.name for body in self.alone.links.bodies}
        bare = dict.fromkeys(n for pair in robot.ignored_pairs for n in pair if n not in shaped)
        if bare:
            named = ", ".join(map(repr, bare))
            fault = f"{robot.source}: collision.ignore names links without collision shapes"
            self.notes.append(("warning", f"{fault}, which changes nothing: {named}"))
        return reasons | {frozenset(pair): BY_ROBOT for pair in robot.ignored_pairs}

    def _given_reasons(self) -> dict[frozenset[str], str]:
        """Reasons that the scenario gives, by the names of the pair."""
        reasons: dict[frozenset[str], str] = {}
        scene = self.scene
        allowed = [(one.name, one.allow) for one in scene.objects]
        allowed += [(held.name, held.allow) for held in scene.held]
        for name, others in allowed:
            reasons |= {frozenset((name, other)): ALLOWED for other in others}
        reasons |= {frozenset(pair): IGNORED for pair in scene.rules.ignore}
        return reasons

    def _touching_at_home(self, bodies: Sequence[Body]) -> set[frozenset[int]]:
        """Pairs of the robot's links and its tool that touch at its home, by their places."""
        touching = {frozenset(pair) for pair in self.alone.touching}
        tools = [i for i, body in enumerate(bodies) if body.kind == "tool"]
        links = range(len(self.alone.links.bodies))
        pairs = [(i, j) for i in links for j in tools]
        home = home_of(self.robot)
        return touching | {
            frozenset(pair) for pair in touching_pairs(self.joints, bodies, pairs, home)
        }
