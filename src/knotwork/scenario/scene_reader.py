"""The scene of a scenario file: shapes, objects and rules in SI."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knotwork.documents import Location
from knotwork.errors import did_you_mean
from knotwork.scenario.payloads import read_payload
from knotwork.scenario.scenario import ScenarioWaypoint
from knotwork.scenario.scene_model import (
    STANDING,
    CollisionRules,
    GraspedObject,
    PlacedObject,
    PlacedRobot,
    PlacedShape,
    Scene,
)
from knotwork.scenario.waypoint_reader import WaypointReader
from knotwork.task.surroundings import (
    SHAPES,
    HeldObject,
    OtherRobot,
    SceneObject,
    SolidOfRevolution,
    ToolShape,
)

if TYPE_CHECKING:
    from knotwork.tool_paths.moving_frame import MovingFrame

TOOL = "tool"
"""Common name of all tool shapes, next to those of links and objects."""


def read_scene(reader: WaypointReader, waypoints: Sequence[ScenarioWaypoint]) -> Scene:
    """Read the scene of a scenario file.

    Args:
        reader: Reader of the same file.
        waypoints: Waypoints in order of time.

    Raises:
        DocumentError: A frame or a waypoint does not exist, or a name is given twice.
    """
    file = reader.file
    scene, tool = file.scene, file.tool
    objects = tuple(
        PlacedObject(
            name,
            _shape(reader, one, ("scene", "objects", name), one.parent),
            tuple(one.allow),
            one.visual,
            _object_carrier(reader, one, ("scene", "objects", name)),
            _appears(reader, one, ("scene", "objects", name), waypoints),
        )
        for name, one in scene.objects.items()
    )
    if TOOL in scene.objects:
        raise reader.places.error(
            ("scene", "objects", TOOL), "is a reserved name", "any other name for an object"
        )
    given = tool.shape if tool is not None else None
    one = isinstance(given, ToolShape)
    shapes = (given,) if isinstance(given, ToolShape) else given or ()
    rules = file.collisions
    return Scene(
        objects=objects,
        tool=tuple(
            _shape(reader, shape, ("tool", "shape", *(() if one else (i,))), moves=True)
            for i, shape in enumerate(shapes)
        ),
        held=tuple(
            _held(reader, name, held, waypoints)
            for name, held in (tool.holds if tool is not None else {}).items()
        ),
        robots=tuple(_robot(reader, name, one) for name, one in scene.robots.items()),
        rules=CollisionRules(
            rules.itself,
            tuple((pair[0], pair[1]) for pair in rules.ignore),
            scene.margin,
            CollisionRules.resolution if rules.resolution is None else rules.resolution,
        ),
        moving={k: frame for k in file.frames if (frame := _carrier(reader, k)) is not None},
    )


def _held(
    reader: WaypointReader,
    name: str,
    given: HeldObject,
    waypoints: Sequence[ScenarioWaypoint],
) -> GraspedObject:
    place: Location = ("tool", "holds", name)
    if name == TOOL or name in reader.file.scene.objects:
        raise reader.places.error(place, f"{name!r} is the name of something else", "a unique name")
    names = [waypoint.name for waypoint in waypoints]
    for key, waypoint in (("from", given.take), ("to", given.leave)):
        _find(reader, waypoint, (*place, key), names)
        if getattr(waypoints[names.index(waypoint)], "freedom", None) is not None:
            raise reader.places.error(
                (*place, key),
                f"the pose at {waypoint!r} is free, so the grasp of the object is undefined",
                "a pose with free: none",
            )
    if names.index(given.leave) <= names.index(given.take):
        raise reader.places.error(
            (*place, "to"), f"{given.leave!r} is not after {given.take!r}", "a waypoint after it"
        )
    appears = _appears(reader, given, place, waypoints)
    if appears is not None and names.index(appears) > names.index(given.take):
        raise reader.places.error(
            (*place, "appears"), f"{appears!r} is after {given.take!r}", "a waypoint before it"
        )
    shape = _shape(reader, given, place, moves=True)
    ends = (reader.indices[names.index(one)] for one in (given.take, given.leave))
    still = replace(reader.frames.moving["base"], link=STANDING)
    taken, left = (
        still if reader.carriers.is_fixed(i) else reader.carriers.frame_of(i) for i in ends
    )
    payload = read_payload(given, reader.places, place)
    return GraspedObject(
        name, shape, given.take, given.leave, tuple(given.allow), (taken, left), appears, payload
    )


def _find(reader: WaypointReader, name: str, place: Location, names: Sequence[str]) -> None:
    if name not in names:
        raise reader.places.error(
            place, f"there is no waypoint {name!r}", did_you_mean(name, names)
        )


def _appears(
    reader: WaypointReader,
    given: SceneObject | HeldObject,
    place: Location,
    waypoints: Sequence[ScenarioWaypoint],
) -> str | None:
    """Name of the waypoint at which an object appears; `None` if it is always present."""
    if given.appears is not None:
        names = [waypoint.name for waypoint in waypoints]
        _find(reader, given.appears, (*place, "appears"), names)
    return given.appears


def _carrier(reader: WaypointReader, name: str) -> MovingFrame | None:
    """The motion of a frame relative to that of the poses; `None` if it is fixed there."""
    frame = reader.frames.moving[name]
    if frame.link != reader.carriers.link:
        return replace(frame, link=frame.link or STANDING)
    return replace(frame, link="") if frame.moves else None


def _object_carrier(
    reader: WaypointReader, given: SceneObject, place: Location
) -> MovingFrame | None:
    """The moving frame of an object; `None` if it is fixed."""
    frame = _carrier(reader, given.parent)
    if frame is None:
        return None
    if given.half_space is not None:
        raise reader.places.error(
            (*place, "half_space"),
            f"moves with frame {given.parent!r} relative to the poses, which is not supported",
            "a box",
        )
    return frame


def _robot(reader: WaypointReader, name: str, given: OtherRobot) -> PlacedRobot:
    place: Location = ("scene", "robots", name)
    frame = reader.frames.find(given.parent, (*place, "in"))
    found = reader.frames.moving[frame]
    if found.moves or found.link:
        raise reader.places.error(
            (*place, "in"),
            f"frame {frame!r} moves; the robot's base must not",
            "a fixed frame",
        )
    folder = reader.places.file.parent if reader.places.file is not None else Path()
    path = folder / os.path.expanduser(given.scenario)
    motion = None
    if given.motion is not None:
        motion = reader.places.named_file(given.motion, (*place, "motion"))
    return PlacedRobot(
        name,
        reader.frames[frame] * reader.placement(given, place),
        path if path.is_file() else given.scenario,
        motion,
        given.delay,
        _carrier(reader, frame),
    )


def _shape(
    reader: WaypointReader,
    given: ToolShape | SceneObject | HeldObject,
    place: Location,
    frame: str | None = None,
    *,
    moves: bool = False,
) -> PlacedShape:
    """A shape in SI, placed in the frame that carries it, or in the base if a frame is named."""
    if moves and given.half_space is not None:
        raise reader.places.error(
            (*place, "half_space"), "moves with the tool, which a half space must not", "a box"
        )
    placement = reader.placement(given, place)
    if frame is not None:
        placement = reader.frames[reader.frames.find(frame, (*place, "in"))] * placement
    kind = next(name for name in SHAPES if getattr(given, name) is not None)
    path, scale, resolution = None, 1.0, 0.0
    if given.points is not None:
        path = reader.places.named_file(given.points.file, (*place, "points", "file"))
        scale = given.points.scale * reader.length
        resolution = given.points.resolution
    if given.mesh is not None:
        path = reader.places.named_file(given.mesh, (*place, "mesh"))
        own_unit = path.suffix.lower() == ".dae"
        scale = (given.scale or 1.0) * (1.0 if own_unit else reader.length)
    scales = (scale, scale, scale)
    exact = bool(given.exact)
    size = _size(given)
    return PlacedShape(kind, size, placement, path, scales, exact, resolution, place)


def _size(given: ToolShape | SceneObject | HeldObject) -> tuple[float, ...]:
    if given.half_space is not None:
        normal = np.array(given.half_space.normal)
        normal /= np.abs(normal).max()
        return (*(normal / np.linalg.norm(normal)).tolist(), given.half_space.offset)
    for turned in (given.cylinder, given.capsule, given.cone):
        if isinstance(turned, SolidOfRevolution):
            return turned.radius, turned.length
    return tuple(given.box or given.ellipsoid or (given.sphere or 0.0,))
