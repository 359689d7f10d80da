"""Shapes of the surroundings, the tool and held objects of a task; collision rules."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Field, model_validator

from knotwork.files.documents import Text
from knotwork.files.documents.values import (
    Forms,
    Items,
    NonEmpty,
    NotNegative,
    Number,
    Positive,
    Vector3,
    optional,
    required,
)
from knotwork.task.poses import Placement
from knotwork.task.task_part import TaskPart

Size3 = Annotated[Items[Positive], Field(min_length=3, max_length=3)]
Flag = Annotated[bool, Field(strict=True)]

SHAPES = ("box", "sphere", "cylinder", "capsule", "cone", "ellipsoid", "mesh", "points")
"""Keys of a shape, exactly one of which is given."""

FIXED_SHAPES = (*SHAPES, "half_space")
"""Keys of a shape that the tool does not carry."""


class SolidOfRevolution(TaskPart):
    """A solid of revolution about z, centred at the origin."""

    radius: Positive = required("Radius", unit="length")
    length: Positive = required(
        "Length along z; of a capsule, between the centres of its half spheres", unit="length"
    )


def _check_direction(vector: tuple[float, ...]) -> tuple[float, ...]:
    if not any(vector):
        raise ValueError("must not be zero: it is the outward normal of the solid")
    return vector


class HalfSpace(TaskPart):
    """The space behind a plane: a floor, a wall."""

    normal: Annotated[Vector3, AfterValidator(_check_direction)] = required(
        "Outward normal, of any length"
    )
    offset: Number = optional("Distance from the origin along the normal", 0.0, unit="length")


class PointCloud(TaskPart):
    """Points from a scanner: every grid cell that holds a point is solid."""

    file: Text = required(
        "Path of a CSV file with columns x, y, z or a PLY file, relative to this "
        "file; its numbers are in this file's unit of length",
        path=True,
    )
    scale: Positive = optional("Scale factor", 1.0)
    resolution: Positive = required(
        "Edge length of a cell; larger than the gaps between points", unit="length"
    )


class _ShapeFields(Placement):
    ALTERNATIVES = (*Placement.ALTERNATIVES, SHAPES)
    ONE_OR_MORE: ClassVar[tuple[str, ...]] = SHAPES

    position: Vector3 = optional(
        "Position of the shape's centre, or of a file's origin", (0.0, 0.0, 0.0), unit="length"
    )
    box: Size3 | None = optional("Size along x, y and z", unit="length")
    sphere: Positive | None = optional("Radius", unit="length")
    cylinder: SolidOfRevolution | None = optional("Cylinder about z")
    capsule: SolidOfRevolution | None = optional("Capsule about z: a cylinder with half spheres")
    cone: SolidOfRevolution | None = optional("Cone about z, its tip up")
    ellipsoid: Size3 | None = optional("Half axes along x, y and z", unit="length")
    mesh: Text | None = optional(
        "Path of an STL, OBJ, PLY or COLLADA file, relative to this file; its numbers "
        "are in this file's unit of length (COLLADA states its own)",
        path=True,
    )
    points: PointCloud | None = optional("A point cloud")
    scale: Positive | None = optional("Scale factor of a mesh; left out: 1")
    exact: Flag | None = optional(
        "Check the exact mesh, not its convex hull; it must be watertight. Left out: false"
    )

    @model_validator(mode="after")
    def _check_mesh_keys(self) -> _ShapeFields:
        for name in ("exact", "scale"):
            if self.mesh is None and getattr(self, name) is not None:
                raise ValueError(f"gives {name}, which is for a mesh")
        return self


class _Appearing(_ShapeFields):
    appears: Text | None = optional(
        "Name of the waypoint at which it appears; left out: present from the start",
        names_waypoint=True,
    )


class ToolShape(_ShapeFields):
    """One shape, placed in the axes of the tool's frame."""


