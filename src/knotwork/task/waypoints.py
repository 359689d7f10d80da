"""The waypoints of a task, and the paths between them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from knotwork.documents import Text
from knotwork.documents.values import (
    Forms,
    JointMap,
    JointsOrName,
    Number,
    Positive,
    Several,
    Vector3,
    optional,
)
from knotwork.task.actions import Action, Actions, Wait
from knotwork.task.freedoms import After, Free, Speed, Way
from knotwork.task.part import TaskPart
from knotwork.task.poses import Placement, Pose, Torch, Velocity
from knotwork.task.weaves import Weave


class _Waypoint(TaskPart):
    name: Text | None = optional("For messages and reports; left out: its number. Each name once")
    time: Number | None = optional("Time since the start [s]")
    after: After | None = optional(
        "Time since the waypoint before [s]; fastest: the least that the limits allow"
    )
    way: Way | None = optional(
        "clear: the motion from the waypoint before finds its way past everything; "
        "without a time it is the fastest that is found"
    )
    stop: Literal[True] | None = optional("The arm stands still here")
    wait: Wait | None = optional(
        "The arm stops here and stands still for so long [s], 1 ms at least"
    )
    do: Actions | None = optional("What is switched here or nearby, and waits, in this order")

    @property
    def actions(self) -> tuple[Action, ...]:
        """What is done, one by one."""
        return (self.do,) if isinstance(self.do, Action) else tuple(self.do or ())

    @model_validator(mode="after")
    def _one_wait(self) -> _Waypoint:
        excluded = ["wait", *(key for one in self.ALTERNATIVES if "wait" in one for key in one)]
        if any(one.wait for one in self.actions):
            for key in excluded:
                if getattr(self, key) is not None:
                    raise ValueError(f"gives {key} and a wait in do; give one of them")
        return self


class _Posed(_Waypoint):
    """What waypoints given by poses have in common."""

    frame: Text | None = optional("Frame the pose is in; left out: the file's `frame`, else base")
    orientation_in: Text | None = optional(
        "Frame the orientation alone is in; left out: that of the pose"
    )
    free: Free | None = optional(
        "What the pose leaves open, and with along the path to it; none: nothing; left "
        "out: as the tool has it"
    )


class PoseWaypoint(_Posed):
    """A waypoint given by the pose of the tool."""

    ALTERNATIVES = (
        ("time", "after"),
        ("velocity", "speed", "stop"),
        ("velocity", "wait"),
        ("speed", "wait"),
    )

    pose: Pose = Field(
        description="Of the TCP; without orientation the tool has that of the path that begins "
        "here, at angles to seam and surface"
    )
    near: JointsOrName | None = optional("Take the solution nearest to this here [angle or length]")
    velocity: (
        Annotated[
            Velocity | Literal["free"],
            Forms("a mapping of linear, angular and in, or free"),
        ]
        | None
    ) = optional(
        "Of the tool as it passes; the first and last waypoint stop without one, "
        "inner ones must give velocity, speed or stop; free: direction and speed are chosen"
    )
    speed: Speed | None = optional(
        "Speed of the TCP along the smooth path through the neighbouring waypoints "
        "(a circle or a line); the tool turns with it; fastest: it is chosen [length/s]"
    )


class Arc(TaskPart):
    """An arc from the waypoint before to this one, in one of three forms."""

    ALTERNATIVES = (("through", "centre", "radius"),)

    through: Vector3 | None = optional("A point on the way [length]")
    centre: Vector3 | None = optional(
        "Centre of the circle [length]; the shorter way round, without a normal"
    )
    radius: Positive | None = optional(
        "Radius [length]; the shorter of the two arcs, and normal says on which side"
    )
    normal: Vector3 | None = optional(
        "Axis that the arc turns about in the positive sense; for a full circle (with "
        "centre) and with radius it is needed"
    )
    turns: Annotated[int, Field(strict=True, ge=0, le=1000)] | None = optional(
        "With centre: full turns before the rest of the arc"
    )
    large: Literal[True] | None = optional(
        "With radius: the longer of the two arcs, more than half a turn"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Arc:
        forms = [
            name for name in ("through", "centre", "radius") if getattr(self, name) is not None
        ]
        if not forms:
            raise ValueError("gives no form of arc; give one of through, centre, radius")
        form = forms[0]
        extra = {"through": (), "centre": ("normal", "turns"), "radius": ("normal", "large")}
        for name in ("normal", "turns", "large"):
            if getattr(self, name) is not None and name not in extra[form]:
                raise ValueError(
                    f"gives {name} together with {form}, where it has no effect; leave it out"
                )
        if form == "radius" and self.normal is None:
            raise ValueError("gives radius without normal, the axis that the arc turns about")
        return self


class AlongArc(TaskPart):
    """Along an arc."""

    arc: Arc = Field(description="The arc")


class AlongPoints(TaskPart):
    """Along a smooth curve through points."""

    points: Annotated[
        Text | Several[Vector3],
        Forms("the name of a CSV file, or a list of points x, y, z"),
    ] = Field(
        description="The points x, y, z in the waypoint's frame [length]; or a CSV file, relative "
        "to this one, with the columns x, y, z, and qx, qy, qz, qw for orientations, or "
        "nx, ny, nz for normals of the surface, which the tool's z axis points against, turn free"
    )


def _along_kind(value: Any) -> str | None:
    if value == "line":
        return "line"
    if isinstance(value, dict) and len({"line", "arc", "points"} & value.keys()) > 1:
        return None
    if isinstance(value, AlongArc) or (isinstance(value, dict) and "arc" in value):
        return "arc"
    if isinstance(value, AlongPoints) or (isinstance(value, dict) and "points" in value):
        return "points"
    return None


Along = Annotated[
    Annotated[Literal["line"], Tag("line")]
    | Annotated[AlongArc, Tag("arc")]
    | Annotated[AlongPoints, Tag("points")],
    Discriminator(
        _along_kind,
        custom_error_type="along_kind",
        custom_error_message="must be one of line, {arc: {through, centre or radius}}, "
        "{points: a file}",
    ),
]


class PathWaypoint(_Posed):
    """The end of a tool path that begins at the waypoint before."""

    ALTERNATIVES = (("time", "after"), ("blend", "stop"), ("blend", "wait"))

    along: Along = Field(description="The path from the waypoint before to this one")
    pose: Placement = Field(
        description="Of the TCP at the end of the path; without orientation the tool keeps the one "
        "it has, or turns with the path"
    )
    speed: Speed | None = optional(
        "Speed of the TCP along the path [length/s]; the time of arrival follows from "
        "it. fastest: the greatest constant speed that the limits allow; left out: the constant "
        "speed that takes the time given"
    )
    orientation: (
        Annotated[
            Torch | Literal["tangent"],
            Forms("tangent, or a mapping with work_angle and travel_angle"),
        ]
        | None
    ) = optional(
        "tangent: the tool turns with the path; or it turns so at angles to seam and "
        "surface; left out: evenly, pose to pose"
    )
    blend: Positive | None = optional(
        "Between two lines: the corner is rounded within this distance of it [length]"
    )
    weave: Weave | None = optional("Motion that is added to the path; speed is that of the path")


class JointWaypoint(_Waypoint):
    """A waypoint given by joint values."""

    ALTERNATIVES = (("time", "after"), ("velocity", "stop"), ("velocity", "wait"))

    joints: JointsOrName = Field(
        description="A configuration of the robot by name, or every joint [angle or length]"
    )
    velocity: (
        Annotated[
            JointMap | Literal["free"],
            Forms("a mapping of joint names to velocities, or free"),
        ]
        | None
    ) = optional("By joint; joints left out stand still; free: it is chosen [angle/s or length/s]")


KINDS = {"along": "PathWaypoint", "pose": "PoseWaypoint", "joints": "JointWaypoint"}


def by_key(kinds: Mapping[str, str], accepted: str) -> Discriminator:
    """Tell what stands in a list of waypoints apart by a key that it has."""

    def kind_of(value: Any) -> str | None:
        if isinstance(value, TaskPart):
            return type(value).__name__
        if not isinstance(value, dict) or ("pose" in value and "joints" in value):
            return None
        for key, kind in kinds.items():
            if key in value:
                return kind
        # a key that is nearly one of them is a slip: let that key be reported
        from difflib import get_close_matches

        slips = (get_close_matches(str(key).lower(), kinds, n=1, cutoff=0.7) for key in value)
        return next((kinds[slip[0]] for slip in slips if slip), None)

    return Discriminator(
        kind_of,
        custom_error_type="waypoint_kind",
        custom_error_message=f"must be a mapping with {accepted}",
    )


Waypoint = Annotated[
    Annotated[PoseWaypoint, Tag("PoseWaypoint")]
    | Annotated[PathWaypoint, Tag("PathWaypoint")]
    | Annotated[JointWaypoint, Tag("JointWaypoint")],
    by_key(KINDS, "either pose or joints"),
]
