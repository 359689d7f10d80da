"""A weave: an oscillation of the tool that is added to the path."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from knotwork.files.documents.values import Items, Positive, Vector3, optional
from knotwork.task.task_part import TaskPart


class Weave(TaskPart):
    """An oscillation across the seam or around it."""

    shape: Literal["sine", "triangle", "circle", "eight"] = Field(
        description="sine or triangle, from edge to edge; circle; or eight, half as long as wide"
    )
    width: Positive = Field(description="Width from edge to edge [length]")
    frequency: Positive = Field(description="Frequency [Hz]")
    dwell: Positive | None = optional("Dwell time at each edge, for sine and triangle [s]")
    rounding: Positive | None = optional(
        "Largest deviation of a triangle from sharp corners, up to a quarter of its "
        "width [length]; left out: the tolerance of the path"
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
    def loop(self) -> bool:
        """Whether the shape is a closed loop."""
        return self.shape in ("circle", "eight")

    @model_validator(mode="after")
    def _fits_its_shape(self) -> Weave:
        loop = self.loop
        if loop and self.dwell is not None:
            raise ValueError(f"gives dwell, but a {self.shape} has no edges; leave it out")
        if self.rounding is not None and self.shape != "triangle":
            raise ValueError(f"gives rounding, but a {self.shape} has no corners; leave it out")
        if self.rounding is not None and 4.0 * self.rounding > self.width:
            raise ValueError(f"gives rounding above {0.25 * self.width:g}, a quarter of its width")
        if self.dwell is not None and 2.0 * self.dwell * self.frequency >= 1.0:
            raise ValueError(
                f"holds both edges for {2.0 * self.dwell:g} s of a period of "
                f"{1.0 / self.frequency:g} s; a dwell below {0.5 / self.frequency:g} s is accepted"
            )
        if self.axes is None:
            return self
        if not loop and self.axes == ("along",):
            raise ValueError(
                f"goes in along, which is the seam itself; a {self.shape} takes in: [across] or "
                "in: [normal]"
            )
        count = 2 if loop else 1
        if len(set(self.axes)) != count or len(self.axes) != count:
            axes = "two different axes" if loop else "one axis"
            raise ValueError(
                f"goes in {', '.join(self.axes)}; a {self.shape} takes {axes} of across, normal, "
                "along"
            )
        return self