class SceneObject(_Appearing):
    """A fixed object."""

    ALTERNATIVES = (*Placement.ALTERNATIVES, FIXED_SHAPES)
    ONE_OR_MORE = FIXED_SHAPES

    half_space: HalfSpace | None = optional("An infinite floor or wall")
    parent: Text = optional("base or the name of a frame", "base", key="in")
    allow: Items[Text] = optional(
        "Bodies that may touch it: links of the robot, tool, or the name of a held object", ()
    )
    visual: Flag = optional("Only shown, never checked", False)


class OtherRobot(Placement):
    """Another robot in motion, with its tool and held objects."""

    position: Vector3 = optional("Position of its base frame", (0.0, 0.0, 0.0), unit="length")
    parent: Text = optional("base or the name of a fixed frame", "base", key="in")
    scenario: Text = required(
        "Its scenario: name of a shipped one, or a path relative to this file", path=True
    )
    motion: Text | None = optional(
        "Path of its recorded motion, relative to this file, in any form that knotwork check "
        "reads; left out: its scenario is planned, and must pass",
        path=True,
    )
    delay: Number = optional(
        "Delay of its motion relative to this one; it is at rest before and after", 0.0, unit="s"
    )


class Surroundings(TaskPart):
    """The surroundings of the robot."""

    margin: NotNegative = optional(
        "Clearance that robot, tool and held objects keep from the surroundings", 0.0, unit="length"
    )
    objects: dict[Text, SceneObject] = optional("Objects by name, in the base or in frames", {})
    robots: dict[Text, OtherRobot] = optional("Other moving robots by name", {})


class Inertia(TaskPart):
    """Moments of inertia about the centre of mass, named as in a URDF."""

    ixx: Number = required("Moment about x", unit="kg m²")
    iyy: Number = required("Moment about y", unit="kg m²")
    izz: Number = required("Moment about z", unit="kg m²")
    ixy: Number = optional("Product of inertia", 0.0, unit="kg m²")
    ixz: Number = optional("Product of inertia", 0.0, unit="kg m²")
    iyz: Number = optional("Product of inertia", 0.0, unit="kg m²")


def require_mass(part: Any) -> Any:
    """Raise an error if a tool or a held object has a centre of mass or an inertia only."""
    if part.mass is None and (part.centre_of_mass or part.inertia) is not None:
        raise ValueError("gives a centre of mass or an inertia but no mass; give mass [kg] too")
    return part


class HeldObject(_Appearing):
    """An object carried by the tool; it is at rest before it is taken and after its release."""

    taken_at: Text = required(
        "Name of the waypoint where the tool takes the object", key="from", names_waypoint=True
    )
    released_at: Text = required(
        "Name of the waypoint where the tool releases it", key="to", names_waypoint=True
    )
    allow: Items[Text] = optional(
        "Bodies that it may touch: objects of the scene that it is taken from or put on, "
        "links. The tool may touch it in any case",
        (),
    )
    mass: NotNegative | None = optional(
        "Mass, carried from where the object is taken to where it is released, in "
        "addition to the mass of the tool",
        unit="kg",
    )
    centre_of_mass: Vector3 | None = optional(
        "Centre of mass in the axes of the TCP; left out: centre of the shape, file origin",
        unit="length",
    )
    inertia: Inertia | None = optional("Inertia in the axes of the TCP; left out: a point mass")

    _check_mass = model_validator(mode="after")(require_mass)


Shapes = Annotated[
    ToolShape | NonEmpty[ToolShape], Forms("a mapping with a shape, or a list of them")
]


class Collisions(TaskPart):
    """Collision checks and their precision."""

    itself: Flag = optional(
        "Whether the robot is checked against itself and its tool", True, key="self"
    )
    ignore: Items[Annotated[Items[Text], Field(min_length=2, max_length=2)]] = optional(
        "Pairs excluded from the check: names of links and objects, or tool; `link:NAME` "
        "and `scenario:NAME` resolve a name that both have",
        (),
    )
    resolution: Positive = optional(
        "A clearance that exceeds the required one by less than this counts as failed",
        unit="length",
        si_default=1e-4,
    )
