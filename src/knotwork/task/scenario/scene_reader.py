"""The scene of a scenario file: shapes, objects and rules in SI."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knotwork.errors import DocumentError
from knotwork.errors.plain_text import quoted_waypoint
from knotwork.files.documents import Location
from knotwork.task import Tool
from knotwork.task.scenario.payloads import read_payload
from knotwork.task.scenario.scenario import ScenarioWaypoint
from knotwork.task.scenario.scene_model import (
    PlacedHeldObject,
    PlacedObject,
    PlacedRobot,
    PlacedShape,
    Scene,
)
from knotwork.task.scenario.task_reading import TaskReading
from knotwork.task.scene_shapes import (
    FIXED_SHAPES,
    HeldObject,
    OtherRobot,
    SceneObject,
    SolidOfRevolution,
    ToolShape,
)

RESERVED_NAME = "tool"
"""Common name of all tool shapes, next to those of links and objects."""


def read_scene(
    reading: TaskReading, waypoints: Sequence[ScenarioWaypoint], task_index: Sequence[int]
) -> Scene:
    """Read the scene of a task.

    Args:
        reading: The task in SI, with its frames.
        waypoints: Waypoints of its scenario, in order of time.
        task_index: Index in the task of each of them.

    Raises:
        DocumentError: A frame or a waypoint does not exist, or a name is given twice.
    """
    return _SceneReader(reading, waypoints, task_index).scene()


@dataclass(frozen=True, eq=False)
class _SceneReader:
    """Reads a scene."""

    reading: TaskReading
    waypoints: Sequence[ScenarioWaypoint]
    task_index: Sequence[int]

    def scene(self) -> Scene:
        task = self.reading.task
        scene, tool = task.scene, task.tool or Tool()
        objects = tuple(self._object(name, item) for name, item in scene.objects.items())
        if RESERVED_NAME in scene.objects:
            raise self._error(
                ("scene", "objects", RESERVED_NAME),
                "is a reserved name",
                "any other name for an object",
            )
        location: Location = ("tool", "shape")
        if isinstance(tool.shape, ToolShape):
            shapes = [self._shape(tool.shape, location)]
        else:
            shapes = [self._shape(item, (*location, i)) for i, item in enumerate(tool.shape or ())]
        return Scene(
            objects=objects,
            tool=tuple(shapes),
            held=tuple(self._held(name, held) for name, held in tool.holds.items()),
            robots=tuple(self._robot(name, robot) for name, robot in scene.robots.items()),
            collisions=task.collisions,
            margin=scene.margin,
            frames={name: self.reading.pose_frames.named[name] for name in task.frames},
        )

    def _error(self, location: Location, fault: str, accepted: str) -> DocumentError:
        return self.reading.locations.error(location, fault, accepted)

    def _waypoint(self, name: str, location: Location) -> int:
        """Index of a waypoint by name."""
        names = [waypoint.name for waypoint in self.waypoints]
        self.reading.locations.check_name(location, "waypoint", name, names)
        return names.index(name)

    def _appearance(self, item: SceneObject | HeldObject, location: Location) -> int | None:
        """Index of the waypoint at which an object appears, or `None`."""
        if item.appears is None:
            return None
        return self._waypoint(item.appears, (*location, "appears"))

    def _object(self, name: str, item: SceneObject) -> PlacedObject:
        location: Location = ("scene", "objects", name)
        shape = self._shape(item, location)
        frame = self.reading.pose_frames.named[item.parent]
        if item.half_space is not None and not frame.rests_on(self.reading.pose_frames.link):
            raise self._error(
                (*location, "half_space"),
                f"moves with frame {item.parent!r} relative to the poses, which is not supported",
                "a box",
            )
        appears = self._appearance(item, location)
        return PlacedObject(name, shape, frame, tuple(item.allow), item.visual, appears)

    def _held(self, name: str, held: HeldObject) -> PlacedHeldObject:
        location: Location = ("tool", "holds", name)
        if name == RESERVED_NAME or name in self.reading.task.scene.objects:
            raise self._error(location, f"{name!r} is the name of something else", "a unique name")
        taken_at = self._waypoint(held.taken_at, (*location, "from"))
        released_at = self._waypoint(held.released_at, (*location, "to"))
        for key, i in (("from", taken_at), ("to", released_at)):
            if getattr(self.waypoints[i], "freedom", None) is not None:
                raise self._error(
                    (*location, key),
                    f"the pose at {quoted_waypoint(self.waypoints[i].name)} is free, so the "
                    "grasp of the object is undefined",
                    "a pose with free: none",
                )
        if released_at <= taken_at:
            raise self._error(
                (*location, "to"),
                f"{held.released_at!r} is not after {held.taken_at!r}",
                "a waypoint after it",
            )
        appears = self._appearance(held, location)
        if appears is not None and appears > taken_at:
            raise self._error(
                (*location, "appears"),
                f"{held.appears!r} is after {held.taken_at!r}",
                "a waypoint before",
            )
        frames = self.reading.pose_frames
        return PlacedHeldObject(
            name=name,
            shape=self._shape(held, location),
            taken_at=taken_at,
            released_at=released_at,
            end_frames=(frames[self.task_index[taken_at]], frames[self.task_index[released_at]]),
            allow=tuple(held.allow),
            appears=appears,
            payload=read_payload(held, self.reading.locations, location),
        )

    def _robot(self, name: str, robot: OtherRobot) -> PlacedRobot:
        location: Location = ("scene", "robots", name)
        locations, frames = self.reading.locations, self.reading.pose_frames.named
        base = frames[frames.checked_name(robot.parent, (*location, "in"))]
        if not base.rests_on(""):
            raise self._error(
                (*location, "in"),
                f"frame {robot.parent!r} moves; the robot's base must not",
                "a fixed frame",
            )
        folder = locations.file.parent if locations.file is not None else Path()
        path = folder / os.path.expanduser(robot.scenario)
        motion = robot.motion and locations.named_file(robot.motion, (*location, "motion"))
        return PlacedRobot(
            name=name,
            placement=base.rest_placement * self.reading.placement(robot, *location),
            scenario=path if path.is_file() else robot.scenario,
            motion=motion or None,
            delay=robot.delay,
        )

    def _shape(self, item: ToolShape | SceneObject | HeldObject, location: Location) -> PlacedShape:
        """A shape, placed in the axes of the tool, or in the base frame if it is an object."""
        locations, placement = self.reading.locations, self.reading.placement(item, *location)
        if isinstance(item, SceneObject):
            frames = self.reading.pose_frames.named
            parent = frames[frames.checked_name(item.parent, (*location, "in"))]
            placement = parent.rest_placement * placement
        kind = next(name for name in FIXED_SHAPES if getattr(item, name, None) is not None)
        path, scale, resolution = None, 1.0, 0.0
        if item.points is not None:
            path = locations.named_file(item.points.file, (*location, "points", "file"))
            scale = item.points.scale * self.reading.metres_per_unit
            resolution = item.points.resolution
        if item.mesh is not None:
            path = locations.named_file(item.mesh, (*location, "mesh"))
            has_unit = path.suffix.lower() == ".dae"
            scale = (item.scale or 1.0) * (1.0 if has_unit else self.reading.metres_per_unit)
        return PlacedShape(
            kind,
            _shape_size(item),
            placement,
            path,
            scale=(scale, scale, scale),
            exact=bool(item.exact),
            resolution=resolution,
            location=location,
            units=self.reading.units,
        )


def _shape_size(item: ToolShape | SceneObject | HeldObject) -> tuple[float, ...]:
    if isinstance(item, SceneObject) and item.half_space is not None:
        normal = np.array(item.half_space.normal)
        normal /= np.abs(normal).max()
        return (*(normal / np.linalg.norm(normal)).tolist(), item.half_space.offset)
    for turned in (item.cylinder, item.capsule, item.cone):
        if isinstance(turned, SolidOfRevolution):
            return turned.radius, turned.length
    return tuple(item.box or item.ellipsoid or (item.sphere or 0.0,))
