"""Times and speeds of a task that are chosen, and what for."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from knotwork.documents import Text
from knotwork.documents.values import (
    LARGEST,
    Forms,
    Interval,
    Items,
    JointMap,
    Number,
    Positive,
    optional,
)
from knotwork.task.part import TaskPart


class Fastest(TaskPart):
    """A time that is chosen: the least that the limits allow."""

    fastest: Literal[True] = Field(description="The minimum time that the limits allow")
    at_least: Positive | None = optional("But no less than this [s]")


class AtMost(TaskPart):
    """A speed that is chosen, up to a greatest one."""

    at_most: Positive = Field(description="The speed is chosen, up to this one [length/s]")


After = Annotated[
    Positive | Literal["fastest"] | Fastest,
    Forms("a positive number of seconds, fastest, or {fastest: true, at_least: seconds}"),
]
Speed = Annotated[
    Positive | Literal["fastest"] | AtMost,
    Forms("a positive number, fastest, or {at_most: a positive number}"),
]


class FreePosition(TaskPart):
    """A box for the tool in the axes of the pose; along axes left out it stays where it is."""

    x: Interval | None = optional("Least and greatest place [length]")
    y: Interval | None = optional("Least and greatest place [length]")
    z: Interval | None = optional("Least and greatest place [length]")


class FreePose(TaskPart):
    """What a pose leaves open. All else, and how fast the tool is, stays as given."""

    turn: (
        Annotated[
            Literal["z"] | Interval,
            Forms("z, or a list of two angles, the least and the greatest"),
        ]
        | None
    ) = optional(
        "The tool may turn about its z axis: z, however far; or the least and the "
        "greatest turn from the pose [angle]"
    )
    tilt: Positive | None = optional(
        "The z axis may be this far from that of the pose [angle]; the turn is that "
        "before the tool leans"
    )
    work_angle: Interval | None = optional(
        "Least and greatest, of a tool at angles to a seam [angle]"
    )
    travel_angle: Interval | None = optional(
        "Least and greatest, of a tool at angles to a seam [angle]"
    )
    position: FreePosition | None = optional("Where the tool stops it may be anywhere in a box")

    @model_validator(mode="after")
    def _something(self) -> FreePose:
        box = self.position
        if box is not None and (box.x, box.y, box.z) == (None, None, None):
            raise ValueError("position leaves nothing open; accepted: x, y or z, a range each")
        leaning = self.work_angle is not None or self.travel_angle is not None
        if self.tilt is not None and leaning:
            raise ValueError("tilt is given together with angles to a seam; accepted: one of them")
        if self.turn is None and self.tilt is None and box is None and not leaning:
            raise ValueError("leaves nothing open; accepted: turn, tilt, angles, or position")
        return self


Free = Annotated[
    FreePose | Literal["none"],
    Forms("a mapping with turn, tilt, angles or position, or none"),
]


class ClearWay(TaskPart):
    """A motion that finds its own way past everything that it may not touch."""

    clear: Literal[True] = Field(description="The motion keeps clear of everything, proved")
    tries: Annotated[int, Field(strict=True, ge=1, le=1000)] = optional(
        "Number of ways that are looked for; the fastest is taken", 2
    )
    room: Positive | None = optional(
        "Clearance beyond the margins that it keeps where it can, or a half or a "
        "quarter of it [length]; left out: none"
    )


Way = Annotated[
    Literal["clear"] | ClearWay,
    Forms("clear, or {clear: true, tries: a number, room: a length}"),
]


Weight = Annotated[float, Field(strict=True, ge=0, le=LARGEST)]


class Weights(TaskPart):
    """Objective that is minimised where times or knots are chosen: a weighted sum of these."""

    time: Weight = optional("Weight of the duration [1/s]", 0.0)
    jerk: Weight = optional("Weight of the integral of jerk squared [s⁵/rad²]", 0.0)
    effort: Weight = optional(
        "Weight of the integral of torque squared, with the payload [1/(N²m²s)]", 0.0
    )
    acceleration: Weight = optional("Weight of the integral of acceleration squared [s³/rad²]", 0.0)

    @model_validator(mode="after")
    def _one_at_least(self) -> Weights:
        if not any(weight for _, weight in self):
            raise ValueError(f"weighs nothing; give one of {', '.join(type(self).model_fields)}")
        return self


class ChosenMotion(TaskPart):
    """A run of waypoints whose times were chosen: its knots and the accelerations there."""

    times: Annotated[Items[Number], Field(min_length=4)] = Field(
        description="Of the knots, among them those of the run's waypoints [s]"
    )
    accelerations: Annotated[dict[Text, Items[Number]], Field(min_length=1)] = Field(
        description="At the knots, a list for each joint [angle/s² or length/s²]"
    )
    velocities: dict[Text, JointMap] = optional(
        "Joint velocities at waypoints where they were chosen, by their names "
        "[angle/s or length/s]",
        {},
    )
    way: Annotated[int, Field(ge=0)] = optional(
        "Number of ways that were tried where it found its way; else 0", 0
    )
    room: Annotated[Number, Field(ge=0)] | None = optional(
        "Clearance beyond the margins that its way keeps [length]; left out where none "
        "was asked for"
    )
