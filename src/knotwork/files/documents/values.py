"""Kinds of values in a file: numbers, vectors, text, and unions of them.

Fields convert nothing: text is not a number, and `true` is not 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    model_validator,
)
from pydantic.fields import FieldInfo

from knotwork.units import readable

MAX_NUMBER = 1e12
"""Maximum size of numbers: those of real tasks are smaller, and results computed from numbers of
this size stay in the range of floats.
"""
MIN_NUMBER = 1e-100
"""Minimum of positive numbers: a change of units or a division could round smaller ones to zero."""


def _above_rounding(value: float) -> float:
    if value < MIN_NUMBER:
        raise ValueError(
            f"is so small that it may round to zero in SI; give at least {MIN_NUMBER:g}"
        )
    return value


Text = Annotated[str, Field(strict=True, min_length=1)]
Finite = Annotated[float, Field(strict=True)]
Number = Annotated[float, Field(strict=True, ge=-MAX_NUMBER, le=MAX_NUMBER)]
Positive = Annotated[
    float, Field(strict=True, gt=0, le=MAX_NUMBER), AfterValidator(_above_rounding)
]
NotNegative = Annotated[float, Field(strict=True, ge=0, le=MAX_NUMBER)]
if TYPE_CHECKING:
    Items = Sequence
    NonEmpty = Sequence
else:

    class Items:
        """A list in a file, which becomes a tuple, so that no part of a task can be changed."""

        def __class_getitem__(cls, item: Any) -> Any:
            return tuple[item, ...]

    class NonEmpty:
        """A list in a file with at least one item, which becomes a tuple."""

        def __class_getitem__(cls, item: Any) -> Any:
            return Annotated[tuple[item, ...], Field(min_length=1)]


Vector3 = Annotated[Items[Number], Field(min_length=3, max_length=3)]
Vector4 = Annotated[Items[Number], Field(min_length=4, max_length=4)]
JointMap = Annotated[dict[Text, Number], Field(min_length=1)]


class StrictModel(BaseModel):
    """A part of a document: unknown keys are errors, and instances are frozen."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
        # Only whole documents are validated: their parts need no validators of their own.
        defer_build=True,
    )
    # Groups of fields, of each of which at most one may be given.
    ALTERNATIVES: ClassVar[tuple[tuple[str, ...], ...]] = ()
    # Fields of which at least one must be given.
    ONE_OR_MORE: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="after")
    def _check_alternatives(self) -> StrictModel:
        for names in self.ALTERNATIVES:
            keys = [name for name in names if getattr(self, name) is not None]
            if len(keys) > 1:
                raise ValueError(f"gives {' and '.join(keys)}; give one of them")
        if self.ONE_OR_MORE and all(getattr(self, name) is None for name in self.ONE_OR_MORE):
            number = "one" if self.ONE_OR_MORE in self.ALTERNATIVES else "at least one"
            raise ValueError(f"gives none of {', '.join(self.ONE_OR_MORE)}; give {number}")
        return self


def required(description: str, **options: Any) -> Any:
    """A field that must be given. The options are those of `optional`."""
    return optional(description, ..., **options)


def optional(
    description: str,
    default: Any = None,
    *,
    unit: str = "",
    key: str | None = None,
    path: bool = False,
    names_frame: bool = False,
    names_waypoint: bool = False,
    needs_robot: bool = False,
    defines_motion: bool = False,
    si_default: float | None = None,
) -> Any:
    """An optional field.

    Args:
        description: Description of the field; its first clause ends at a semicolon.
        default: Default value.
        unit: Unit of the numbers in the field, for example `"length/s"`. The description shows it
            in brackets after its first clause.
        key: Key in a file, if the field has another name in Python.
        path: Whether a text in the field is a path relative to the file.
        names_frame: Whether the field is the name of a frame.
        names_waypoint: Whether it is the name of a waypoint, to which repeats add their number.
        needs_robot: Whether a value other than the default needs a robot.
        defines_motion: Whether the field defines the motion, its times or its signals. A motion
            that is executed, or read from a file, has its own; it keeps all other fields. In
            waypoints, only fields that joint waypoints share need the mark; their `time`, `joints`
            and `velocity` are replaced without it.
        si_default: Default in SI, whatever the units of the file. The schema has no default then,
            but the description states it.
    """
    marks = {
        "unit": unit, "path": path, "names_frame": names_frame, "needs_robot": needs_robot,
        "names_waypoint": names_waypoint, "defines_motion": defines_motion,
    }  # fmt: skip
    used_marks = {name: mark for name, mark in marks.items() if mark}
    if unit:
        clause, semicolon, others = description.partition(";")
        description = f"{clause} [{unit}]{semicolon}{others}"
    if si_default is not None:
        si_unit = unit.replace("length", "m").replace("angle", "rad")
        description += f"; left out: {readable(si_default)} {si_unit}"
    about: dict[str, Any] = {"description": description, "json_schema_extra": used_marks or None}
    if key is not None:
        about |= {"validation_alias": key, "serialization_alias": key}
    if si_default is not None:
        return Field(default_factory=lambda: si_default, **about)
    if default in ({}, (), []):
        return Field(default_factory=type(default), **about)
    return Field(default=default, **about)


