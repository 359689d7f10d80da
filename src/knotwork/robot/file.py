"""Schema of a robot description: a file `robots/*.yaml`, or the same keys inside a scenario."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from knotwork.documents import StrictModel

Text = Annotated[str, Field(strict=True, min_length=1)]
Number = Annotated[float, Field(strict=True)]
Positive = Annotated[float, Field(strict=True, gt=0)]
PerJoint = Positive | dict[str, Positive]


class LimitsFile(StrictModel):
    """Limits that the URDF lacks, or that replace its own.

    Attributes:
        position: Lower and upper limit of a joint [rad or m].
        velocity: Of each joint named, or one number for all [rad/s or m/s].
        acceleration: Likewise [rad/s² or m/s²].
        jerk: Likewise [rad/s³ or m/s³].
        effort: Likewise [N m or N].
    """

    position: dict[str, tuple[Number, Number]] = Field(default_factory=dict)
    velocity: PerJoint = Field(default_factory=dict)
    acceleration: PerJoint = Field(default_factory=dict)
    jerk: PerJoint = Field(default_factory=dict)
    effort: PerJoint = Field(default_factory=dict)


class RobotFile(StrictModel):
    """A robot: its URDF, which chain of it is the arm, and what the URDF doesn't say. SI units.

    Attributes:
        name: Name of the robot; by default that of the file.
        description: What it is, in a sentence.
        urdf: Path relative to the file, or `example-robot-data:` and a path below its `robots`.
        base_frame: Link that poses are given in; by default the root of the URDF.
        tool_frame: Link that carries the tool centre point; without it the scenario names it.
        locked: Joints that do not move, for example fingers, and where they stand [rad or m].
        configurations: Named configurations: joint to position [rad or m].
        limits: What the URDF lacks.
    """

    name: Text | None = None
    description: str = ""
    urdf: Text
    base_frame: Text | None = None
    tool_frame: Text | None = None
    locked: dict[str, Number] = Field(default_factory=dict)
    configurations: dict[str, dict[str, Number]] = Field(default_factory=dict)
    limits: LimitsFile = LimitsFile()
