"""Collision model of a robot or a scenario, built from shapes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.extended_curve import ExtendedCurve
from knotwork.curves.tool_paths.task_frame import BASE_FRAME, KnownJoints, TaskFrame
from knotwork.errors import InputError
from knotwork.files.documents import Locations
from knotwork.robot import Robot
from knotwork.robot.joint_tree import (
    JointTree,
    invert_chain,
    join_trees,
    joint_tree,
    make_serial_chain,
)
from knotwork.scene.bodies import Body
from knotwork.scene.collision_model import TOOL_BODY, CollisionModel, find_carrier
from knotwork.scene.excluded_pairs import read_exclusions
from knotwork.scene.link_bodies import read_link_bodies
from knotwork.scene.other_robots import are_in_one_cell, load_other_motion
from knotwork.scene.pairing import Pairing
from knotwork.scene.solids import Solid, make_solid
from knotwork.task.scenario import (
    PlacedHeldObject,
    PlacedObject,
    PlacedRobot,
    PlacedShape,
    Scenario,
    Scene,
)

PLAUSIBLE_SIZES = 1e-3, 20.0
"""Sizes of a mesh relative to the reach of the arm, beyond which its unit is plausibly wrong."""

TCP_TOLERANCE = 1e-6
"""Distance of TCPs [m] within which waypoints have the same position."""


def build_robot_collision_model(robot: Robot) -> CollisionModel:
    """Build the collision model of a robot alone, which `knotwork robots NAME --collisions` lists.

    Raises:
        InputError: A link's mesh or the SRDF can't be read.

    >>> model = build_robot_collision_model(kw.load_robot("ur5"))
    >>> len(model.bodies), model.excluded[0].first, model.excluded[0].reason
    (8, 'base_link', 'a joint joins them')
    """
    return _Builder(robot, Scene(), Locations()).build()


class Hold(NamedTuple):
    """Poses and times at which the tool takes and releases an object.

    Attributes:
        taken_pose, released_pose: Poses of the TCP at the start and at the end, `pin.SE3` in the
            base frame.
        start, end: Time interval [s].
        approach_start: Time at which the tool departs to the object [s]. Before, it must keep
            clear of the object.
        departure_end: Time at which the tool arrives at another position [s]. Afterwards, it must
            keep clear of the object.
    """

    taken_pose: Any
    released_pose: Any
    start: float
    end: float
    approach_start: float = -math.inf
    departure_end: float = math.inf


def find_hold(
    held: PlacedHeldObject,
    times: Sequence[float],
    poses: Sequence[Any],
    in_world_frame: Sequence[bool],
) -> Hold:
    """Find when an object is held between two waypoints, and when the tool is near it.

    The approach starts at the last earlier waypoint at which the TCP has another position. The
    departure ends at the first such waypoint afterwards.

    Args:
        held: The object.
        times: Times of the waypoints [s].
        poses: Poses of the TCP at the waypoints, `pin.SE3` in the base frame.
        in_world_frame: Whether each pose is in the world frame instead.
    """

    def is_elsewhere(i: int, end: int) -> bool:
        if in_world_frame[i] != in_world_frame[end]:
            return True
        moved = poses[i].translation - poses[end].translation
        return bool(np.abs(moved).max() > TCP_TOLERANCE)

    first, last = held.taken_at, held.released_at
    before = (times[i] for i in range(first - 1, -1, -1) if is_elsewhere(i, first))
    after = (times[i] for i in range(last + 1, len(times)) if is_elsewhere(i, last))
    return Hold(
        taken_pose=poses[first],
        released_pose=poses[last],
        start=times[first],
        end=times[last],
        approach_start=next(before, -math.inf),
        departure_end=next(after, math.inf),
    )


def build_collision_model(
    scenario: Scenario, robot: Robot, times: Sequence[float] = (), poses: Sequence[Any] = ()
) -> CollisionModel:
    """Build the collision model of a scenario.

    Args:
        scenario: The scenario.
        robot: Its robot, with its tool.
        times: Times of the waypoints [s], for objects that appear or are held.
        poses: Poses of the TCP at the waypoints, `pin.SE3` in the axes of each, for held objects.

    Raises:
        DocumentError: A mesh is wrong, or a name in the scenario is unknown.
    """
    scene = scenario.scene
    in_world_frame = [waypoint.in_world_frame for waypoint in scenario.waypoints]
    holds = {held.name: find_hold(held, times, poses, in_world_frame) for held in scene.held}
    items: list[PlacedObject | PlacedHeldObject] = [*scene.objects, *scene.held]
    appearance_times = {
        item.name: times[item.appears] for item in items if item.appears is not None
    }
    return _Builder(robot, scene, scenario.locations, holds, appearance_times).build()


class _Builder:
    """Collects the bodies and pairs of a collision model."""

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        locations: Locations,
        holds: Mapping[str, Hold] = MappingProxyType({}),
        appearance_times: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self.robot = robot
        self.scene = scene
        self.locations = locations
        self.holds = holds
        self.appearance_times = appearance_times
        self.tree = joint_tree(robot.model)
        self.links = read_link_bodies(robot)
        self.known_motions: list[ExtendedCurve] = []
        self.carriers: dict[tuple[str, tuple[KnownJoints, ...]], tuple[int, Any]] = {}
        self.robots: dict[str, tuple[Robot, int]] = {}
        self.other_arm_links: set[str] = set()

    def build(self) -> CollisionModel:
        """The model. Only once, as this adds frames and robots to the tree."""
        scene = self.scene
        bodies = list(self.links.bodies)
        if scene.tool:
            bodies.append(self._tool_body(scene.tool))
        frames = [BASE_FRAME, *scene.frames.values(), *(item.frame for item in scene.objects)]
        frames += [frame for held in scene.held for frame in held.end_frames]
        for frame in frames:  # those without bodies are for pictures
            if (frame.link, frame.joints) not in self.carriers:
                self._add_frame(frame)
        bodies += [self._object_body(item) for item in scene.objects if not item.visual]
        for held in scene.held:
            bodies += self._held_bodies(held)
        for robot in scene.robots:
            bodies += self._add_robot(robot)
        # if two arms share a URDF, the links of the other one are bodies of its own model already
        bodies = [body for body in bodies if body.link not in self.other_arm_links]
        if scene.tool:
            bodies = [replace(x, name=x.identity) if x.link == TOOL_BODY else x for x in bodies]
        exclusions = read_exclusions(scene, self.robot, bodies, self.locations)
        pairs, excluded = Pairing(self.robot, self.tree, scene, exclusions).pairs(bodies)
        return CollisionModel(
            self.tree,
            tuple(bodies),
            tuple(pairs),
            tuple(excluded),
            missing_shapes_notes=self.links.missing_notes,
            bare=self.links.bare,
            known_motions=tuple(self.known_motions),
            carriers=self.carriers,
            robots=self.robots,
        )

    def _object_body(self, item: PlacedObject) -> Body:
        joint, placement = find_carrier(self.carriers, item.frame)
        start = self.appearance_times.get(item.name, -math.inf)
        return Body(item.name, "object", joint, (self._solid(item.shape, placement),), start=start)

    def _add_robot(self, placed: PlacedRobot) -> list[Body]:
        """Add the joints of another robot; its links, tool and held objects are the bodies."""
        robot = self.robot
        try:
            motion = load_other_motion(placed)
            other = motion.robot
            one_cell = are_in_one_cell(robot, other)
        except InputError as error:
            location = ("scene", "robots", placed.name, "scenario")
            raise self.locations.error(location, str(error)) from error
        carrier, placement = find_carrier(self.carriers, BASE_FRAME)
        if not one_cell:
            placement = placement * placed.placement
        link = robot.world_frame if one_cell else other.world_frame
        base_joint, base_placement = _joint_of_link(other, link)
        known = [replace(curve, delay=curve.delay + placed.delay) for curve in motion.known_motions]
        # the chain from that link to the root of the other URDF, whose last joint is at rest
        chain, columns = invert_chain(motion.model.tree, base_joint, base_placement)
        chain_motions = [ExtendedCurve(PiecewisePolynomial(np.zeros((1, 1, 1)), [0.0, 1.0]))]
        if columns:
            arm = known[0].curve
            of_chain = PiecewisePolynomial(arm.c[:, :, columns], arm.x)
            chain_motions.insert(0, replace(known[0], curve=of_chain))
        root = self._add_joints(chain, placement, chain_motions, carrier)
        self.tree = join_trees(self.tree, motion.model.tree, pin.SE3.Identity(), root)
        self.known_motions += known
        self.robots[placed.name] = other, root
        bodies = [
            body for body in motion.model.bodies if not (one_cell and body.joint == base_joint)
        ]
        if one_cell:
            self.other_arm_links |= {body.link for body in bodies if body.link}
        return [
            replace(
                body,
                name=f"{placed.name}/{body.name}",
                kind="object",
                joint=root + body.joint,
                start=body.start + placed.delay,
                end=body.end + placed.delay,
                tool_keeps_clear=False,
                link="",
            )
            for body in bodies
            if body.kind != "object" or body.name in motion.held
        ]

    def _add_frame(self, frame: TaskFrame) -> None:
        """Add the joints that move a frame, whose last one carries it."""
        joint, placement = _joint_of_link(self.robot, frame.link or self.robot.world_frame)
        if frame.joints:
            placements: list[Any] = []
            axes, is_revolute = [], list[bool]()
            for joints in frame.joints:
                followers = len(joints.is_revolute) - 1
                placements += [joints.placement, *[pin.SE3.Identity()] * followers]
                axes.append(joints.axis)
                is_revolute += joints.is_revolute
            chain = make_serial_chain(placements, np.concatenate(axes), is_revolute)
            known = [joints.curve for joints in frame.joints]
            joint, placement = self._add_joints(chain, placement, known, joint), pin.SE3.Identity()
        self.carriers[frame.link, frame.joints] = joint, placement

    def _add_joints(
        self, tree: JointTree, placement: Any, known: Sequence[ExtendedCurve], carrier: int
    ) -> int:
        """Add joints with known positions, and return the index of the last one."""
        self.tree = join_trees(self.tree, tree, placement, carrier)
        self.known_motions += known
        return len(self.tree.parent) - 1

    def _tool_body(self, shapes: Sequence[PlacedShape]) -> Body:
        robot = self.robot
        robot.require_tool()
        frame = robot.model.frames[robot.link_index(robot.tool_frame or "")]
        solids = tuple(self._solid(shape, frame.placement) for shape in shapes)
        return Body(TOOL_BODY, "tool", int(frame.parentJoint), solids)

    def _held_bodies(self, held: PlacedHeldObject) -> list[Body]:
        """Make the bodies of a held object: before it is taken, in the tool, after its release."""
        hold = self.holds[held.name]
        frame = self.robot.model.frames[self.robot.require_tool()]

        def lying(lies_in: TaskFrame, pose: Any, time: float) -> Body:
            joint, placement = find_carrier(self.carriers, lies_in, time)
            return Body(held.name, "object", joint, (self._solid(held.shape, placement * pose),))

        frame_before, frame_after = held.end_frames
        before = lying(frame_before, hold.taken_pose, hold.start)
        after = lying(frame_after, hold.released_pose, hold.end)
        solids = (self._solid(held.shape, frame.placement),)
        in_tool = Body(held.name, "held", int(frame.parentJoint), solids, hold.start, hold.end)
        appears = self.appearance_times.get(held.name, -math.inf)
        near_from = max(appears, hold.approach_start)
        bodies = [
            replace(before, start=appears, end=hold.approach_start, tool_keeps_clear=True),
            replace(before, start=near_from, end=hold.start),
            in_tool,
            replace(after, start=hold.end, end=hold.departure_end),
            replace(after, start=hold.departure_end, tool_keeps_clear=True),
        ]
        return [body for body in bodies if body.start < body.end]

    def _solid(self, shape: PlacedShape, axes: Any) -> Solid:
        """Make the solid of a shape of the scenario; errors name its location in the file."""
        try:
            solid = make_solid(shape, axes)
            if shape.path is not None:
                self._check_size(solid, shape)
        except InputError as error:
            raise self.locations.error((*shape.location, shape.kind), str(error)) from error
        return solid

    def _check_size(self, solid: Solid, shape: PlacedShape) -> None:
        """Refuse a file whose unit is plausibly wrong."""
        reach = self._reach
        size = 2.0 * solid.radius
        smallest, largest = (ratio * reach for ratio in PLAUSIBLE_SIZES)
        factor = 1e-3 if size > largest else 1e3
        explains = reach / 200 <= size * factor <= largest
        if explains and not smallest <= size <= largest:
            kind = "mesh" if shape.kind == "mesh" else "point cloud"
            text = shape.units.text
            raise InputError(
                f"{kind} {shape.path} is {text(size, 'm', '.4g')} across, and the arm reaches "
                f"{text(reach, 'm', '.2g')}: it is probably in another unit; a scale {factor:g} "
                f"times as large makes it {text(size * factor, 'm', '.4g')}"
            )

    @cached_property
    def _reach(self) -> float:
        """Largest reach of the arm [m]."""
        return float(self.tree.offset[: self.robot.model.njoints].sum()) + 0.1


def _joint_of_link(robot: Robot, link: str) -> tuple[int, Any]:
    """Find the joint that carries a link, and the link's placement in its axes, `pin.SE3`."""
    frame = robot.model.frames[robot.link_index(link)]
    return int(frame.parentJoint), frame.placement.copy()
