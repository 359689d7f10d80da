"""Schema of a robot description: a file `robots/*.yaml`, or the same keys inside a scenario."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from knotwork.documents import Number, StrictModel, Text
from knotwork.documents.values import Interval, LimitsFile, Positive, Vector3
from knotwork.robot.external_axes import CELL, ExternalAxis


class CollisionFile(StrictModel):
    """Which links are never checked against one another."""

    ignore: list[Annotated[list[Text], Field(min_length=2, max_length=2)]] = Field(
        default_factory=list, description="Pairs of links that are not checked"
    )
    srdf: Text | None = Field(
        default=None,
        description="Path of an SRDF whose disabled pairs are not checked, as that of the URDF",
    )


class ExternalAxisFile(StrictModel):
    """A joint beside those of the URDF: a rail or a column below it, a positioner next to it."""

    carries: Text | None = Field(
        default=None,
        description="robot for a rail or a column; else the name of the link that it makes, a "
        "table. Left out: that of the joint",
    )
    parent: Text = Field(
        default=CELL,
        validation_alias="in",
        serialization_alias="in",
        description="Link that carries it: cell, which does not move, or that of another axis",
    )
    position: Vector3 = Field(default=(0.0, 0.0, 0.0), description="Origin in that link [m]")
    rpy: Vector3 = Field(
        default=(0.0, 0.0, 0.0), description="Turns about that link's x, y, z axes [rad]"
    )
    slides: Vector3 | None = Field(default=None, description="Its direction, if it slides")
    turns: Vector3 | None = Field(default=None, description="Its direction, if it turns")
    range: Interval | None = Field(
        default=None,
        description="Lower and upper limit of its position [rad or m]; left out: it turns without "
        "limit",
    )
    velocity: Positive | None = Field(default=None, description="Largest speed [rad/s or m/s]")

    @model_validator(mode="after")
    def _one_direction(self) -> ExternalAxisFile:
        if (self.slides is None) == (self.turns is None):
            raise ValueError("give slides or turns, a direction such as [0, 0, 1]")
        if not any(self.slides or self.turns or ()):
            raise ValueError("its direction must not be zero")
        if self.slides is not None and self.range is None:
            raise ValueError("slides, and so it has an end: give its range, [lower, upper] in m")
        return self

    def axis(self, name: str) -> ExternalAxis:
        """The axis of a name."""
        return ExternalAxis(
            name,
            self.carries or name,
            self.parent,
            tuple(self.position),
            tuple(self.rpy),
            tuple(self.slides or self.turns or ()),
            self.turns is not None,
            tuple(self.range or ()),
            self.velocity or 0.0,
        )


class RobotFile(StrictModel):
    """A robot: its URDF, which chain of it is the arm, and what the URDF doesn't say. SI units."""

    name: Text | None = Field(
        default=None, description="Name of the robot; left out: that of the file"
    )
    description: str = Field("", description="What it is, in a sentence")
    urdf: Text = Field(
        description="Path relative to the file, or `example-robot-data:` and a path below its "
        "folder `robots`"
    )
    package_paths: list[Text] = Field(
        default_factory=list,
        description="Folders that meshes are also looked for in, relative to the file: of packages "
        "that the URDF names, `package://NAME/…`, or that its relative paths start from",
    )
    external_axes: dict[Text, ExternalAxisFile] = Field(
        default_factory=dict,
        description="Joints added to the URDF, by name; its root is then the link `cell`",
    )
    base_frame: Text | None = Field(
        default=None, description="Link that poses are given in; left out: the root of the URDF"
    )
    tool_frame: Text | None = Field(
        default=None, description="Link that carries the TCP; left out: the scenario names it"
    )
    locked: dict[str, Number] = Field(
        default_factory=dict,
        description="Joints that do not move, for example fingers, and where they stand [rad or m]",
    )
    configurations: dict[str, dict[str, Number]] = Field(
        default_factory=dict, description="Named configurations: joint to position [rad or m]"
    )
    collision: CollisionFile = Field(
        CollisionFile.model_construct(), description="Which links are never checked for collisions"
    )
    limits: LimitsFile = Field(
        LimitsFile.model_construct(), description="What the URDF lacks, or what replaces its own"
    )
