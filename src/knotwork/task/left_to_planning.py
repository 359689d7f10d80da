"""Times, speeds, tolerances of poses and ways that planning decides, and its objective."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from knotwork.files.documents import Text
from knotwork.files.documents.values import (
    MAX_NUMBER,
    Forms,
    Items,
    JointMap,
    NotNegative,
    Number,
    Positive,
    Range,
    optional,
    required,
)
from knotwork.task.task_part import TaskPart


class Fastest(TaskPart):
    """An unknown duration: the minimum within the limits is chosen."""

    fastest: Literal[True] = required("The minimum time that the limits allow")
    at_least: Positive | None = optional("Lower bound", unit="s")


class AtMost(TaskPart):
    """An unknown speed with an upper bound."""

    at_most: Positive = required("Upper bound of the chosen speed", unit="length/s")


After = Annotated[
    Positive | Literal["fastest"] | Fastest,
    Forms("a positive number of seconds, fastest, or {fastest: true, at_least: seconds}"),
]
Speed = Annotated[
    Positive | Literal["fastest"] | AtMost,
    Forms("a positive number, fastest, or {at_most: a positive number}"),
]


def _with_zero(bounds: tuple[float, ...]) -> tuple[float, ...]:
    if not bounds[0] <= 0.0 <= bounds[1]:
        raise ValueError("must contain 0: these are offsets from the pose, such as [-0.1, 0.1]")
    return bounds


Offsets = Annotated[Range, AfterValidator(_with_zero)]


class FreePosition(TaskPart):
    """A box for the tool in the axes of the pose; axes left out keep the position of the pose."""

    ONE_OR_MORE = ("x", "y", "z")

    x: Offsets | None = optional("Lower and upper bound", unit="length")
    y: Offsets | None = optional("Lower and upper bound", unit="length")
    z: Offsets | None = optional("Lower and upper bound", unit="length")


class FreePose(TaskPart):
    """Freedom of a pose. The other coordinates, and the speed of the tool, stay as given."""

    ALTERNATIVES = (("tilt", "work_angle"), ("tilt", "travel_angle"))
    ONE_OR_MORE = ("turn", "tilt", "work_angle", "travel_angle", "position")

    turn: (
        Annotated[
            Literal["z"] | Range,
            Forms("z, or a list of two angles, the lower and the upper bound"),
        ]
        | None
    ) = optional(
        "Turn of the tool about its z axis: z for any turn, or the lower and the "
        "upper bound of the turn from the pose",
        unit="angle",
    )
    tilt: Positive | None = optional(
        "Largest angle between the z axis and that of the pose; the turn is applied "
        "before the tilt",
        unit="angle",
    )
    work_angle: Range | None = optional(
        "Lower and upper bound of the work angle itself, not from the pose", unit="angle"
    )
    travel_angle: Range | None = optional(
        "Lower and upper bound of the travel angle itself, not from the pose", unit="angle"
    )
    position: FreePosition | None = optional("Box for the tool position, where the tool stops")


Free = Annotated[
    FreePose | Literal["none"], Forms("a mapping with turn, tilt, angles or position, or none")
]


class ClearWay(TaskPart):
    """A collision-free motion past all obstacles."""

    clear: Literal[True] = required("A motion proved to be free of collisions")
    tries: Annotated[int, Field(strict=True, ge=1, le=1000)] = optional(
        "Number of motions to search for; the fastest is taken", 2
    )
    extra_clearance: NotNegative = optional(
        "Clearance to keep beyond the margins; if no such motion is found, a half of it, then a "
        "quarter, then none",
        key="room",
        unit="length",
        si_default=0.0,
    )


Way = Annotated[
    Literal["clear"] | ClearWay, Forms("clear, or {clear: true, tries: a number, room: a length}")
]


Weight = Annotated[float, Field(strict=True, ge=0, le=MAX_NUMBER)]


class Weights(TaskPart):
    """Objective minimised where times or knots are chosen: a weighted sum of these terms."""

    time: Weight = optional("Weight of the duration", 0.0, unit="1/s")
    jerk: Weight = optional("Weight of the integral of jerk squared", 0.0, unit="s⁵/rad²")
    effort: Weight = optional(
        "Weight of the integral of effort squared, with the payload", 0.0, unit="1/(N²m²s)"
    )
    acceleration: Weight = optional(
        "Weight of the integral of acceleration squared", 0.0, unit="s³/rad²"
    )

    @model_validator(mode="after")
    def _check_weights(self) -> Weights:
        if not any(weight for _, weight in self):
            raise ValueError("all weights of the objective are zero; give one that is positive")
        return self


class ChosenSectionFields(TaskPart):
    """The chosen motion of a section of waypoints: its knots and the accelerations there."""

    times: Annotated[Items[Number], Field(min_length=4)] = required(
        "Knot times, among them the times of the section's waypoints", unit="s"
    )
    accelerations: Annotated[dict[Text, Items[Number]], Field(min_length=1)] = required(
        "Accelerations at the knots, a list for each joint", unit="angle/s² or length/s²"
    )
    velocities: dict[Text, JointMap] = optional(
        "Chosen joint velocities by the name of the waypoint", {}, unit="angle/s or length/s"
    )
    tries: Annotated[int, Field(ge=0)] = optional(
        "Number of motions tried for way: clear; else 0", 0
    )
    extra_clearance: Annotated[Number, Field(ge=0)] | None = optional(
        "Extra clearance beyond the margins, for way: clear; left out where none was requested",
        key="room",
        unit="length",
    )

    @model_validator(mode="after")
    def _check_knots(self) -> ChosenSectionFields:
        late = [time for before, time in pairwise(self.times) if time <= before]
        if late:
            raise ValueError(f"times must increase; {late[0]:g} s is not later than the one before")
        for joint, values in self.accelerations.items():
            if len(values) != len(self.times):
                raise ValueError(
                    f"accelerations of {joint} are {len(values)} for {len(self.times)} times; give "
                    "one for each time"
                )
        return self
