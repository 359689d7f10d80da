"""Shapes of surroundings, tool and held objects of a task; collision rules."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from knotwork.documents import Text
from knotwork.documents.values import (
    LARGEST,
    Forms,
    Items,
    Number,
    Positive,
    Several,
    Vector3,
    optional,
)
from knotwork.task.masses import Inertia, Mass
from knotwork.task.part import TaskPart
from knotwork.task.poses import Placement

Size3 = Annotated[Items[Positive], Field(min_length=3, max_length=3)]
Flag = Annotated[bool, Field(strict=True)]
Distance = Annotated[float, Field(strict=True, ge=0, le=LARGEST)]

SHAPES = (
    *("box", "sphere", "cylinder", "capsule", "cone", "ellipsoid"),
    *("half_space", "mesh", "points"),
)
"""Keys of which a shape gives exactly one."""


class SolidOfRevolution(TaskPart):
    """A solid of revolution about z, its middle at the origin."""

    radius: Positive = Field(description="[length]")
    length: Positive = Field(
        description="Along z; of a capsule between the centres of its half spheres [length]"
    )


def _a_direction(vector: tuple[float, ...]) -> tuple[float, ...]:
    if not any(vector):
        raise ValueError("must not be zero: it says which way is out of the solid")
    return vector


class HalfSpace(TaskPart):
    """Everything behind a plane: a floor, a wall."""

    normal: Annotated[Vector3, AfterValidator(_a_direction)] = Field(
        description="Out of the solid, of any length"
    )
    offset: Number = optional("Of the plane from the origin along it [length]", 0.0)


class PointCloud(TaskPart):
    """Points, as a scanner gives them: every cell of a grid that holds one is solid."""

    file: Text = Field(
        description="Path of a CSV file with columns x, y, z or a PLY file, relative to this file; "
        "its numbers are in this file's unit of length"
    )
    scale: Positive = optional("Factor on its numbers", 1.0)
    resolution: Positive = Field(
        description="Edge of a cell; larger than the gaps between points [length]"
    )


class _Shape(Placement):
    position: Vector3 = optional(
        "Of the shape's middle; of a file's origin [length]", (0.0, 0.0, 0.0)
    )
    box: Size3 | None = optional("Size along x, y and z [length]")
    sphere: Positive | None = optional("Its radius [length]")
    cylinder: SolidOfRevolution | None = optional("About z")
    capsule: SolidOfRevolution | None = optional("About z: a cylinder with half spheres")
    cone: SolidOfRevolution | None = optional("About z, its tip up")
    ellipsoid: Size3 | None = optional("Half axes along x, y and z [length]")
    half_space: HalfSpace | None = optional("A floor or a wall without end")
    mesh: Text | None = optional(
        "Path of an STL, OBJ, PLY or COLLADA file, relative to this file; its numbers "
        "are in this file's unit of length (COLLADA says its own)"
    )
    points: PointCloud | None = optional("A point cloud")
    scale: Positive | None = optional("Factor on a mesh; left out: 1")
    exact: Flag | None = optional(
        "Check a mesh as it is, not its convex hull; it must be watertight. Left out: false"
    )

    @model_validator(mode="after")
    def _one_shape(self) -> _Shape:
        given = [name for name in SHAPES if getattr(self, name) is not None]
        if len(given) != 1:
            found = f"gives {' and '.join(given)}" if given else "gives no shape"
            raise ValueError(f"{found}; give one of {', '.join(SHAPES)}")
        for name in ("exact", "scale"):
            if self.mesh is None and getattr(self, name) is not None:
                raise ValueError(f"gives {name}, which is for a mesh")
        return self


class _Appearing(_Shape):
    appears: Text | None = optional(
        "Name of the waypoint from which on it is there; left out: from the start"
    )


class ToolShape(_Shape):
    """One shape, placed in the axes of the frame that carries it."""


class SceneObject(_Appearing):
    """An object that stands still."""

    parent: Text = optional("base or the name of a frame", "base", key="in")
    allow: Items[Text] = optional(
        "What may touch it: links of the robot, tool, or the name of a held object", ()
    )
    visual: Flag = optional("Only shown, never checked", False)


class OtherRobot(Placement):
    """Another robot in motion, with its tool and what it holds."""

    position: Vector3 = optional("Of its base frame, whose axes it has [length]", (0.0, 0.0, 0.0))
    parent: Text = optional("base or the name of a frame that stands", "base", key="in")
    scenario: Text = Field(
        description="Its scenario: the name of a shipped one, or a path relative to this file"
    )
    motion: Text | None = optional(
        "Path of its recorded motion, relative to this file, as knotwork check takes "
        "it; left out: its scenario is planned, and must pass"
    )
    delay: Number = optional(
        "How much later than this motion its own begins; it stands before and after [s]", 0.0
    )


class Surroundings(TaskPart):
    """What stands around the robot."""

    margin: Distance = optional(
        "Clearance that robot, tool and held objects keep from it [length]", 0.0
    )
    objects: dict[Text, SceneObject] = optional("By name, in the base or in frames", {})
    robots: dict[Text, OtherRobot] = optional("Other robots by name, which move as they do", {})


class HeldObject(_Appearing):
    """An object that the tool takes along; before and after it stands where it was and is left."""

    take: Text = Field(
        validation_alias="from",
        serialization_alias="from",
        description="Name of the waypoint where the tool takes it",
    )
    leave: Text = Field(
        validation_alias="to",
        serialization_alias="to",
        description="Name of the waypoint where the tool leaves it",
    )
    allow: Items[Text] = optional(
        "What it may touch: objects of the scene that it is taken from or put on, "
        "links. The tool may touch it anyway",
        (),
    )
    mass: Mass | None = optional(
        "The arm carries it from where it is taken to where it is left, in addition to "
        "the mass of the tool [kg]"
    )
    centre_of_mass: Vector3 | None = optional(
        "In the axes of the TCP [length]; left out: the middle of its shape, of a file its origin"
    )
    inertia: Inertia | None = optional("In the axes of the TCP; left out: a point mass")

    @model_validator(mode="after")
    def _mass_of_it(self) -> HeldObject:
        if self.mass is None and (self.centre_of_mass or self.inertia) is not None:
            raise ValueError("gives a centre of mass or an inertia but no mass; give mass [kg] too")
        return self


Shapes = Annotated[
    ToolShape | Several[ToolShape],
    Forms("a mapping with a shape, or a list of them"),
]


class Collisions(TaskPart):
    """What is checked for collisions, and how closely."""

    itself: Flag = optional(
        "Whether the robot is checked against itself and its tool", True, key="self"
    )
    ignore: Items[Annotated[Items[Text], Field(min_length=2, max_length=2)]] = optional(
        "Pairs that are not checked: names of links and objects, or tool; `link:NAME` "
        "and `scenario:NAME` say which where both have the name",
        (),
    )
    resolution: Positive | None = optional(
        "A clearance that is nearer than this to what must be kept counts as failed "
        "[length]; left out: 0.1 mm"
    )
