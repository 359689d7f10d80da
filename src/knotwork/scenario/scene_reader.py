"""The scene of a scenario file: shapes, objects and rules in SI."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import did_you_mean
from knotwork.files.documents import Location
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
            _read_shape(reader, item, ("scene", "objects", name), item.parent),
            tuple(item.allow),
            item.visual,
            _carrier_of_object(reader, item, ("scene", "objects", name)),
            _read_appearance(reader, item, ("scene", "objects", name), waypoints),
        )
        for name, item in scene.objects.items()
    )
    if TOOL in scene.objects:
        raise reader.places.error(
            ("scene", "objects", TOOL), "is a reserved name", "any other name for an object"
        )
    tool_shape = tool.shape if tool is not None else None
    is_single = isinstance(tool_shape, ToolShape)
    shapes = (tool_shape,) if isinstance(tool_shape, ToolShape) else tool_shape or ()
    rules = file.collisions
    return Scene(
        objects=objects,
        tool=tuple(
            _read_shape(reader, shape, ("tool", "shape", *(() if is_single else (i,))), moves=True)
            for i, shape in enumerate(shapes)
        ),
        held=tuple(
            _read_held(reader, name, held, waypoints)
            for name, held in (tool.holds if tool is not None else {}).items()
        ),
        robots=tuple(_read_robot(reader, name, robot) for name, robot in scene.robots.items()),
        rules=CollisionRules(
            rules.itself,
            tuple((pair[0], pair[1]) for pair in rules.ignore),
            scene.margin,
            CollisionRules.resolution if rules.resolution is None else rules.resolution,
        ),
        moving={
            k: frame for k in file.frames if (frame := _carrier_of_frame(reader, k)) is not None
        },
    )


def _read_held(
    reader: WaypointReader,
    name: str,
    held: HeldObject,
    waypoints: Sequence[ScenarioWaypoint],
) -> GraspedObject:
    place: Location = ("tool", "holds", name)
    if name == TOOL or name in reader.file.scene.objects:
        raise reader.places.error(place, f"{name!r} is the name of something else", "a unique name")
    names = [waypoint.name for waypoint in waypoints]
    for key, waypoint in (("from", held.take), ("to", held.leave)):
        _check_waypoint(reader, waypoint, (*place, key), names)
        if getattr(waypoints[names.index(waypoint)], "freedom", None) is not None:
            raise reader.places.error(
                (*place, key),
                f"the pose at {waypoint!r} is free, so the grasp of the object is undefined",
                "a pose with free: none",
            )
    if names.index(held.leave) <= names.index(held.take):
        raise reader.places.error(
            (*place, "to"), f"{held.leave!r} is not after {held.take!r}", "a waypoint after it"
        )
    appears = _read_appearance(reader, held, place, waypoints)
    if appears is not None and names.index(appears) > names.index(held.take):
        raise reader.places.error(
            (*place, "appears"), f"{appears!r} is after {held.take!r}", "a waypoint before it"
        )
    shape = _read_shape(reader, held, place, moves=True)
    ends = (reader.indices[names.index(waypoint)] for waypoint in (held.take, held.leave))
    still = replace(reader.frames.moving["base"], link=STANDING)
    taken_from, left_on = (
        still if reader.carriers.is_fixed(i) else reader.carriers.frame_of(i) for i in ends
    )
    payload = read_payload(held, reader.places, place)
    return GraspedObject(
        name,
        shape,
        held.take,
        held.leave,
        tuple(held.allow),
        (taken_from, left_on),
        appears,
        payload,
    )


def _check_waypoint(
    reader: WaypointReader, name: str, place: Location, names: Sequence[str]
) -> None:
    if name not in names:
        raise reader.places.error(
            place, f"there is no waypoint {name!r}", did_you_mean(name, names)
        )


def _read_appearance(
    reader: WaypointReader,
    item: SceneObject | HeldObject,
    place: Location,
    waypoints: Sequence[ScenarioWaypoint],
) -> str | None:
    """Name of the waypoint at which an object appears; `None` if it is always present."""
    if item.appears is not None:
        names = [waypoint.name for waypoint in waypoints]
        _check_waypoint(reader, item.appears, (*place, "appears"), names)
    return item.appears


def _carrier_of_frame(reader: WaypointReader, name: str) -> MovingFrame | None:
    """The motion of a frame relative to that of the poses; `None` if it is fixed there."""
    frame = reader.frames.moving[name]
    if frame.link != reader.carriers.link:
        return replace(frame, link=frame.link or STANDING)
    return replace(frame, link="") if frame.moves else None


def _carrier_of_object(
    reader: WaypointReader, item: SceneObject, place: Location
) -> MovingFrame | None:
    """The moving frame of an object; `None` if it is fixed."""
    frame = _carrier_of_frame(reader, item.parent)
    if frame is None:
        return None
    if item.half_space is not None:
        raise reader.places.error(
            (*place, "half_space"),
            f"moves with frame {item.parent!r} relative to the poses, which is not supported",
            "a box",
        )
    return frame


def _read_robot(reader: WaypointReader, name: str, robot: OtherRobot) -> PlacedRobot:
    place: Location = ("scene", "robots", name)
    frame = reader.frames.find(robot.parent, (*place, "in"))
    base = reader.frames.moving[frame]
    if base.moves or base.link:
        raise reader.places.error(
            (*place, "in"),
            f"frame {frame!r} moves; the robot's base must not",
            "a fixed frame",
        )
    folder = reader.places.file.parent if reader.places.file is not None else Path()
    path = folder / os.path.expanduser(robot.scenario)
    motion = None
    if robot.motion is not None:
        motion = reader.places.named_file(robot.motion, (*place, "motion"))
    return PlacedRobot(
        name,
        reader.frames[frame] * reader.placement(robot, place),
        path if path.is_file() else robot.scenario,
        motion,
        robot.delay,
        _carrier_of_frame(reader, frame),
    )


def _read_shape(
    reader: WaypointReader,
    item: ToolShape | SceneObject | HeldObject,
    place: Location,
    frame: str | None = None,
    *,
    moves: bool = False,
) -> PlacedShape:
    """A shape in SI, placed in the frame that carries it, or in the base if a frame is named."""
    if moves and item.half_space is not None:
        raise reader.places.error(
            (*place, "half_space"), "moves with the tool, which a half space must not", "a box"
        )
    placement = reader.placement(item, place)
    if frame is not None:
        placement = reader.frames[reader.frames.find(frame, (*place, "in"))] * placement
    kind = next(name for name in SHAPES if getattr(item, name) is not None)
    path, scale, resolution = None, 1.0, 0.0
    if item.points is not None:
        path = reader.places.named_file(item.points.file, (*place, "points", "file"))
        scale = item.points.scale * reader.length
        resolution = item.points.resolution
    if item.mesh is not None:
        path = reader.places.named_file(item.mesh, (*place, "mesh"))
        own_unit = path.suffix.lower() == ".dae"
        scale = (item.scale or 1.0) * (1.0 if own_unit else reader.length)
    scales = (scale, scale, scale)
    exact = bool(item.exact)
    size = _shape_size(item)
    return PlacedShape(kind, size, placement, path, scales, exact, resolution, place)


def _shape_size(item: ToolShape | SceneObject | HeldObject) -> tuple[float, ...]:
    if item.half_space is not None:
        normal = np.array(item.half_space.normal)
        normal /= np.abs(normal).max()
        return (*(normal / np.linalg.norm(normal)).tolist(), item.half_space.offset)
    for turned in (item.cylinder, item.capsule, item.cone):
        if isinstance(turned, SolidOfRevolution):
            return turned.radius, turned.length
    return tuple(item.box or item.ellipsoid or (item.sphere or 0.0,))
