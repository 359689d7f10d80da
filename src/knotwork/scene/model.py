"""The collision model of a task: its bodies, and which pairs of them are checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from knotwork.documents import Document
from knotwork.errors import InputError, UnknownNameError
from knotwork.robot import Robot
from knotwork.scenario import Scenario, Scene, Shape
from knotwork.scene.bodies import Body, LinkBodies, link_bodies, mesh_folders, placed_links
from knotwork.scene.distances import DistanceMeter, nearest_of_bodies
from knotwork.scene.placements import JointTree, joint_tree, place_joints
from knotwork.scene.solids import Solid, solid
from knotwork.scene.srdf import disabled_pairs
from knotwork.waypoints import FloatArray

NoteKind = Literal["warning", "information"]

TOOL = "tool"

MOVE_TOGETHER = "they move as one"
NEITHER_MOVES = "neither moves"
ADJACENT = "a joint joins them"
AT_HOME = "they touch at home"
CARRIED = "the tool carries it"
ALLOWED = "the scenario allows it"
IGNORED = "the scenario ignores it"
BY_ROBOT = "the robot's file ignores it"

FAR_OFF = 20.0
"""A mesh this many times larger than the arm's reach, or a thousand times smaller than that, is
plausibly in another unit."""

DOUBTFUL = 4.0
"""A mesh this many times larger than the arm's reach may be in another unit, and so may one that is
fifty times this smaller."""


@dataclass(frozen=True)
class IgnoredPair:
    """Two bodies that are not checked against one another.

    Attributes:
        first, second: Their names.
        reason: Why not.
    """

    first: str
    second: str
    reason: str


@dataclass(frozen=True)
class Pair:
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
        notes: What is plausibly a slip, or is not checked: `"warning"` or `"information"`, and
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
    def said_of_bare(self) -> str:
        """A sentence on the links that have no collision shapes, or nothing if all have."""
        *others, last = self.bare or ("",)
        if not others:
            said = f"link {last} has no collision shapes and is not checked for collisions"
            return said if last else ""
        listed = f"{', '.join(others)} and {last}"
        return f"links {listed} have no collision shapes and are not checked for collisions"

    @cached_property
    def meter(self) -> DistanceMeter:
        """Measures distances."""
        return DistanceMeter()


def robot_collision_model(robot: Robot) -> CollisionModel:
    """The collision model of a robot alone, as `knotwork robots NAME --collisions` lists it.

    Raises:
        InputError: A link's mesh or the SRDF can't be read.

    >>> model = robot_collision_model(kw.load_robot("ur5"))
    >>> len(model.bodies), model.ignored[0].first, model.ignored[0].reason
    (8, 'base_link', 'a joint joins them')
    """
    return _Builder(robot, Scene(), None).model()


@dataclass(frozen=True, eq=False)
class Hold:
    """Where and when an object is held.

    Attributes:
        taken, left: Pose of the TCP, `pin.SE3` in the base frame, at the start and at the end.
        start, end: From when to when [s].
    """

    taken: Any
    left: Any
    start: float
    end: float


def collision_model(scenario: Scenario, robot: Robot, holds: Mapping[str, Hold]) -> CollisionModel:
    """The collision model of a scenario.

    Args:
        scenario: The task.
        robot: Its robot, with its tool.
        holds: For each held object by name where and when it is held.

    Raises:
        DocumentError: A mesh is wrong, or a name in the scenario is unknown.
    """
    return _Builder(robot, scenario.scene, scenario.document, holds).model()


class _Builder:
    """Gathers bodies and pairs."""

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        document: Document | None,
        holds: Mapping[str, Hold] | None = None,
    ) -> None:
        self.robot, self.scene, self.document = robot, scene, document
        self.alone = _alone(robot)
        self.joints, self.links = self.alone.joints, self.alone.links
        self.holds = holds or {}
        self.notes: list[tuple[NoteKind, str]] = []

    def model(self) -> CollisionModel:
        scene, base = self.scene, self.robot.base_placement
        bodies = list(self.links.bodies)
        if scene.tool:
            bodies.append(self._tool(scene.tool))
        for one in scene.objects:
            if not one.visual:
                place = ("scene", "objects", one.name)
                bodies.append(Body(one.name, "object", 0, (self._solid(one.shape, base, place),)))
        for held in scene.held:
            bodies += self._held(held.name, held.shape)
        self._check_names(bodies)
        pairs, ignored = self._pairs(bodies)
        return CollisionModel(
            self.joints,
            tuple(bodies),
            tuple(pairs),
            tuple(ignored),
            self.links.missing,
            self.links.bare,
            tuple(dict.fromkeys(self.notes)),
        )

    def _tool(self, shapes: Sequence[Shape]) -> Body:
        robot = self.robot
        robot.require_tool()
        frame = robot.model.frames[robot.frame_index(robot.tool_frame or "")]
        several = self.document is not None and isinstance(
            self.document.data.get("tool", {}).get("shape"), list
        )
        solids = [
            self._solid(shape, frame.placement, ("tool", "shape", *((i,) if several else ())))
            for i, shape in enumerate(shapes)
        ]
        return Body(TOOL, "tool", int(frame.parentJoint), tuple(solids))

    def _held(self, name: str, shape: Shape) -> list[Body]:
        """A held object: where it is taken from, in the tool, and where it is left."""
        robot, base = self.robot, self.robot.base_placement
        frame = robot.model.frames[robot.require_tool()]
        hold, place = self.holds[name], ("tool", "holds", name)
        here, there = (
            (self._solid(shape, base * pose, place),) for pose in (hold.taken, hold.left)
        )
        carried = (self._solid(shape, frame.placement, place),)
        return [
            Body(name, "object", 0, here, end=hold.start),
            Body(name, "held", int(frame.parentJoint), carried, hold.start, hold.end),
            Body(name, "object", 0, there, start=hold.end),
        ]

    def _solid(self, shape: Shape, carrier: Any, place: tuple[str | int, ...]) -> Solid:
        """A shape of the scenario as a solid; errors say where it stands."""
        try:
            made = solid(shape, carrier)
            if shape.kind == "mesh":
                self._check_size(made, shape)
        except InputError as error:
            if self.document is not None:
                raise self.document.error((*place, "mesh"), str(error)) from error
            raise
        return made

    def _check_size(self, made: Solid, shape: Shape) -> None:
        """Refuse a mesh that is plausibly in another unit; warn of one that may be."""
        size, reach = 2.0 * made.radius, self._reach
        for factor in (1e-3, 1e3):
            far = size > FAR_OFF * reach if factor < 1 else size < reach / (FAR_OFF * 50)
            if far and reach / 200 <= size * factor <= FAR_OFF * reach:
                raise InputError(
                    f"mesh {shape.path} is {size:.4g} m across, and the arm reaches {reach:.2g} m: "
                    f"it is plausibly in another unit; scale: {factor:g} makes it "
                    f"{size * factor:.4g} m"
                )
            doubtful = size > DOUBTFUL * reach if factor < 1 else size < reach / (50 * DOUBTFUL)
            if doubtful and reach / 200 <= size * factor <= FAR_OFF * reach:
                self.notes.append(
                    (
                        "warning",
                        f"mesh {shape.path} is {size:.4g} m across, and the arm reaches "
                        f"{reach:.2g} m: it may be in another unit; scale: {factor:g} makes it "
                        f"{size * factor:.4g} m",
                    )
                )

    @cached_property
    def _reach(self) -> float:
        """How far the arm reaches at most, stretched out [m]."""
        return float(np.linalg.norm(self.joints.translation, axis=1).sum()) + 0.1

    def _check_names(self, bodies: Sequence[Body]) -> None:
        names = list(dict.fromkeys([*(body.name for body in bodies), *self.robot.frame_names]))
        scene = self.scene
        links = {link for link, *_ in placed_links(self.robot)}
        for i, pair in enumerate(scene.rules.ignore):
            self._known(pair, names, ("collisions", "ignore", i))
            if pair[0] == pair[1]:
                self._wrong(("collisions", "ignore", i), f"names {pair[0]!r} twice", "two names")
        given: list[tuple[tuple[Any, ...], str, Sequence[str]]] = [
            *((("scene", "objects", one.name), one.name, one.allow) for one in scene.objects),
            *((("tool", "holds", held.name), held.name, held.allow) for held in scene.held),
        ]
        for place, name, allow in given:
            if name in links:
                self._wrong(place, "is the name of a link of the robot", "any other name")
            self._known(allow, list(dict.fromkeys([*names, TOOL])), (*place, "allow"))
            if name in allow:
                self._wrong((*place, "allow"), f"names {name!r} itself", "what may touch it")

    def _wrong(self, place: tuple[Any, ...], fault: str, accepted: str) -> None:
        if self.document is not None:
            raise self.document.error(place, fault, accepted)
        raise InputError(f"{'.'.join(map(str, place))}: {fault} ({accepted})")

    def _known(self, given: Sequence[str], names: Sequence[str], place: tuple[Any, ...]) -> None:
        for name in given:
            if name not in names:
                where = self.document.where(place) if self.document is not None else ""
                raise UnknownNameError("link or object", name, names, where=where)

    def _pairs(self, bodies: Sequence[Body]) -> tuple[list[Pair], list[IgnoredPair]]:
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
                    reason = reasons.get(names) or (by_files.get(names) if own else None)
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
        rotation, origin = (x[0] for x in place_joints(self.joints, _home(self.robot)[None]))
        near = nearest_of_bodies(DistanceMeter(), bodies[i], bodies[j], rotation, origin)
        link = next(body.name for body in (bodies[i], bodies[j]) if body.kind == "link")
        self.notes.append(
            (
                "information",
                f"tool and {link} are not checked against one another, as {AT_HOME}: "
                f"{-1000 * near.distance:.3g} mm deep",
            )
        )

    def _reason(self, first: Body, second: Body) -> str | None:
        """Why two bodies are not checked: from what they are."""
        names = {first.name, second.name}
        kinds = {first.kind, second.kind}
        held = {one.name for one in self.scene.held}
        if TOOL in names and names & held:
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
            changed = robot.srdf.stat().st_mtime_ns
            for first, second, why in disabled_pairs(robot.srdf, changed):
                said = f" ({why})" if why else ""
                reasons[frozenset((first, second))] = f"the SRDF disables it{said}"
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
        home = _home(self.robot)
        return touching | {frozenset(pair) for pair in _touching(self.joints, bodies, pairs, home)}


@dataclass(frozen=True, eq=False)
class _Alone:
    """What a collision model takes from the robot alone.

    Attributes:
        joints: Its joints.
        links: Its links.
        touching: Pairs of links that touch at home, by their places.
    """

    joints: JointTree
    links: LinkBodies
    touching: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class _Key:
    """What decides how a robot's links lie to one another."""

    placed: tuple[Any, ...]
    urdf: Path
    changed: int
    home: tuple[float, ...]
    robot: Robot = field(compare=False)


