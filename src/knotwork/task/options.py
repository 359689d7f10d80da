"""How a task is planned and checked: options of planners, tolerances, branches of solutions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from knotwork.documents.values import Forms, Number, Positive, Several, optional
from knotwork.task.part import TaskPart


class Balanced(TaskPart):
    """Balanced knots with their constant given."""

    balanced: Annotated[float, Field(strict=True, gt=0, le=0.5)] = Field(
        description="Constant c: knots sit c times the shorter neighbouring interval away from "
        "each waypoint; smaller lowers the peaks of velocity and raises the jerk"
    )


class EndAcceleration(TaskPart):
    """Joint accelerations at the two ends; joints left out have none."""

    start: dict[str, Number] = optional("At the first waypoint [angle/s² or length/s²]", {})
    end: dict[str, Number] = optional("At the last waypoint [angle/s² or length/s²]", {})


class Branch(TaskPart):
    """The branch of solutions to take, in words; what is left out is free."""

    shoulder: Literal["left", "right"] | None = optional(
        "Side of axis 1 on which the upper arm is, seen from behind the arm"
    )
    elbow: Literal["up", "down"] | None = optional("Above or below the line from shoulder to wrist")
    wrist: Literal["flip", "no flip"] | None = optional(
        "no flip: axis 6 is turned from axis 4 in the positive sense of joint 5"
    )

    @model_validator(mode="after")
    def _one_at_least(self) -> Branch:
        if not (self.shoulder or self.elbow or self.wrist):
            raise ValueError("names no branch; give one of shoulder, elbow, wrist")
        return self


class Presets(TaskPart):
    """Options of some planners beyond knots; `knotwork planners` says which takes which."""

    accelerations: (
        Annotated[
            Literal["zero", "estimated"] | Several[dict[str, Number]],
            Forms("zero, estimated, or a list of mappings of joint names to accelerations"),
        ]
        | None
    ) = optional(
        "Zero, estimated, or a mapping by joint for each waypoint in order, the start "
        "included, each joint named; 3-5-3 takes none for the first two and the last two "
        "[angle/s² or length/s²]"
    )


class Tolerances(TaskPart):
    """Largest differences from the task that pass the check; by default 1e-6 in SI."""

    position: Positive | None = optional("Of the TCP at a pose [length]")
    orientation: Positive | None = optional("Of the tool at a pose [angle]")
    linear_velocity: Positive | None = optional("Of the TCP [length/s]")
    angular_velocity: Positive | None = optional("Of the tool [angle/s]")
    joint_position: Positive | None = optional(
        "At waypoints given by joint values [angle or length]"
    )
    joint_velocity: Positive | None = optional(
        "At waypoints given by joint values, and where the tool is to stop [angle/s or length/s]"
    )
    joint_acceleration: Positive | None = optional(
        "At the ends, where asked for [angle/s² or length/s²]"
    )
    path: Positive | None = optional("Distance of the TCP from a path [length]; left out: 0.1 mm")
    path_orientation: Positive | None = optional(
        "Of the tool along a path [angle]; left out: 0.1 degrees"
    )
    path_speed: Annotated[float, Field(strict=True, gt=0, lt=1)] | None = optional(
        "Of the speed along a path, as a part of the full speed; left out: 0.01"
    )


class PathOptions(TaskPart):
    """How the tool moves along paths."""

    acceleration: Positive | None = optional(
        "Largest acceleration along the path where its speed changes, at a stop or "
        "where two speeds meet [length/s²]; left out: 1 m/s²"
    )
