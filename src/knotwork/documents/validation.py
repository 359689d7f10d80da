"""Plain data against a model: every problem is said at its place."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from knotwork.documents.document import Document, Location, shown
from knotwork.errors import DocumentError, Problem, did_you_mean

ModelT = TypeVar("ModelT", bound="StrictModel")

# Fields take what they say and convert nothing: text is no number, `true` is no 1.
Number = Annotated[float, Field(strict=True)]
Positive = Annotated[float, Field(strict=True, gt=0)]
Text = Annotated[str, Field(strict=True, min_length=1)]


class StrictModel(BaseModel):
    """A part of a document: unknown keys are errors, and values are frozen once read."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


def validate(model: type[ModelT], document: Document) -> ModelT:
    """Check a document against a model and return the model's instance.

    Raises:
        DocumentError: With every problem found.
    """
    if not isinstance(document.data, dict):
        kind = type(document.data).__name__
        raise document.error((), f"holds a single {kind}", "a mapping of keys to values")
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        problems = [_problem(model, document, dict(item)) for item in error.errors()]
        problems.sort(key=lambda problem: problem.line or 0)
        raise DocumentError(document.file, list(dict.fromkeys(problems))) from None


def _problem(model: type[BaseModel], document: Document, item: dict[str, Any]) -> Problem:
    location, owners = _resolve(model, document.data, item["loc"])
    line, path = document.line(location), document.path(location)
    if item["type"] == "extra_forbidden":
        keys = sorted({key for owner in owners for key in _keys(owner)})
        return Problem(line, path, "unknown key", did_you_mean(location[-1], keys))
    if item["type"] == "missing":
        return Problem(line, path, "is missing and must be given")
    message = str(item["msg"]).removeprefix("Value error, ")
    message = message.replace("Input should be", "must be").replace("Input should", "must")
    value = item["input"]
    given = "" if isinstance(value, (dict, list, BaseModel)) else f"{shown(value)}: "
    return Problem(line, path, f"{given}{message[:1].lower()}{message[1:]}")


def _resolve(
    model: type[BaseModel], data: Any, loc: tuple[str | int, ...]
) -> tuple[Location, list[type[BaseModel]]]:
    """Find the location that pydantic means, without the names it gives to parts of a union.

    Returns:
        The location in the data, and the models that may own its last key.
    """
    location: list[str | int] = []
    candidates: list[Any] = [model]
    owners: list[type[BaseModel]] = [model]
    for position, part in enumerate(loc):
        inside = (isinstance(data, dict) and part in data) or (
            isinstance(data, list) and isinstance(part, int) and part < len(data)
        )
        models = [owner for owner in _flatten(candidates) if _is_model(owner)]
        known = isinstance(data, dict) and any(part in _keys(owner) for owner in models)
        if not inside and not (known and position == len(loc) - 1):
            tagged = [owner for owner in models if owner.__name__ == part]
            candidates = tagged or candidates
            continue
        location.append(part)
        owners = models or owners
        candidates = _children(candidates, part)
        data = data[part] if inside else None
    return tuple(location), owners


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _keys(model: type[BaseModel]) -> list[str]:
    return [info.alias or name for name, info in model.model_fields.items()]


def _flatten(candidates: Iterable[Any]) -> list[Any]:
    """Open up unions and annotations."""
    flat: list[Any] = []
    for kind in candidates:
        origin = typing.get_origin(kind)
        if origin is typing.Annotated:
            inner: Iterable[Any] = typing.get_args(kind)
            flat += _flatten([next(iter(inner))])
        elif origin in (typing.Union, types.UnionType):
            flat += _flatten(typing.get_args(kind))
        else:
            flat.append(kind)
    return flat


def _children(candidates: Iterable[Any], part: str | int) -> list[Any]:
    """Types of what lies under a key or index of any of the candidate types."""
    children: list[Any] = []
    for kind in _flatten(candidates):
        if _is_model(kind):
            children += [
                info.annotation
                for name, info in kind.model_fields.items()
                if (info.alias or name) == part
            ]
        else:
            arguments = [item for item in typing.get_args(kind) if item is not Ellipsis]
            if typing.get_origin(kind) is dict and len(arguments) == 2:
                children.append(arguments[1])
            elif arguments:
                children += arguments if typing.get_origin(kind) is tuple else arguments[:1]
    return _flatten(children)
