"""The tool of a task with its payload, and limits on the motion of tool and links."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, model_validator

from knotwork.files.documents import Text
from knotwork.files.documents.values import (
    Forms,
    JointLimitFields,
    NonEmpty,
    NotNegative,
    Positive,
    Vector3,
    optional,
    required,
)
from knotwork.task.left_to_planning import FreePose
from knotwork.task.poses import Placement
from knotwork.task.scene_shapes import HeldObject, Inertia, Shapes, require_mass
from knotwork.task.task_part import TaskPart


class Tool(TaskPart):
    """The tool: the robot frame that carries it, its centre point (TCP) and its mass."""

    frame: Text | None = optional("Robot frame that carries it; left out: the robot's default")
    offset: Placement | None = optional("TCP in the axes of that frame")
    free: FreePose | None = optional("Freedom of all poses without a free of their own")
    mass: NotNegative | None = optional(
        "Mass of the tool, and of held objects without a mass of their own, in "
        "addition to the robot's own masses",
        unit="kg",
    )
    centre_of_mass: Vector3 | None = optional(
        "Centre of mass in the axes of that frame; must be given with a mass", unit="length"
    )
    inertia: Inertia | None = optional("Inertia in the axes of that frame; left out: a point mass")
    shape: Shapes | None = optional(
        "Shapes for display and collision checks, in the axes of that frame"
    )
    holds: dict[Text, HeldObject] = optional(
        "Objects that it carries between two waypoints, in the axes of the TCP", {}
    )

    _check_mass = model_validator(mode="after")(require_mass)

    @model_validator(mode="after")
    def _check_centre_of_mass(self) -> Tool:
        if self.mass and self.centre_of_mass is None:
            raise ValueError("gives a mass but no centre of mass; give centre_of_mass too")
        return self


class LinkSpeed(TaskPart):
    """A speed limit of a link's origin."""

    link: Text = required("A link of the robot, for example the forearm", key="frame")
    speed: Positive = required("Largest speed of the link's origin", unit="length/s")


class MotionLimits(TaskPart):
    """Limits on the motion of tool and links."""

    tool_speed: Positive | None = optional(
        "Largest speed of the TCP", unit="length/s", needs_robot=True
    )
    tool_acceleration: Positive | None = optional(
        "Largest acceleration of the TCP", unit="length/s²", needs_robot=True
    )
    frame_speed: (
        Annotated[
            LinkSpeed | NonEmpty[LinkSpeed],
            Forms("a mapping with frame and speed, or a list of them"),
        ]
        | None
    ) = optional("Largest speed of links, for example of the elbow", needs_robot=True)
    singular_value: Positive | None = optional(
        "Lower bound on the smallest singular value of the tool Jacobian, in metres and radians "
        "regardless of the units",
        needs_robot=True,
    )

    @property
    def link_speeds(self) -> Sequence[LinkSpeed]:
        """All limits on the speeds of links."""
        limits = self.frame_speed or ()
        return (limits,) if isinstance(limits, LinkSpeed) else limits

    @property
    def frame_limits(self) -> list[tuple[str, str, float]]:
        """Given limits by a name of `FRAME_ORDERS`, and by link, which is empty for the tool."""
        of_tool = ("tool_speed", self.tool_speed), ("tool_acceleration", self.tool_acceleration)
        return [
            *((quantity, "", limit) for quantity, limit in of_tool if limit is not None),
            *(("frame_speed", limit.link, limit.speed) for limit in self.link_speeds),
        ]


class Limits(MotionLimits, JointLimitFields):
    """Limits that replace those of the robot, and limits on the motion of tool and links."""

    used_fraction: Annotated[float, Field(strict=True, gt=0, le=1)] = optional(
        "Fraction of every limit of velocity, acceleration, jerk, effort and of the speeds and "
        "acceleration of tool and links that is used; positions keep their range",
        1.0,
    )