def is_marked(field: FieldInfo | None, mark: str) -> bool:
    """Whether a field has a mark of `optional`, such as `"path"` or `"needs_robot"`."""
    about = None if field is None else field.json_schema_extra
    return isinstance(about, dict) and mark in about


def marked(model: type[BaseModel], mark: str) -> set[str]:
    """Names of the fields of a model that have a mark; see `is_marked`."""
    return {name for name, field in model.model_fields.items() if is_marked(field, mark)}


def unit_of(field: FieldInfo | None) -> str:
    """Unit of the numbers in a field, as given to `optional`; empty without one."""
    about = None if field is None else field.json_schema_extra
    return str(about.get("unit", "")) if isinstance(about, dict) else ""


def _kind(value: Any) -> str | None:
    """Classify a value, so that it is only validated as the form of its kind."""
    if isinstance(value, str):
        return "text"
    if isinstance(value, dict | StrictModel):
        return "mapping"
    if isinstance(value, list | tuple):
        return "list"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return "number"
    return None


class Forms:
    """A union whose parts differ in kind (text, mapping, list, number); errors list all forms.

    Args:
        accepted: All forms, in words.
    """

    def __init__(self, accepted: str) -> None:
        self.accepted = f"must be {accepted}"

    def __get_pydantic_core_schema__(self, union: Any, handler: Any) -> Any:
        """The schema of the union."""
        parts = [(part, *_form(part)) for part in get_args(union)]
        words = next((words for _, kind, words in parts if kind == "text"), ())

        def kind_of(value: Any) -> str | None:
            unknown = isinstance(value, str) and words and value not in words
            return None if unknown else _kind(value)

        tagged: Any = Union[tuple(Annotated[part, Tag(kind)] for part, kind, _ in parts)]  # noqa: UP007 - of parts
        discriminator = Discriminator(
            kind_of, custom_error_type="kind", custom_error_message=self.accepted
        )
        return handler.generate_schema(Annotated[tagged, discriminator])


def _form(part: Any) -> tuple[str, tuple[Any, ...]]:
    """The kind of a part of a union, and the only texts that it accepts, if it has such."""
    origin = get_origin(part)
    if origin is Annotated:
        return _form(get_args(part)[0])
    if origin is Literal:
        return "text", get_args(part)
    kinds = {str: "text", float: "number", tuple: "list", dict: "mapping"}
    return kinds.get(origin or part, "mapping"), ()


def _range(values: tuple[float, ...]) -> tuple[float, ...]:
    if values[0] >= values[1]:
        raise ValueError(f"lower limit {values[0]:g} must be less than upper limit {values[1]:g}")
    return values


Range = Annotated[Items[Number], Field(min_length=2, max_length=2), AfterValidator(_range)]
LimitOfJoints = Annotated[
    Positive | Annotated[dict[str, Positive], Field(min_length=1)],
    Forms("a positive number for every joint or a mapping of joint names to positive numbers"),
]
JointsOrName = Annotated[
    Text | JointMap,
    Forms("the name of a configuration or a mapping of joint names to values"),
]


class JointLimitFields(StrictModel):
    """Limits that replace those of the URDF, or of the robot."""

    position: dict[str, Range] | None = optional(
        "Lower and upper limit by joint", unit="angle or length"
    )
    velocity: LimitOfJoints | None = optional(
        "Largest speed, for all joints or by joint", unit="angle/s or length/s"
    )
    acceleration: LimitOfJoints | None = optional(
        "Largest acceleration, for all joints or by joint", unit="angle/s² or length/s²"
    )
    jerk: LimitOfJoints | None = optional(
        "Largest jerk, for all joints or by joint; where times are chosen and none "
        "is given, one is assumed: the limit of acceleration reached in 10 ms, at "
        "most 20000 rad/s³ or m/s³",
        unit="angle/s³ or length/s³",
    )
    effort: LimitOfJoints | None = optional(
        "Largest torque or force, for all joints or by joint", unit="N m or N"
    )
