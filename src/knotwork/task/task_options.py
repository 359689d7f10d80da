"""Options for planning and checking: planners, tolerances, branches of solutions."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from knotwork.files.documents.values import Forms, NonEmpty, Number, Positive, optional, required
from knotwork.task.task_part import TaskPart


class Balanced(TaskPart):
    """Balanced knots with a given constant."""

    balanced: Annotated[float, Field(strict=True, gt=0, le=0.5)] = required(
        "Constant c: knots sit c times the shorter neighbouring interval away from "
        "each waypoint; smaller lowers the peaks of velocity and raises the jerk"
    )


class EndAcceleration(TaskPart):
    """Joint accelerations at the two ends of the motion; zero for joints left out."""

    start: dict[str, Number] = optional("At its start", {}, unit="angle/s² or length/s²")
    end: dict[str, Number] = optional("At its end", {}, unit="angle/s² or length/s²")


class Branch(TaskPart):
    """The branch of solutions to take; parts left out are free."""

    ONE_OR_MORE = ("shoulder", "elbow", "wrist")

    shoulder: Literal["left", "right"] | None = optional(
        "Side of axis 1 on which the upper arm is, seen from behind the arm"
    )
    elbow: Literal["up", "down"] | None = optional("Side of the line from shoulder to wrist")
    wrist: Literal["flip", "no flip"] | None = optional(
        "no flip: axis 6 is turned relative to axis 4 in the positive sense of joint 5"
    )


class PlannerOptionFields(TaskPart):
    """Further options of some planners; `knotwork planners` lists which planner takes which."""

    accelerations: (
        Annotated[
            Literal["zero", "estimated"] | NonEmpty[dict[str, Number]],
            Forms("zero, estimated, or a list of mappings of joint names to accelerations"),
        ]
        | None
    ) = optional(
        "Zero, estimated, or a mapping by joint for each waypoint in order, the "
        "start included, each joint named; 3-5-3 takes no mappings",
        unit="angle/s² or length/s²",
    )


class ToolTolerances(TaskPart):
    """Largest deviations of the tool that pass the check."""

    position: Positive = optional("Position of the TCP at a pose", unit="length", si_default=1e-6)
    orientation: Positive = optional(
        "Orientation of the tool at a pose", unit="angle", si_default=1e-6
    )
    linear_velocity: Positive = optional("Velocity of the TCP", unit="length/s", si_default=1e-6)
    angular_velocity: Positive = optional(
        "Angular velocity of the tool", unit="angle/s", si_default=1e-6
    )
    path: Positive = optional("Distance of the TCP from a path", unit="length", si_default=1e-4)
    path_orientation: Positive = optional(
        "Orientation of the tool along a path", unit="angle", si_default=math.radians(0.1)
    )
    path_speed: Annotated[float, Field(strict=True, gt=0, lt=1)] = optional(
        "Speed along a path, as a fraction of the full speed", 0.01
    )


class Tolerances(ToolTolerances):
    """Largest deviations that pass the check."""

    joint_position: Positive = optional(
        "Joint positions at waypoints given by joint values",
        unit="angle or length",
        si_default=1e-6,
    )
    joint_velocity: Positive = optional(
        "Joint velocities at waypoints given by joint values, and at stops",
        unit="angle/s or length/s",
        si_default=1e-6,
    )
    joint_acceleration: Positive = optional(
        "Joint accelerations at the ends, where given",
        unit="angle/s² or length/s²",
        si_default=1e-6,
    )


class PathOptions(TaskPart):
    """Options of the motion along tool paths."""

    acceleration: Positive = optional(
        "Largest acceleration along the path where the speed changes, at a stop or "
        "where two speeds meet",
        unit="length/s²",
        si_default=1.0,
    )
