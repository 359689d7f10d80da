"""Kinds of values in a file: numbers, vectors, text, and telling forms of a value apart.

Fields take what they say and convert nothing: text is no number, `true` is no 1.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

# No length, angle, time or limit of a real task is larger, and nothing computed from numbers of
# this size leaves the range of floats.
LARGEST = 1e12
# Nothing real is smaller; in other units, or divided by a time, what is could round to zero.
SMALLEST = 1e-100


def _above_rounding(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"is so small that it may round to zero in SI; give at least {SMALLEST:g}")
    return value


Text = Annotated[str, Field(strict=True, min_length=1)]
Finite = Annotated[float, Field(strict=True)]
Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST), AfterValidator(_above_rounding)]
if TYPE_CHECKING:
    Items = Sequence
else:

    class Items:
        """A list in a file is a tuple in a task, so that nothing of a task can be changed."""

        def __class_getitem__(cls, item: Any) -> Any:
            return tuple[item, ...]


Vector3 = Annotated[Items[Number], Field(min_length=3, max_length=3)]
Vector4 = Annotated[Items[Number], Field(min_length=4, max_length=4)]
JointMap = Annotated[dict[Text, Number], Field(min_length=1)]


class StrictModel(BaseModel):
    """A part of a document: unknown keys are errors, and values are frozen once read."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
        # Only a whole document is ever validated: its parts need no validators of their own.
        defer_build=True,
    )
    # Groups of fields of which one at most may be given.
    ALTERNATIVES: ClassVar[tuple[tuple[str, ...], ...]] = ()

    @model_validator(mode="after")
    def _one_of_each(self) -> StrictModel:
        for names in self.ALTERNATIVES:
            given = [name for name in names if getattr(self, name) is not None]
            if len(given) > 1:
                raise ValueError(f"gives {' and '.join(given)}; give one of them")
        return self


def _kind(value: Any) -> str | None:
    """Tell text, a mapping, a list and a number apart, so that only one of them is tried."""
    if isinstance(value, str):
        return "text"
    if isinstance(value, dict | StrictModel):
        return "mapping"
    if isinstance(value, list | tuple):
        return "list"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return "number"
    return None


def by_kind(accepted: str, words: Collection[str] | None = None) -> Discriminator:
    """Tell the forms of a value apart by their kind; the error says which are accepted.

    Args:
        accepted: All forms, in words.
        words: The text that is accepted; by default the text has its own check.
    """

    def kind(value: Any) -> str | None:
        unknown = isinstance(value, str) and words is not None and value not in words
        return None if unknown else _kind(value)

    return Discriminator(kind, custom_error_type="kind", custom_error_message=f"must be {accepted}")


def _range(values: tuple[float, ...]) -> tuple[float, ...]:
    if values[0] >= values[1]:
        raise ValueError(f"lower limit {values[0]:g} must be less than upper limit {values[1]:g}")
    return values


Interval = Annotated[Items[Number], Field(min_length=2, max_length=2), AfterValidator(_range)]
JointLimits = Annotated[
    Annotated[Positive, Tag("number")]
    | Annotated[Annotated[dict[str, Positive], Field(min_length=1)], Tag("mapping")],
    by_kind("a positive number for every joint or a mapping of joint names to positive numbers"),
]
JointsOrName = Annotated[
    Annotated[Text, Tag("text")] | Annotated[JointMap, Tag("mapping")],
    by_kind("the name of a configuration or a mapping of joint names to values"),
]


class LimitsFile(StrictModel):
    """Limits that take the place of those of the URDF, or of the robot."""

    position: dict[str, Interval] | None = Field(
        default=None, description="Lower and upper limit by joint [angle or length]"
    )
    velocity: JointLimits | None = Field(
        default=None, description="Largest speed, for all joints or by joint [angle/s or length/s]"
    )
    acceleration: JointLimits | None = Field(
        default=None,
        description="Largest acceleration, for all joints or by joint [angle/s² or length/s²]",
    )
    jerk: JointLimits | None = Field(
        default=None,
        description="Largest jerk, for all joints or by joint [angle/s³ or length/s³]. Where times "
        "are chosen and none is given, one is assumed: the limit of acceleration reached in 10 ms, "
        "at most 20000 rad/s³ or m/s³",
    )
    effort: JointLimits | None = Field(
        default=None, description="Largest torque or force, for all joints or by joint [N m or N]"
    )
