"""Poses, frames and velocities of a task."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, model_validator

from knotwork.files.documents import Text
from knotwork.files.documents.values import Items, Number, Vector3, Vector4, optional, required
from knotwork.task.task_part import TaskPart

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


MAX_PLACES = 1000
"""Maximum number of places in a grid."""


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
    """Euler angles: rotations about moving axes, in the given order."""

    order: Annotated[str, AfterValidator(_euler_order)] = required(
        "Axes in order, capital letters, for example ZYX"
    )
    angles: Vector3 = required("Rotations in that order", unit="angle")


class Torch(TaskPart):
    """Angles of the tool to a tool path, which is the seam."""

    normal: Vector3 | None = optional(
        "Surface normal, out of the surface; along a path, the normal at its start, left out "
        "where the points have normals"
    )
    work_angle: Number = optional("Inclination about the seam, to its left", 0.0, unit="angle")
    travel_angle: Number = optional(
        "Inclination in the plane of seam and tool: positive for forward (push), "
        "negative for backward (drag)",
        0.0,
        unit="angle",
    )
    tangent: Literal["x", "y", "-x", "-y"] = optional(
        "Axis of the tool that points along the seam at zero angles", "x"
    )


class SeamTorch(Torch):
    """Angles of the tool at one pose, to a seam given by its direction."""

    normal: Vector3 = required("Surface normal, out of the surface")
    seam: Vector3 = required("Direction of the seam")


class Placement(TaskPart):
    """A position and at most one form of orientation; without one the axes are parallel."""

    ALTERNATIVES: ClassVar[tuple[tuple[str, ...], ...]] = (ORIENTATIONS,)

    position: Vector3 = required("Origin: x, y, z", unit="length")
    quaternion_xyzw: Vector4 | None = optional(
        "Unit quaternion, its scalar part last, as in ROS and SciPy"
    )
    quaternion_wxyz: Vector4 | None = optional(
        "Unit quaternion, its scalar part first, as in Eigen's constructor"
    )
    rpy: Vector3 | None = optional(
        "Rotations about the fixed x, y, z axes, in this order, as in URDF", unit="angle"
    )
    euler: Euler | None = optional("Rotations about moving axes, in a given order")
    rotation_vector: Vector3 | None = optional(
        "Rotation axis (unit vector) times angle", unit="angle"
    )
    rotation_matrix: Annotated[Items[Vector3], Field(min_length=3, max_length=3)] | None = optional(
        "Rotation matrix as three rows; orthonormal, right-handed"
    )
    torch: SeamTorch | None = optional("Inclination relative to a seam and a surface")

    @property
    def has_orientation(self) -> bool:
        """Whether an orientation is given."""
        return any(getattr(self, name) is not None for name in ORIENTATIONS)


class Pose(Placement):
    """A placement with an orientation, unless a path with a torch begins there."""


class FrameMotion(TaskPart):
    """A motion that is defined at all times, in the axes of the frame at rest."""

    ALTERNATIVES = (("linear", "file"), ("angular", "file"))
    ONE_OR_MORE = ("linear", "angular", "file")

    linear: Vector3 | None = optional("Constant velocity", unit="length/s")
    angular: Vector3 | None = optional("Constant angular velocity about its origin", unit="angle/s")
    file: Text | None = optional(
        "Path of a trajectory, relative to this file, of joints named x, y, z [m], "
        "yaw, pitch, roll [rad], or some of them, in SI: translation, then rotation "
        "about moving z, y, x axes; the frame is at rest before and after it",
        path=True,
    )
    at: Number = optional(
        "Time when the frame is at its placement or the file begins", 0.0, unit="s"
    )


class Grid(TaskPart):
    """Places in rows along x, y and z of a frame; the first is at its origin."""

    counts: Annotated[
        Items[Annotated[int, Field(strict=True, ge=1, le=1000)]], Field(min_length=1, max_length=3)
    ] = required("Number of places along x, y and z, counted along x first")
    pitches: Annotated[Items[Number], Field(min_length=1, max_length=3)] = required(
        "Distance between places along x, y and z", unit="length"
    )

    @model_validator(mode="after")
    def _check_counts(self) -> Grid:
        if len(self.counts) != len(self.pitches):
            raise ValueError(
                f"gives {len(self.counts)} counts and {len(self.pitches)} pitches; give one of "
                "each along x, y and z"
            )
        if math.prod(self.counts) > MAX_PLACES:
            raise ValueError(f"has more than {MAX_PLACES} places")
        return self


class Frame(Placement):
    """A named frame, placed in the base frame or in another named frame."""

    moves: FrameMotion | None = optional("Motion of the frame and all in it: a belt, a turntable")

    on: Text | None = optional(
        "In place of in: robot link that carries the frame. Where poses are in frames "
        "on a link moved by joints, such as a turntable, these joints are planned with the arm"
    )
    grid: Grid | None = optional("Places in the frame, for over of a repeat")
    parent: Text = optional("base or the name of another frame", "base", key="in")

    @model_validator(mode="after")
    def _check_parent(self) -> Frame:
        if self.on is not None and self.parent != "base":
            raise ValueError("gives in and on; give one of the two")
        return self


class Velocity(TaskPart):
    """Linear velocity of the TCP and angular velocity of the tool, in the axes of a frame."""

    linear: Vector3 = optional("Velocity of the TCP", (0.0, 0.0, 0.0), unit="length/s")
    angular: Vector3 = optional("Angular velocity of the tool", (0.0, 0.0, 0.0), unit="angle/s")
    axes: Text | None = optional(
        "A named frame, base or tool; left out: the frame the waypoint's pose is in",
        key="in",
        names_frame=True,
    )
