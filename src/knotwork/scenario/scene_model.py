"""What stands around the robot and what it carries, in SI: shapes, objects, rules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.robot.payload import Payload
    from knotwork.tool_paths.moving_frame import MovingFrame


STANDING = "base"
"""What carries a frame that stands where poses are given in one that joints move."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A solid, placed in the frame that carries it.

    Attributes:
        kind: `"box"`, `"sphere"`, `"cylinder"`, `"capsule"`, `"cone"`, `"ellipsoid"`,
            `"half_space"`, `"mesh"` or `"points"`.
        size: Edges of a box; radius of a sphere; radius and length of a solid of revolution; half
            axes of an ellipsoid; unit normal and offset of a half space [m].
        placement: In the frame that carries it.
        path: File of a mesh or of points, or `None`.
        scale: Factors from the file's numbers to m, along x, y and z.
        exact: A mesh is checked as it is, not its convex hull.
        resolution: Edge of the cells that points fill [m].
        place: Where it was given in the scenario.
    """

    kind: str
    size: tuple[float, ...]
    placement: pin.SE3
    path: Path | None = None
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    exact: bool = False
    resolution: float = 0.0
    place: tuple[str | int, ...] = ()


@dataclass(frozen=True, eq=False)
class SceneObject:
    """An object that stands still, or rides along with a moving frame.

    Attributes:
        name: Its name.
        shape: Placed in the base frame, while what carries it is at rest.
        allow: Names of what may touch it.
        visual: It is only shown, never checked.
        carrier: What carries it, or `None`.
        appears: Name of the waypoint from which on it is there, or `None`.
    """

    name: str
    shape: Shape
    allow: tuple[str, ...] = ()
    visual: bool = False
    carrier: MovingFrame | None = None
    appears: str | None = None


@dataclass(frozen=True, eq=False)
class HeldObject:
    """An object that moves with the tool between two waypoints.

    Attributes:
        name: Its name.
        shape: Placed in the axes of the TCP.
        take, leave: Names of the waypoints where the tool takes it and leaves it.
        allow: Names of what it may touch; the tool may touch it anyway.
        carriers: What carries it before it is taken, and after it is left; `None` where it stands.
        appears: Name of the waypoint from which on it is there, or `None`.
        payload: Its mass, in the axes of the TCP, or `None` where it has none of its own.
    """

    name: str
    shape: Shape
    take: str
    leave: str
    allow: tuple[str, ...] = ()
    carriers: tuple[MovingFrame | None, MovingFrame | None] = (None, None)
    appears: str | None = None
    payload: Payload | None = None


@dataclass(frozen=True, eq=False)
class OtherRobot:
    """Another robot in motion.

    Attributes:
        name: Its name.
        placement: Of its base frame, `pin.SE3` in the base frame.
        scenario: The name of a shipped scenario, or the path of one.
        motion: Path of its recorded motion, or `None` to plan its scenario.
        delay: How much later than the robot's own its motion begins [s].
        carrier: What stands, where joints move the base frame; `placement` is in it then.
    """

    name: str
    placement: pin.SE3
    scenario: str | Path
    motion: Path | None = None
    delay: float = 0.0
    carrier: MovingFrame | None = None


@dataclass(frozen=True)
class CollisionRules:
    """What is checked for collisions, and how closely.

    Attributes:
        itself: The robot is checked against itself and its tool.
        ignore: Pairs of names that are not checked.
        margin: Clearance to keep from the surroundings [m].
        resolution: A clearance nearer than this to what must be kept counts as failed [m].
    """

    itself: bool = True
    ignore: tuple[tuple[str, str], ...] = ()
    margin: float = 0.0
    resolution: float = 1e-4


@dataclass(frozen=True, eq=False)
class Scene:
    """Surroundings of the robot and what it carries.

    Attributes:
        objects: What stands still, or rides along with a moving frame.
        tool: Shapes of the tool, in the axes of the frame that carries it.
        held: What the tool takes along.
        robots: Other robots.
        rules: What is checked, and how closely.
        moving: Those frames of the file that move, by name.
    """

    objects: tuple[SceneObject, ...] = ()
    tool: tuple[Shape, ...] = ()
    held: tuple[HeldObject, ...] = ()
    robots: tuple[OtherRobot, ...] = ()
    rules: CollisionRules = CollisionRules()
    moving: Mapping[str, MovingFrame] = field(default_factory=dict)

    @property
    def moves(self) -> bool:
        """Whether anything that may collide moves by itself."""
        carriers = [one.carrier for one in self.objects if not one.visual]
        carriers += [carrier for one in self.held for carrier in one.carriers]
        return bool(self.robots) or any(one is not None and one.moves for one in carriers)

    def asks(self) -> bool:
        """Whether anything of the scenario has to be checked besides the robot's own links."""
        objects = any(not one.visual for one in self.objects)
        return bool(self.tool or self.held or self.robots or objects)
