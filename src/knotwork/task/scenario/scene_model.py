"""Surroundings, tool shapes, held objects and collision rules, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from knotwork.task.scene_shapes import Collisions
from knotwork.units import SI, Units

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.tool_paths.task_frame import TaskFrame
    from knotwork.robot.payload import Payload


@dataclass(frozen=True, eq=False)
class PlacedShape:
    """A solid, placed in the axes of a frame or of the tool.

    Attributes:
        kind: `"box"`, `"sphere"`, `"cylinder"`, `"capsule"`, `"cone"`, `"ellipsoid"`,
            `"half_space"`, `"mesh"` or `"points"`.
        size: Edges of a box; radius of a sphere; radius and length of a solid of revolution; half
            axes of an ellipsoid; unit normal and offset of a half space [m].
        placement: Placement in these axes.
        path: File of a mesh or of points, or `None`.
        scale: Scale factors of the file to m, along x, y and z.
        exact: Whether the exact mesh is checked, not its convex hull.
        resolution: Edge length of the cells of a point cloud [m].
        location: Location in the scenario.
        units: Units of its file, for messages.
    """

    kind: str
    size: tuple[float, ...]
    placement: pin.SE3
    path: Path | None = None
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    exact: bool = False
    resolution: float = 0.0
    location: tuple[str | int, ...] = ()
    units: Units = SI


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object that is fixed in a frame.

    Attributes:
        name: Its name.
        shape: Its shape, placed in the base frame, with its frame at rest.
        frame: Its frame.
        allow: Names of bodies that may touch it.
        visual: Whether it is only shown, and not checked.
        appears: Index in the scenario of the waypoint at which it appears, or `None`.
    """

    name: str
    shape: PlacedShape
    frame: TaskFrame
    allow: tuple[str, ...] = ()
    visual: bool = False
    appears: int | None = None


@dataclass(frozen=True, eq=False)
class PlacedHeldObject:
    """An object that moves with the tool between two waypoints.

    Attributes:
        name: Its name.
        shape: Its shape, placed in the axes of the TCP.
        taken_at, released_at: Indices in the scenario of the waypoints where it is taken and
            released.
        end_frames: Its frames before it is taken and after its release.
        allow: Names of bodies that it may touch; the tool may touch it in any case.
        appears: Index in the scenario of the waypoint at which it appears, or `None`.
        payload: Its mass, in the axes of the TCP, or `None`.
    """

    name: str
    shape: PlacedShape
    taken_at: int
    released_at: int
    end_frames: tuple[TaskFrame, TaskFrame]
    allow: tuple[str, ...] = ()
    appears: int | None = None
    payload: Payload | None = None


@dataclass(frozen=True, eq=False)
class PlacedRobot:
    """Another robot in motion.

    Attributes:
        name: Its name.
        placement: Placement of its base frame in the cell, a `pin.SE3`.
        scenario: The name of a shipped scenario, or the path of one.
        motion: Path of its recorded motion, or `None` to plan its scenario.
        delay: Delay of its motion relative to the robot's own [s].
    """

    name: str
    placement: pin.SE3
    scenario: str | Path
    motion: Path | None = None
    delay: float = 0.0


@dataclass(frozen=True, eq=False)
class Scene:
    """Surroundings of the robot and held objects.

    Attributes:
        objects: Objects in frames.
        tool: Shapes of the tool, in the axes of the frame that carries it.
        held: Objects that the tool holds.
        robots: Other robots.
        collisions: Collision checks and their precision, in SI.
        margin: Required clearance from the surroundings [m].
        frames: Frames of the file by name.
    """

    objects: tuple[PlacedObject, ...] = ()
    tool: tuple[PlacedShape, ...] = ()
    held: tuple[PlacedHeldObject, ...] = ()
    robots: tuple[PlacedRobot, ...] = ()
    collisions: Collisions = field(default_factory=Collisions.model_construct)
    margin: float = 0.0
    frames: Mapping[str, TaskFrame] = field(default_factory=dict)

    @property
    def has_moving_bodies(self) -> bool:
        """Whether any body that may collide moves independently of the robot."""
        frames = [item.frame for item in self.objects if not item.visual]
        frames += [frame for held in self.held for frame in held.end_frames]
        return bool(self.robots) or any(frame.is_moving for frame in frames)

    @property
    def is_checked(self) -> bool:
        """Whether collisions are checked."""
        return self.collisions.itself or self.has_bodies

    @property
    def has_bodies(self) -> bool:
        """Whether the scenario has bodies to check in addition to the links of the robot."""
        objects = any(not item.visual for item in self.objects)
        return bool(self.tool or self.held or self.robots or objects)
