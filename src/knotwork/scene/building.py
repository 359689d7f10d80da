"""Collision model of a robot or a scenario, built from shapes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.documents import Places
from knotwork.errors import InputError
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.endless import EndlessCurve
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, inverse_chain, join_trees, serial
from knotwork.scenario import GraspedObject, PlacedObject, PlacedRobot, PlacedShape, Scenario, Scene
from knotwork.scenario.scene_model import STANDING
from knotwork.scene.bodies import Body
from knotwork.scene.collision_model import TOOL, CollisionModel, NoteKind, riding
from knotwork.scene.other_robots import in_one_cell, other_motion
from knotwork.scene.pairing import Pairing
from knotwork.scene.robot_geometry import robot_geometry
from knotwork.scene.rules import given_rules
from knotwork.scene.solids import Solid, solid
from knotwork.tool_paths.moving_frame import KnownJoints, MovingFrame

FAR_OFF = 20.0
"""Ratio of mesh size and reach of the arm above which, or a thousand times below which, the
unit is plausibly wrong."""

TINY = np.finfo(float).tiny

SAME_PLACE = 1e-6
"""Waypoints with TCPs this near one another [m] are at one place."""

DOUBTFUL = 4.0
"""Ratio of mesh size and reach of the arm above which, or fifty times below which, the
unit may be wrong."""


def robot_collision_model(robot: Robot) -> CollisionModel:
    """The collision model of a robot alone, as listed by `knotwork robots NAME --collisions`.

    Raises:
        InputError: A link's mesh or the SRDF can't be read.

    >>> model = robot_collision_model(kw.load_robot("ur5"))
    >>> len(model.bodies), model.ignored[0].first, model.ignored[0].reason
    (8, 'base_link', 'a joint joins them')
    """
    return _Builder(robot, Scene(), Places()).model()


class Hold(NamedTuple):
    """Place and time of a grasp.

    Attributes:
        taken, left: Pose of the TCP, `pin.SE3` in the base frame, at the start and at the end.
        start, end: Time interval [s].
        coming: Time of the tool's departure to the object [s]; until then it must keep clear.
        gone: Time of the tool's arrival elsewhere [s]; from then on it must keep clear.
    """

    taken: Any
    left: Any
    start: float
    end: float
    coming: float = -math.inf
    gone: float = math.inf


def hold_between(
    take: int,
    leave: int,
    times: Sequence[float],
    poses: Sequence[Any],
    standing: Sequence[bool] = (),
) -> Hold:
    """Times of holding an object between two waypoints, and of the tool near it.

    The tool comes from the last waypoint before, and is gone at the first one after, at which
    the TCP is somewhere else.

    Args:
        take: Index of the waypoint where the object is taken.
        leave: Index of the waypoint where it is released.
        times: Times of the waypoints [s].
        poses: Poses of the TCP at the waypoints, `pin.SE3` in the base frame.
        standing: Whether each pose is in the axes of the fixed frame instead; by default none.
    """

    def elsewhere(k: int, other: int) -> bool:
        if standing and standing[k] != standing[other]:
            return True
        return bool(np.abs(poses[k].translation - poses[other].translation).max() > SAME_PLACE)

    coming = (times[k] for k in range(take - 1, -1, -1) if elsewhere(k, take))
    gone = (times[k] for k in range(leave + 1, len(times)) if elsewhere(k, leave))
    near = next(coming, -math.inf), next(gone, math.inf)
    return Hold(poses[take], poses[leave], times[take], times[leave], *near)


def collision_model(
    scenario: Scenario, robot: Robot, times: Sequence[float] = (), poses: Sequence[Any] = ()
) -> CollisionModel:
    """The collision model of a scenario.

    Args:
        scenario: The task.
        robot: Its robot, with its tool.
        times: Times of the waypoints [s], for objects that appear or are held.
        poses: Poses of the TCP at the waypoints, `pin.SE3` in the axes of each, for held objects.

    Raises:
        DocumentError: A mesh is wrong, or a name in the scenario is unknown.
    """
    scene, place = scenario.scene, {one.name: i for i, one in enumerate(scenario.waypoints)}
    seen = times, poses, [one.standing for one in scenario.waypoints]
    holds = {one.name: hold_between(place[one.take], place[one.leave], *seen) for one in scene.held}
    things: list[PlacedObject | GraspedObject] = [*scene.objects, *scene.held]
    since = {one.name: times[place[one.appears]] for one in things if one.appears is not None}
    return _Builder(robot, scene, scenario.places, holds, since).model()


class _Builder:
    """Collects bodies and pairs."""

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        places: Places,
        holds: Mapping[str, Hold] = MappingProxyType({}),
        since: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self.robot, self.scene, self.places = robot, scene, places
        self.geometry = robot_geometry(robot)
        self.joints, self.links = self.geometry.joints, self.geometry.links
        self.holds, self.since = holds, since
        self.known: list[EndlessCurve] = []
        self.carriers: dict[tuple[str, tuple[KnownJoints, ...]], tuple[int, Any]] = {}
        self.robots: dict[str, tuple[Robot, int]] = {}
        self.notes: list[tuple[NoteKind, str]] = []
        self.moved: set[str] = set()

    def model(self) -> CollisionModel:
        scene = self.scene
        bodies = list(self.links.bodies)
        if scene.tool:
            bodies.append(self._tool(scene.tool))
        for frame in scene.moving.values():
            self._carrier(frame)  # for drawing
        for one in scene.objects:
            if not one.visual:
                bodies.append(self._object(one.name, one.shape, one.carrier))
        for held in scene.held:
            bodies += self._held(held)
        for robot in scene.robots:
            bodies += self._other(robot)
        # of arms with one URDF, each would also be in the other's model, at rest
        bodies = [replace(x, start=math.inf) if x.link in self.moved else x for x in bodies]
        if scene.tool:
            bodies = [replace(x, name=x.identity) if x.link == TOOL else x for x in bodies]
        given = given_rules(scene, self.robot, bodies, self.places)
        pairing = Pairing(self.robot, self.joints, scene, self.geometry, given.reasons)
        pairs, ignored = pairing.pairs(bodies)
        return CollisionModel(
            self.joints,
            tuple(bodies),
            tuple(pairs),
            tuple(ignored),
            self.links.missing,
            self.links.bare,
            tuple(dict.fromkeys([*self.notes, *given.notes, *pairing.notes])),
            tuple(self.known),
            self.carriers,
            self.robots,
        )

    def _object(self, name: str, shape: PlacedShape, frame: MovingFrame | None) -> Body:
        """A fixed object, or one that moves with a frame; placed with its carrier at rest."""
        joint, carrier = self._riding(frame)
        start = self.since.get(name, -math.inf)
        return Body(name, "object", joint, (self._solid(shape, carrier),), start)

    def _other(self, given: PlacedRobot) -> Iterator[Body]:
        """Links, tool and held objects of another robot, moving with it."""
        own = self.robot
        try:
            other = other_motion(given)
            theirs = other.robot
            one_cell = in_one_cell(own, theirs)
        except InputError as error:
            place = ("scene", "robots", given.name, "scenario")
            raise self.places.error(place, str(error)) from error
        if one_cell:
            link = own.standing_frame
            standing, placement = _carried(own, link)
        else:
            link = theirs.standing_frame
            standing, placement = self._riding(given.carrier)
            placement = placement * given.placement
        back, columns = inverse_chain(other.model.joints, *(base := _carried(theirs, link)))
        known = [replace(one, delay=one.delay + given.delay) for one in other.known]
        moved = known[0].curve
        still = EndlessCurve(PiecewisePolynomial(np.zeros((1, 1, 1)), [0.0, 1.0]))
        way = PiecewisePolynomial(moved.c[:, :, columns], moved.x)
        turned = [replace(known[0], curve=way)] if columns else []
        root = self._put(back, placement, [*turned, still], standing)
        self.joints = join_trees(self.joints, other.model.joints, pin.SE3.Identity(), root)
        self.known += known
        self.robots[given.name] = other.robot, root
        for body in other.model.bodies:
            if one_cell and body.joint == base[0]:
                continue
            if one_cell and body.link:
                self.moved.add(body.link)
            if body.kind != "object" or body.name in other.held:
                yield replace(
                    body,
                    name=f"{given.name}/{body.name}",
                    kind="object",
                    joint=root + body.joint,
                    start=body.start + given.delay,
                    end=body.end + given.delay,
                    apart=False,
                    link="",
                )

    def _riding(self, frame: MovingFrame | None, time: float | None = None) -> tuple[int, Any]:
        """Joint that carries a frame and its placement, as from `riding`; by default the base."""
        if frame is None:
            return 0, self.robot.base_placement
        self._carrier(frame)
        return riding(self.carriers, frame, time)

    def _carrier(self, frame: MovingFrame) -> None:
        """Add the joints of a moving frame to the tree if they are missing."""
        key = frame.link, frame.joints
        if key in self.carriers:
            return
        joint, placement = 0, self.robot.base_placement
        if frame.link:
            link = self.robot.standing_frame if frame.link == STANDING else frame.link
            joint, placement = _carried(self.robot, link)
        if frame.joints:
            placements: list[Any] = []
            axes, turns = [], list[bool]()
            for one in frame.joints:
                placements += [one.placement, *[pin.SE3.Identity()] * (len(one.turns) - 1)]
                axes.append(one.axis)
                turns += one.turns
            chain = serial(placements, np.concatenate(axes), turns)
            known = [one.curve for one in frame.joints]
            joint, placement = self._put(chain, placement, known, joint), pin.SE3.Identity()
        self.carriers[key] = joint, placement

    def _put(
        self, tree: JointTree, placement: Any, known: Sequence[EndlessCurve], carrier: int = 0
    ) -> int:
        """Add joints with known positions, and give the index of the last."""
        self.joints = join_trees(self.joints, tree, placement, carrier)
        self.known += known
        return len(self.joints.parent) - 1

    def _tool(self, shapes: Sequence[PlacedShape]) -> Body:
        robot = self.robot
        robot.require_tool()
        frame = robot.model.frames[robot.frame_index(robot.tool_frame or "")]
        solids = tuple(self._solid(shape, frame.placement) for shape in shapes)
        return Body(TOOL, "tool", int(frame.parentJoint), solids)

    def _held(self, held: GraspedObject) -> list[Body]:
        """A held object: at the place where it is taken, in the tool, and where it is released."""
        name, shape, hold = held.name, held.shape, self.holds[held.name]
        frame = self.robot.model.frames[self.robot.require_tool()]
        ends = ((hold.taken, hold.start), (hold.left, hold.end))
        (before, here), (after, there) = (
            self._lying(shape, frame, *end) for frame, end in zip(held.carriers, ends, strict=True)
        )
        carried = (self._solid(shape, frame.placement),)
        since = self.since.get(name, -math.inf)
        bodies = [
            Body(name, "object", before, here, since, hold.coming, apart=True),
            Body(name, "object", before, here, max(since, hold.coming), hold.start),
            Body(name, "held", int(frame.parentJoint), carried, hold.start, hold.end),
            Body(name, "object", after, there, hold.end, hold.gone),
            Body(name, "object", after, there, start=hold.gone, apart=True),
        ]
        return [body for body in bodies if body.start < body.end]

    def _lying(
        self, shape: PlacedShape, frame: MovingFrame | None, pose: Any, time: float
    ) -> tuple[int, tuple[Solid, ...]]:
        """The carrier of an object that the tool takes or releases, and its solids."""
        joint, placement = self._riding(frame, time)
        return joint, (self._solid(shape, placement * pose),)

    def _solid(self, shape: PlacedShape, carrier: Any) -> Solid:
        """A shape of the scenario as a solid; errors name its place in the file."""
        try:
            made = solid(shape, carrier)
            if shape.path is not None:
                self._check_size(made, shape)
        except InputError as error:
            raise self.places.error((*shape.place, shape.kind), str(error)) from error
        return made

    def _check_size(self, made: Solid, shape: PlacedShape) -> None:
        """Refuse a file that is plausibly in another unit; warn if it may be."""
        size, reach = 2.0 * made.radius, self._reach
        excess, factor = max((size / reach, 1e-3), (reach / max(50.0 * size, TINY), 1e3))
        if excess <= DOUBTFUL or not reach / 200 <= size * factor <= FAR_OFF * reach:
            return
        text = (
            f"{'mesh' if shape.kind == 'mesh' else 'point cloud'} {shape.path} is {size:.4g} m "
            f"across, and the arm reaches {reach:.2g} m: it "
            f"{'is plausibly' if excess > FAR_OFF else 'may be'} in another unit; a scale "
            f"{factor:g} times as large makes it {size * factor:.4g} m"
        )
        if excess > FAR_OFF:
            raise InputError(text)
        self.notes.append(("warning", text))

    @cached_property
    def _reach(self) -> float:
        """Largest reach of the arm [m]."""
        return float(np.linalg.norm(self.geometry.joints.translation, axis=1).sum()) + 0.1


def _carried(robot: Robot, link: str) -> tuple[int, Any]:
    """The joint that carries a link of a robot, and the link's placement in its axes, `pin.SE3`."""
    found = robot.model.frames[robot.frame_index(link)]
    return int(found.parentJoint), found.placement.copy()