def _alone(robot: Robot) -> _Alone:
    """What is the same for all scenarios of a robot; it is kept for the next time."""
    changed = robot.urdf.stat().st_mtime_ns
    home = tuple(_home(robot).tolist())
    return _made_alone(
        _Key((*placed_links(robot), *mesh_folders(robot)), robot.urdf, changed, home, robot)
    )


@lru_cache(maxsize=32)
def _made_alone(key: _Key) -> _Alone:
    joints, links = joint_tree(key.robot.model), link_bodies(key.robot)
    n = len(links.bodies)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    touching = _touching(joints, links.bodies, pairs, np.array(key.home))
    return _Alone(joints, links, tuple(touching))


def _home(robot: Robot) -> FloatArray:
    """Home, or where there is none as near to zero as limits let it."""
    low, high = robot.lower_position_limit, robot.upper_position_limit
    return robot.configurations.get("home", np.clip(np.zeros(robot.dof), low, high))


def _touching(
    joints: JointTree,
    bodies: Sequence[Body],
    pairs: Sequence[tuple[int, int]],
    q: FloatArray,
) -> list[tuple[int, int]]:
    """Those pairs of bodies that touch at a configuration, of those that move to one another."""
    rotation, origin = (array[0] for array in place_joints(joints, np.array([q])))
    meter = DistanceMeter()
    return [
        (i, j)
        for i, j in pairs
        if bodies[i].joint != bodies[j].joint
        and nearest_of_bodies(meter, bodies[i], bodies[j], rotation, origin).distance <= 0.0
    ]
