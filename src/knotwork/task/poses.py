"""Poses, frames and velocities of a task."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from knotwork.documents import Text
from knotwork.documents.values import Items, Number, Vector3, Vector4
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

    normal: Vector3 | None = Field(
        default=None,
        description="Direction out of the surface; along a path that where it begins, left out "
        "where its points have normals",
    )
    work_angle: Number = Field(
        default=0.0, description="About the seam: how far the tool leans to its left [angle]"
    )
    travel_angle: Number = Field(
        default=0.0,
        description="In the plane of seam and tool: positive where the tool points forward (push), "
        "negative where it points back (drag) [angle]",
    )
    tangent: Literal["x", "y", "-x", "-y"] = Field(
        default="x", description="Axis of the tool that points along the seam at zero angles"
    )


class SeamTorch(Torch):
    """How the tool's z axis leans to the direction of a seam and the surface that it is on."""

    normal: Vector3 = Field(description="Direction out of the surface")
    seam: Vector3 = Field(description="Direction of the seam")


class Placement(TaskPart):
    """A position and at most one form of orientation; none means the axes are parallel."""

    ALTERNATIVES = (ORIENTATIONS,)

    position: Vector3 = Field(description="Origin: x, y, z [length]")
    quaternion_xyzw: Vector4 | None = Field(
        default=None, description="Unit quaternion, its scalar part last, as in ROS and SciPy"
    )
    quaternion_wxyz: Vector4 | None = Field(
        default=None,
        description="Unit quaternion, its scalar part first, as in Eigen's constructor",
    )
    rpy: Vector3 | None = Field(
        default=None,
        description="Turns about the fixed x, y, z axes, in this order, as in URDF [angle]",
    )
    euler: Euler | None = Field(
        default=None, description="Turns about moving axes, in an order of choice"
    )
    rotation_vector: Vector3 | None = Field(
        default=None, description="Unit axis times angle [angle]"
    )
    rotation_matrix: Annotated[Items[Vector3], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="Three rows of three numbers; orthonormal, right-handed"
    )
    torch: SeamTorch | None = Field(default=None, description="Angles to a seam and a surface")

    @property
    def turned(self) -> bool:
        """Whether it has an orientation."""
        return any(getattr(self, name) is not None for name in ORIENTATIONS)


class Pose(Placement):
    """A position and one form of orientation."""


class FrameMotion(TaskPart):
    """A motion that is known at all times, in the axes of the frame where it is at rest."""

    linear: Vector3 | None = Field(default=None, description="Constant [length/s]")
    angular: Vector3 | None = Field(
        default=None, description="Constant, about the frame's origin [angle/s]"
    )
    file: Text | None = Field(
        default=None,
        description="Path of a trajectory, relative to this file, of joints named x, y, z [m], "
        "yaw, pitch, roll [rad], or some of them, in SI: shifts, then turns about the moving z, y, "
        "x axes; before and after it the frame stands",
    )
    at: Number = Field(
        default=0.0, description="When the frame is where it is placed, or the file begins [s]"
    )

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

    moves: FrameMotion | None = Field(
        default=None, description="Its motion, and that of all in it: a belt, a turntable"
    )

    on: Text | None = Field(
        default=None,
        description="In place of in: link of the robot that carries it. Where poses are in frames "
        "on a link that joints move, a turntable, these joints are planned with the arm's",
    )
    grid: Grid | None = Field(default=None, description="Places in it, for over of a repeat")
    parent: Text = Field(
        default="base",
        validation_alias="in",
        serialization_alias="in",
        description="base or the name of another frame",
    )

    @model_validator(mode="after")
    def _one_carrier(self) -> Frame:
        if self.on is not None and self.parent != "base":
            raise ValueError("gives in and on; give one of the two")
        return self


class Velocity(TaskPart):
    """Velocity of the TCP and of the tool's rotation, in the axes of a frame."""

    linear: Vector3 = Field(default=(0.0, 0.0, 0.0), description="Of the TCP [length/s]")
    angular: Vector3 = Field(default=(0.0, 0.0, 0.0), description="Of the tool [angle/s]")
    axes: Text | None = Field(
        default=None,
        validation_alias="in",
        serialization_alias="in",
        description="A named frame, base or tool; left out: the frame the waypoint's pose is in",
    )
