"""The collision model of a robot or a scenario, made from its shapes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from knotwork.documents import Places
from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.scenario import Scenario, Scene, Shape
from knotwork.scene.bodies import Body
from knotwork.scene.model import TOOL, CollisionModel, NoteKind
from knotwork.scene.pairing import Pairing
from knotwork.scene.robot_geometry import robot_geometry
from knotwork.scene.rules import given_rules
from knotwork.scene.solids import Solid, solid

FAR_OFF = 20.0
"""A mesh this many times larger than the arm's reach, or a thousand times smaller than that, is
plausibly in another unit."""

SAME_PLACE = 1e-6
"""Waypoints whose TCPs are this near one another [m] are at one place."""

DOUBTFUL = 4.0
"""A mesh this many times larger than the arm's reach may be in another unit, and so may one that is
fifty times this smaller."""


def robot_collision_model(robot: Robot) -> CollisionModel:
    """The collision model of a robot alone, as `knotwork robots NAME --collisions` lists it.

    Raises:
        InputError: A link's mesh or the SRDF can't be read.

    >>> model = robot_collision_model(kw.load_robot("ur5"))
    >>> len(model.bodies), model.ignored[0].first, model.ignored[0].reason
    (8, 'base_link', 'a joint joins them')
    """
    return _Builder(robot, Scene(), Places()).model()


class Hold(NamedTuple):
    """Where and when an object is held.

    Attributes:
        taken, left: Pose of the TCP, `pin.SE3` in the base frame, at the start and at the end.
        start, end: From when to when [s].
        coming: When the tool sets out to take it [s]; until then it must keep clear of it.
        gone: When the tool is away from it [s]; from then on it must keep clear of it.
    """

    taken: Any
    left: Any
    start: float
    end: float
    coming: float = -math.inf
    gone: float = math.inf


def hold_between(take: int, leave: int, times: Sequence[float], poses: Sequence[Any]) -> Hold:
    """When an object is held between two waypoints, and when the tool may be near it.

    The tool comes from the waypoint before it takes the object, and is gone at the one after it
    leaves it: the nearest at which the TCP is somewhere else.

    Args:
        take: Place of the waypoint where the object is taken.
        leave: Place of the waypoint where it is left.
        times: When each waypoint is reached [s].
        poses: Of the TCP at the waypoints, `pin.SE3` in the base frame.
    """

    def elsewhere(k: int, other: int) -> bool:
        return bool(np.abs(poses[k].translation - poses[other].translation).max() > SAME_PLACE)

    coming = (times[k] for k in range(take - 1, -1, -1) if elsewhere(k, take))
    gone = (times[k] for k in range(leave + 1, len(times)) if elsewhere(k, leave))
    return Hold(
        poses[take],
        poses[leave],
        times[take],
        times[leave],
        next(coming, -math.inf),
        next(gone, math.inf),
    )


def collision_model(scenario: Scenario, robot: Robot, holds: Mapping[str, Hold]) -> CollisionModel:
    """The collision model of a scenario.

    Args:
        scenario: The task.
        robot: Its robot, with its tool.
        holds: For each held object by name where and when it is held.

    Raises:
        DocumentError: A mesh is wrong, or a name in the scenario is unknown.
    """
    return _Builder(robot, scenario.scene, scenario.places, holds).model()


class _Builder:
    """Gathers bodies and pairs."""

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        places: Places,
        holds: Mapping[str, Hold] | None = None,
    ) -> None:
        self.robot, self.scene, self.places = robot, scene, places
        self.geometry = robot_geometry(robot)
        self.joints, self.links = self.geometry.joints, self.geometry.links
        self.holds = holds or {}
        self.notes: list[tuple[NoteKind, str]] = []

    def model(self) -> CollisionModel:
        scene, base = self.scene, self.robot.base_placement
        bodies = list(self.links.bodies)
        if scene.tool:
            bodies.append(self._tool(scene.tool))
        for one in scene.objects:
            if not one.visual:
                bodies.append(Body(one.name, "object", 0, (self._solid(one.shape, base),)))
        for held in scene.held:
            bodies += self._held(held.name, held.shape)
        if scene.tool:
            bodies = [replace(x, name=x.identity) if x.link == TOOL else x for x in bodies]
        given = given_rules(scene, self.robot, bodies, self.places)
        pairing = Pairing(self.robot, scene, self.geometry, given.reasons)
        pairs, ignored = pairing.pairs(bodies)
        return CollisionModel(
            self.joints,
            tuple(bodies),
            tuple(pairs),
            tuple(ignored),
            self.links.missing,
            self.links.bare,
            tuple(dict.fromkeys([*self.notes, *given.notes, *pairing.notes])),
        )

    def _tool(self, shapes: Sequence[Shape]) -> Body:
        robot = self.robot
        robot.require_tool()
        frame = robot.model.frames[robot.frame_index(robot.tool_frame or "")]
        solids = tuple(self._solid(shape, frame.placement) for shape in shapes)
        return Body(TOOL, "tool", int(frame.parentJoint), solids)

    def _held(self, name: str, shape: Shape) -> list[Body]:
        """A held object: where it is taken from, in the tool, and where it is left."""
        robot, base = self.robot, self.robot.base_placement
        frame = robot.model.frames[robot.require_tool()]
        hold = self.holds[name]
        here, there = ((self._solid(shape, base * pose),) for pose in (hold.taken, hold.left))
        carried = (self._solid(shape, frame.placement),)
        bodies = [
            Body(name, "object", 0, here, end=hold.coming, apart=True),
            Body(name, "object", 0, here, hold.coming, hold.start),
            Body(name, "held", int(frame.parentJoint), carried, hold.start, hold.end),
            Body(name, "object", 0, there, hold.end, hold.gone),
            Body(name, "object", 0, there, start=hold.gone, apart=True),
        ]
        return [body for body in bodies if body.start < body.end]

    def _solid(self, shape: Shape, carrier: Any) -> Solid:
        """A shape of the scenario as a solid; errors say where it stands."""
        try:
            made = solid(shape, carrier)
            if shape.path is not None:
                self._check_size(made, shape)
        except InputError as error:
            raise self.places.error((*shape.place, shape.kind), str(error)) from error
        return made

    def _check_size(self, made: Solid, shape: Shape) -> None:
        """Refuse a file that is plausibly in another unit; warn of one that may be."""
        size, reach = 2.0 * made.radius, self._reach
        what = f"{'mesh' if shape.kind == 'mesh' else 'point cloud'} {shape.path}"
        for factor in (1e-3, 1e3):
            far = size > FAR_OFF * reach if factor < 1 else size < reach / (FAR_OFF * 50)
            if far and reach / 200 <= size * factor <= FAR_OFF * reach:
                raise InputError(
                    f"{what} is {size:.4g} m across, and the arm reaches {reach:.2g} m: "
                    f"it is plausibly in another unit; a scale {factor:g} times as large makes it "
                    f"{size * factor:.4g} m"
                )
            doubtful = size > DOUBTFUL * reach if factor < 1 else size < reach / (50 * DOUBTFUL)
            if doubtful and reach / 200 <= size * factor <= FAR_OFF * reach:
                self.notes.append(
                    (
                        "warning",
                        f"{what} is {size:.4g} m across, and the arm reaches "
                        f"{reach:.2g} m: it may be in another unit; a scale {factor:g} times "
                        f"as large makes it {size * factor:.4g} m",
                    )
                )

    @cached_property
    def _reach(self) -> float:
        """How far the arm reaches at most, stretched out [m]."""
        return float(np.linalg.norm(self.joints.translation, axis=1).sum()) + 0.1
