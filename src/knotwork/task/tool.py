"""The tool of a task with its payload, and limits on how it and links move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, model_validator

from knotwork.documents import Text
from knotwork.documents.values import Forms, LimitsFile, Positive, Several, Vector3, optional
from knotwork.task.freedoms import FreePose
from knotwork.task.masses import Inertia, Mass
from knotwork.task.part import TaskPart
from knotwork.task.poses import Placement
from knotwork.task.scene import HeldObject, Shapes


class Tool(TaskPart):
    """The tool: which frame of the robot carries it, where its centre point (TCP) is, its mass."""

    frame: Text | None = optional("Frame of the robot; left out: the robot's own")
    offset: Placement | None = optional("TCP in the axes of that frame")
    free: FreePose | None = optional(
        "What all poses leave open, but those with a free of their own"
    )
    mass: Mass | None = optional(
        "Of the tool, and of what it holds that has no mass of its own, in addition to "
        "the robot's own masses [kg]"
    )
    centre_of_mass: Vector3 | None = optional(
        "In the axes of that frame; must be given with a mass [length]"
    )
    inertia: Inertia | None = optional("In the axes of that frame; left out: a point mass")
    shape: Shapes | None = optional(
        "What it looks like and is checked by, in the axes of that frame"
    )
    holds: dict[Text, HeldObject] = optional(
        "Objects that it takes along between two waypoints, in the axes of the TCP", {}
    )

    @model_validator(mode="after")
    def _mass_and_its_place(self) -> Tool:
        if self.mass is None and (self.centre_of_mass or self.inertia) is not None:
            raise ValueError("gives a centre of mass or an inertia but no mass; give mass [kg] too")
        if self.mass and self.centre_of_mass is None:
            raise ValueError("gives a mass but not where it is; give centre_of_mass too")
        return self


class FrameSpeed(TaskPart):
    """A limit on the speed of a link's origin."""

    frame: Text = Field(description="A link of the robot, for example the forearm")
    speed: Positive = Field(description="Largest speed of its origin [length/s]")


class Limits(TaskPart, LimitsFile):
    """Limits that take the place of the robot's, and limits on the motion of tool and links."""

    margin: Annotated[float, Field(strict=True, gt=0, le=1)] | None = optional(
        "Part that is used of every limit of velocity, acceleration, jerk, effort and "
        "of the speeds and acceleration of tool and links; positions keep their range"
    )
    tool_speed: Positive | None = optional("Largest speed of the TCP [length/s]")
    tool_acceleration: Positive | None = optional("Largest acceleration of the TCP [length/s²]")
    frame_speed: (
        Annotated[
            FrameSpeed | Several[FrameSpeed],
            Forms("a mapping with frame and speed, or a list of them"),
        ]
        | None
    ) = optional("Largest speed of links, for example of the elbow")
    singular_value: Positive | None = optional(
        "Least smallest singular value of the tool Jacobian, in metres and radians "
        "whatever the units"
    )

    @property
    def frame_speeds(self) -> Sequence[FrameSpeed]:
        """All limits on the speeds of links."""
        given = self.frame_speed or ()
        return (given,) if isinstance(given, FrameSpeed) else given
