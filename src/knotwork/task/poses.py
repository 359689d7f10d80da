"""Poses, frames and velocities of a task."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from knotwork.documents import Text
from knotwork.documents.values import Items, Number, Vector3, Vector4, optional
from knotwork.task.part import TaskPart

_EULER_ORDERS = tuple(a + b + c for a in "XYZ" for b in "XYZ" for c in "XYZ" if a != b and b != c)
ORIENTATIONS = (
    "quaternion_xyzw",
    "quaternion_wxyz",
    "rpy",
    "euler",
    "rotation_vector",
    "rotation_matrix",
    "torch",
)


MOST_PLACES = 1000
"""Of a grid."""


def _euler_order(order: str) -> str:
    if order in _EULER_ORDERS:
        return order
    if order.upper() in _EULER_ORDERS and order.islower():
        raise ValueError(
            f"lower case would mean fixed axes; write {order.upper()!r} for turns about the moving "
            "axes, or use rpy for fixed x, y, z axes"
        )
    raise ValueError(f"must be one of {', '.join(_EULER_ORDERS)} (moving axes, in this order)")


class Euler(TaskPart):
    """Euler angles: turns about the moving axes, in the order given."""

    order: Annotated[str, AfterValidator(_euler_order)] = Field(
        description="Axes in order, capital letters, for example ZYX"
    )
    angles: Vector3 = Field(description="Turns in that order [angle]")


class Torch(TaskPart):
    """How the tool's z axis leans to a seam and the surface that it is on."""

    normal: Vector3 | None = optional(
        "Direction out of the surface; along a path that where it begins, left out "
        "where its points have normals"
    )
    work_angle: Number = optional("About the seam: how far the tool leans to its left [angle]", 0.0)
    travel_angle: Number = optional(
        "In the plane of seam and tool: positive where the tool points forward (push), "
        "negative where it points back (drag) [angle]",
        0.0,
    )
    tangent: Literal["x", "y", "-x", "-y"] = optional(
        "Axis of the tool that points along the seam at zero angles", "x"
    )


class SeamTorch(Torch):
    """How the tool's z axis leans to the direction of a seam and the surface that it is on."""

    normal: Vector3 = Field(description="Direction out of the surface")
    seam: Vector3 = Field(description="Direction of the seam")


class Placement(TaskPart):
    """A position and at most one form of orientation; none means the axes are parallel."""

    ALTERNATIVES = (ORIENTATIONS,)

    position: Vector3 = Field(description="Origin: x, y, z [length]")
    quaternion_xyzw: Vector4 | None = optional(
        "Unit quaternion, its scalar part last, as in ROS and SciPy"
    )
    quaternion_wxyz: Vector4 | None = optional(
        "Unit quaternion, its scalar part first, as in Eigen's constructor"
    )
    rpy: Vector3 | None = optional(
        "Turns about the fixed x, y, z axes, in this order, as in URDF [angle]"
    )
    euler: Euler | None = optional("Turns about moving axes, in an order of choice")
    rotation_vector: Vector3 | None = optional("Unit axis times angle [angle]")
    rotation_matrix: Annotated[Items[Vector3], Field(min_length=3, max_length=3)] | None = optional(
        "Three rows of three numbers; orthonormal, right-handed"
    )
    torch: SeamTorch | None = optional("Angles to a seam and a surface")

    @property
    def turned(self) -> bool:
        """Whether it has an orientation."""
        return any(getattr(self, name) is not None for name in ORIENTATIONS)


class Pose(Placement):
    """A position and one form of orientation."""


class FrameMotion(TaskPart):
    """A motion that is known at all times, in the axes of the frame where it is at rest."""

    linear: Vector3 | None = optional("Constant [length/s]")
    angular: Vector3 | None = optional("Constant, about the frame's origin [angle/s]")
    file: Text | None = optional(
        "Path of a trajectory, relative to this file, of joints named x, y, z [m], "
        "yaw, pitch, roll [rad], or some of them, in SI: shifts, then turns about the moving z, y, "
        "x axes; before and after it the frame stands"
    )
    at: Number = optional("When the frame is where it is placed, or the file begins [s]", 0.0)

    @model_validator(mode="after")
    def _one_form(self) -> FrameMotion:
        speeds = self.linear is not None or self.angular is not None
        if speeds == (self.file is not None):
            found = "gives a file and speeds" if speeds else "gives no motion"
            raise ValueError(f"{found}; give linear, angular or both, or file")
        return self


class Grid(TaskPart):
    """Places in rows along x, y and z of a frame, the first of which is at its origin."""

    counts: Annotated[
        Items[Annotated[int, Field(strict=True, ge=1, le=1000)]], Field(min_length=1, max_length=3)
    ] = Field(description="Number of places along x, y and z; those along x come first")
    pitches: Annotated[Items[Number], Field(min_length=1, max_length=3)] = Field(
        description="From one to the next along x, y and z [length]"
    )

    @model_validator(mode="after")
    def _of_some_size(self) -> Grid:
        if len(self.counts) != len(self.pitches):
            raise ValueError(
                f"gives {len(self.counts)} counts and {len(self.pitches)} pitches; give one of "
                "each along x, y and z"
            )
        if math.prod(self.counts) > MOST_PLACES:
            raise ValueError(f"has more than {MOST_PLACES} places")
        return self


class Frame(Placement):
    """A named frame, placed in the base or in another named frame."""

    moves: FrameMotion | None = optional("Its motion, and that of all in it: a belt, a turntable")

    on: Text | None = optional(
        "In place of in: link of the robot that carries it. Where poses are in frames "
        "on a link that joints move, a turntable, these joints are planned with the arm's"
    )
    grid: Grid | None = optional("Places in it, for over of a repeat")
    parent: Text = optional("base or the name of another frame", "base", key="in")

    @model_validator(mode="after")
    def _one_carrier(self) -> Frame:
        if self.on is not None and self.parent != "base":
            raise ValueError("gives in and on; give one of the two")
        return self


class Velocity(TaskPart):
    """Velocity of the TCP and of the tool's rotation, in the axes of a frame."""

    linear: Vector3 = optional("Of the TCP [length/s]", (0.0, 0.0, 0.0))
    angular: Vector3 = optional("Of the tool [angle/s]", (0.0, 0.0, 0.0))
    axes: Text | None = optional(
        "A named frame, base or tool; left out: the frame the waypoint's pose is in", key="in"
    )
