"""The waypoints of a task, and the paths between them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from knotwork.files.documents import Text
from knotwork.files.documents.values import (
    Forms,
    Items,
    JointMap,
    JointsOrName,
    NonEmpty,
    Number,
    Positive,
    Vector3,
    optional,
    required,
)
from knotwork.task.actions import Action, Actions, Wait
from knotwork.task.left_to_planning import After, Free, Speed, Way
from knotwork.task.poses import Placement, Pose, Torch, Velocity
from knotwork.task.task_part import TaskPart

KINDS = {"along": "PathWaypoint", "pose": "PoseWaypoint", "joints": "JointWaypoint"}


class _Waypoint(TaskPart):
    ALTERNATIVES: ClassVar[tuple[tuple[str, ...], ...]] = (("time", "after"),)

    name: Text | None = optional("Unique name, for messages and reports; left out: its number")
    time: Number | None = optional("Time since the start", unit="s")
    after: After | None = optional(
        "Time since the previous waypoint; fastest: the minimum that the limits allow",
        unit="s",
        defines_motion=True,
    )
    way: Way | None = optional(
        "clear: a collision-free motion from the previous waypoint; "
        "without a time, the fastest one found",
        needs_robot=True,
        defines_motion=True,
    )
    stop: Literal[True] | None = optional("Stop at this waypoint", defines_motion=True)
    wait: Wait | None = optional(
        "Stop at this waypoint for this time, at least 1 ms", unit="s", defines_motion=True
    )
    do: Actions | None = optional(
        "Signals switched here or nearby, and waits, in this order", defines_motion=True
    )

    @property
    def actions(self) -> tuple[Action, ...]:
        """Actions as a sequence."""
        return (self.do,) if isinstance(self.do, Action) else tuple(self.do or ())

    @property
    def wait_time(self) -> float | None:
        """Time of the stop here [s], of `wait` or of the waits in `do`; `None` without one."""
        return self.wait or sum(action.wait or 0.0 for action in self.actions) or None

    @model_validator(mode="after")
    def _check_waits(self) -> _Waypoint:
        excluded = [
            "wait",
            *(key for names in self.ALTERNATIVES if "wait" in names for key in names),
        ]
        if any(action.wait for action in self.actions):
            for key in excluded:
                if getattr(self, key) is not None:
                    raise ValueError(f"gives {key} and a wait in do; give one of them")
        return self


class _Posed(_Waypoint):
    """Common fields of waypoints given by poses."""

    frame: Text | None = optional(
        "Frame the pose is in; left out: the file's `frame`, else base", names_frame=True
    )
    orientation_in: Text | None = optional(
        "Frame the orientation alone is in; left out: that of the pose", names_frame=True
    )
    free: Free | None = optional(
        "Freedom of the pose, and with along of the path to it; left out: that of the tool; "
        "none: no freedom"
    )


class PoseWaypoint(_Posed):
    """A waypoint given by the pose of the tool."""

    ALTERNATIVES = (
        *_Waypoint.ALTERNATIVES,
        ("velocity", "speed", "stop"),
        ("velocity", "wait"),
        ("speed", "wait"),
    )

    pose: Pose = required(
        "Pose of the TCP. Without an orientation it takes that of the torch path that begins here",
        needs_robot=True,
    )
    near: JointsOrName | None = optional(
        "Reference configuration: the IK solution nearest to it is taken", unit="angle or length"
    )
    velocity: (
        Annotated[Velocity | Literal["free"], Forms("a mapping of linear, angular and in, or free")]
        | None
    ) = optional(
        "Velocity of the tool; the first and last waypoint stop without one, "
        "inner ones must give velocity, speed or stop; free: direction and speed are chosen"
    )
    speed: Speed | None = optional(
        "Speed of the TCP along the smooth path through the neighbouring waypoints "
        "(a circle or a line); the tool turns with it; fastest: it is chosen",
        unit="length/s",
    )


class Arc(TaskPart):
    """An arc from the previous waypoint to this one, in one of three forms."""

    ALTERNATIVES = (("through", "centre", "radius"),)
    ONE_OR_MORE = ("through", "centre", "radius")

    through: Vector3 | None = optional("A point on the arc", unit="length")
    centre: Vector3 | None = optional(
        "Centre of the circle; without a normal, the shorter arc", unit="length"
    )
    radius: Positive | None = optional(
        "Radius; the shorter of the two arcs, on the side given by normal", unit="length"
    )
    normal: Vector3 | None = optional(
        "Rotation axis of the arc, in the positive sense; for a full circle (with "
        "centre) and with radius it is required"
    )
    turns: Annotated[int, Field(strict=True, ge=0, le=1000)] | None = optional(
        "With centre: full turns before the rest of the arc"
    )
    large: Literal[True] | None = optional(
        "With radius: the longer of the two arcs, more than half a turn"
    )

    @model_validator(mode="after")
    def _check_form(self) -> Arc:
        without_effect = {"through": ("normal", "turns", "large"), "centre": ("large",)}
        form = next(form for form in self.ONE_OR_MORE if getattr(self, form) is not None)
        for name in without_effect.get(form, ("turns",)):
            if getattr(self, name) is not None:
                raise ValueError(
                    f"gives {name} together with {form}, where it has no effect; leave it out"
                )
        if self.radius is not None and self.normal is None:
            raise ValueError("gives radius without normal, the axis that the arc turns about")
        return self


class AlongArc(TaskPart):
    """Along an arc."""

    arc: Arc = required("Arc from the previous waypoint")


class AlongPoints(TaskPart):
    """Along a smooth curve through points."""

    points: Annotated[
        Text | NonEmpty[Vector3], Forms("the name of a CSV file, or a list of points x, y, z")
    ] = required(
        "The points x, y, z in the waypoint's frame; or a CSV file, relative to "
        "this one, with the columns x, y, z, and qx, qy, qz, qw for orientations, "
        "or nx, ny, nz for normals of the surface, opposite to the tool's z axis, "
        "with free turn",
        unit="length",
        path=True,
    )


def by_key(kinds: Mapping[str, str], accepted: str) -> Discriminator:
    """Discriminator of the kinds of waypoints, by a key that each has."""

    def kind_of(value: Any) -> str | None:
        if isinstance(value, TaskPart):
            return type(value).__name__
        if not isinstance(value, dict) or ("pose" in value and "joints" in value):
            return None
        return next((kind for key, kind in kinds.items() if key in value), None)

    return Discriminator(
        kind_of,
        custom_error_type="waypoint_kind",
        custom_error_message=f"must be a mapping with {accepted}",
    )


Along = Annotated[
    Literal["line"]
    | Annotated[
        Annotated[AlongArc, Tag("AlongArc")] | Annotated[AlongPoints, Tag("AlongPoints")],
        by_key({"arc": "AlongArc", "points": "AlongPoints"}, "arc or points"),
    ],
    Forms("line, {arc: {through, centre or radius}} or {points: a file}"),
]


class Weave(TaskPart):
    """An oscillation across the seam or around it."""

    shape: Literal["sine", "triangle", "circle", "eight"] = required(
        "sine or triangle, from edge to edge; circle; or eight, half as long as wide"
    )
    width: Positive = required("Width from edge to edge", unit="length")
    frequency: Positive = required("Frequency", unit="Hz")
    dwell: Positive | None = optional("Dwell time at each edge, for sine and triangle", unit="s")
    rounding: Positive | None = optional(
        "Largest deviation of a triangle from sharp corners, up to a quarter of its "
        "width; left out: the tolerance of the path",
        unit="length",
    )
    axes: (
        Annotated[Items[Literal["across", "normal", "along"]], Field(min_length=1, max_length=2)]
        | None
    ) = optional(
        "Axes of the seam: one for sine and triangle, across or normal (left out: "
        "across); two for circle and eight, the second the shorter one of an eight (left out: "
        "across, along)",
        key="in",
    )
    normal: Vector3 | None = optional(
        "Surface normal where the weave begins, in the path's frame; left out: "
        "opposite to the tool's z axis; across is perpendicular to it and to the seam"
    )

    @property
    def is_loop(self) -> bool:
        """Whether the shape is a closed loop."""
        return self.shape in ("circle", "eight")

    @model_validator(mode="after")
    def _check_shape(self) -> Weave:
        loop = self.is_loop
        if loop and self.dwell is not None:
            raise ValueError(f"shape: {self.shape} has no edges; leave dwell out")
        if self.rounding is not None and self.shape != "triangle":
            raise ValueError(f"shape: {self.shape} has no corners; leave rounding out")
        if self.rounding is not None and 4.0 * self.rounding > self.width:
            raise ValueError(f"gives rounding above {0.25 * self.width:g}, a quarter of its width")
        if self.dwell is not None and 2.0 * self.dwell * self.frequency >= 1.0:
            raise ValueError(
                f"holds both edges for {2.0 * self.dwell:g} s of a period of "
                f"{1.0 / self.frequency:g} s; a dwell below {0.5 / self.frequency:g} s is accepted"
            )
        axes = self.axes
        if axes is None:
            return self
        if loop:
            is_accepted = len(axes) == len(set(axes)) == 2
            accepted = "two different axes of across, normal and along"
        else:
            is_accepted = axes in (("across",), ("normal",))
            accepted = "in: [across] or in: [normal]"
        if not is_accepted:
            listed = ", ".join(axes)
            raise ValueError(f"gives in: [{listed}]; shape: {self.shape} accepts {accepted}")
        return self


class PathWaypoint(_Posed):
    """The end of a tool path that begins at the previous waypoint."""

    ALTERNATIVES = (("speed", "time", "after"), ("blend", "stop"), ("blend", "wait"))

    along: Along = required("Path from the previous waypoint to this one")
    pose: Placement = required(
        "Pose of the TCP at the end; without orientation the tool keeps the one it "
        "has, or turns with the path",
        needs_robot=True,
    )
    speed: Speed | None = optional(
        "Speed of the TCP along the path; the time of arrival follows from it. "
        "fastest: the maximum constant speed that the limits allow; left out: the "
        "constant speed for the given time",
        unit="length/s",
    )
    orientation: (
        Annotated[
            Torch | Literal["tangent"],
            Forms("tangent, or a mapping with work_angle and travel_angle"),
        ]
        | None
    ) = optional(
        "tangent: the tool turns with the path; a mapping: it also keeps these angles to seam and "
        "surface; left out: interpolated from pose to pose"
    )
    blend: Positive | None = optional(
        "Corner rounding between two lines: distance of its ends from the corner", unit="length"
    )
    weave: Weave | None = optional("Oscillation added to the path; speed is that of the path")


class JointWaypoint(_Waypoint):
    """A waypoint given by joint values."""

    ALTERNATIVES = (*_Waypoint.ALTERNATIVES, ("velocity", "stop"), ("velocity", "wait"))

    joints: JointsOrName = required(
        "A configuration of the robot by name, or every joint", unit="angle or length"
    )
    velocity: (
        Annotated[
            JointMap | Literal["free"], Forms("a mapping of joint names to velocities, or free")
        ]
        | None
    ) = optional(
        "By joint, zero for joints left out; free: it is chosen", unit="angle/s or length/s"
    )


TaggedWaypoint = (
    Annotated[PoseWaypoint, Tag("PoseWaypoint")]
    | Annotated[PathWaypoint, Tag("PathWaypoint")]
    | Annotated[JointWaypoint, Tag("JointWaypoint")]
)
Waypoint = Annotated[TaggedWaypoint, by_key(KINDS, "either pose or joints, not both")]
