"""Contents of a scenario file: waypoints, poses, frames and velocities."""

from __future__ import annotations

import difflib
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from knotwork.documents import StrictModel, Text
from knotwork.documents.values import (
    JointMap,
    JointsOrName,
    Number,
    Positive,
    Vector3,
    Vector4,
)

_EULER_ORDERS = tuple(a + b + c for a in "XYZ" for b in "XYZ" for c in "XYZ" if a != b and b != c)
ORIENTATIONS = (
    "quaternion_xyzw",
    "quaternion_wxyz",
    "rpy",
    "euler",
    "rotation_vector",
    "rotation_matrix",
)


def _euler_order(order: str) -> str:
    if order in _EULER_ORDERS:
        return order
    if order.upper() in _EULER_ORDERS and order.islower():
        raise ValueError(
            f"lower case would mean fixed axes; write {order.upper()!r} for turns about the moving "
            "axes, or use rpy for fixed x, y, z axes"
        )
    raise ValueError(f"must be one of {', '.join(_EULER_ORDERS)} (moving axes, in this order)")


class Euler(StrictModel):
    """Euler angles: turns about the moving axes, in the order given."""

    order: Annotated[str, AfterValidator(_euler_order)] = Field(
        description="Axes in order, capital letters, for example ZYX"
    )
    angles: Vector3 = Field(description="Turns in that order [angle]")


class Placement(StrictModel):
    """A position and at most one form of orientation; none means the axes are parallel."""

    ALTERNATIVES = (ORIENTATIONS,)

    position: Vector3 = Field(description="Origin: x, y, z [length]")
    quaternion_xyzw: Vector4 | None = Field(
        None, description="Unit quaternion, its scalar part last, as in ROS and SciPy"
    )
    quaternion_wxyz: Vector4 | None = Field(
        None, description="Unit quaternion, its scalar part first, as in Eigen's constructor"
    )
    rpy: Vector3 | None = Field(
        None, description="Turns about the fixed x, y, z axes, in this order, as in URDF [angle]"
    )
    euler: Euler | None = Field(None, description="Turns about moving axes, in an order of choice")
    rotation_vector: Vector3 | None = Field(None, description="Unit axis times angle [angle]")
    rotation_matrix: Annotated[list[Vector3], Field(min_length=3, max_length=3)] | None = Field(
        None, description="Three rows of three numbers; orthonormal, right-handed"
    )


class Pose(Placement):
    """A position and exactly one form of orientation."""

    @model_validator(mode="after")
    def _an_orientation(self) -> Pose:
        if all(getattr(self, name) is None for name in ORIENTATIONS):
            raise ValueError(f"has no orientation; give one of {', '.join(ORIENTATIONS)}")
        return self


class Frame(Placement):
    """A named frame, placed in the base or in another named frame."""

    parent: Text = Field("base", alias="in", description="base or the name of another frame")


class Velocity(StrictModel):
    """Velocity of the TCP and of the tool's rotation, in the axes of a frame."""

    linear: Vector3 = Field(default=[0.0, 0.0, 0.0], description="Of the TCP [length/s]")
    angular: Vector3 = Field(default=[0.0, 0.0, 0.0], description="Of the tool [angle/s]")
    axes: Text | None = Field(
        None,
        alias="in",
        description="A named frame, base or tool; left out: the frame the waypoint's pose is in",
    )


class _Waypoint(StrictModel):
    name: Text | None = Field(
        None, description="For messages and reports; left out: its number. Each name once"
    )
    time: Number | None = Field(None, description="Time since the start [s]")
    after: Positive | None = Field(None, description="Time since the waypoint before [s]")
    stop: Literal[True] | None = Field(None, description="The arm stands still here")


class PoseWaypoint(_Waypoint):
    """A waypoint given by the pose of the tool."""

    ALTERNATIVES = (("time", "after"), ("velocity", "speed", "stop"))

    pose: Pose = Field(description="Of the TCP")
    frame: Text | None = Field(
        None, description="Frame the pose is in; left out: the file's `frame`, else base"
    )
    velocity: Velocity | None = Field(
        None,
        description="Of the tool as it passes; the first and last waypoint stop without one, "
        "inner ones must give velocity, speed or stop",
    )
    speed: Positive | None = Field(
        None,
        description="Speed of the TCP along the smooth path through the neighbouring waypoints "
        "(a circle or a line); the tool turns with it [length/s]",
    )


class JointWaypoint(_Waypoint):
    """A waypoint given by joint values."""

    ALTERNATIVES = (("time", "after"), ("velocity", "stop"))

    joints: JointsOrName = Field(
        description="A configuration of the robot by name, or every joint [angle or length]"
    )
    velocity: JointMap | None = Field(
        default=None,
        description="By joint; joints left out stand still [angle/s or length/s]",
    )


def _waypoint_kind(value: Any) -> str | None:
    if isinstance(value, PoseWaypoint | JointWaypoint):
        return type(value).__name__
    if not isinstance(value, dict) or ("pose" in value and "joints" in value):
        return None
    kinds = {"pose": "PoseWaypoint", "joints": "JointWaypoint"}
    for key, kind in kinds.items():
        if key in value:
            return kind
    # a key that is nearly one of them is a slip: let that key be reported
    slips = (difflib.get_close_matches(str(key).lower(), kinds, n=1, cutoff=0.7) for key in value)
    return next((kinds[slip[0]] for slip in slips if slip), None)


Waypoint = Annotated[
    Annotated[PoseWaypoint, Tag("PoseWaypoint")] | Annotated[JointWaypoint, Tag("JointWaypoint")],
    Discriminator(
        _waypoint_kind,
        custom_error_type="waypoint_kind",
        custom_error_message="must be a mapping with either pose or joints",
    ),
]
