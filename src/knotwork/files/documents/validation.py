"""Validation of plain data against a model, with the location of every problem."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, TypeVar, cast

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from knotwork.errors import DocumentError, Problem, format_value, suggest_name
from knotwork.files.documents.document import Document, Location
from knotwork.files.documents.values import StrictModel

ModelT = TypeVar("ModelT", bound=StrictModel)

MAX_REPORTED_PROBLEMS = 1_000
"""Maximum number of problems that are reported."""
MAX_CLAUSE_LENGTH = 130
"""Maximum length of the clause of a description that errors quote, in characters."""

_YAML_1_1_BOOLEANS = ("yes", "no", "on", "off", "y", "n")
_ERROR_WORDS = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "finite_number": "must be a finite number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "string_too_short": "must not be empty",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "literal_error": "must be {expected}",
    "too_short": "has {count}, fewer than {min_length}",
    "too_long": "has {count}, more than {max_length}",
    "recursion_loop": "contains itself",
}
"""Message by pydantic's name of the error, with placeholders for its bounds."""
_OWN_ERRORS = ("kind", "waypoint_kind", "value_error")
"""Errors with a message of this package."""
_STATING_ACCEPTED = (*_OWN_ERRORS, "literal_error", "bool_type")
"""Errors whose message already states the accepted values."""


def validate(model: type[ModelT], document: Document, instance: ModelT | None = None) -> ModelT:
    """Check a document against a model and return the model's instance.

    Args:
        model: The model.
        document: Data to check.
        instance: Instance to fill in; by default a new one.

    Raises:
        DocumentError: There are problems; the first `MAX_REPORTED_PROBLEMS` are listed.
    """
    if not isinstance(document.data, dict):
        raise document.error(
            (), f"{format_value(document.data)}: must be a mapping of keys to values"
        )
    try:
        checked = model.__pydantic_validator__.validate_python(
            document.data, self_instance=instance
        )
    except ValidationError as error:
        errors = [dict(item) for item in error.errors(include_url=False)]
    else:
        return cast(ModelT, checked)
    errors = [item for item in errors if not _is_consequence(item)]
    is_cut = len(errors) > MAX_REPORTED_PROBLEMS
    problems = [_problem(model, document, item) for item in errors[:MAX_REPORTED_PROBLEMS]]
    problems.sort(key=lambda problem: problem.line or 0)
    raise DocumentError(document.file, list(dict.fromkeys(problems)), complete=not is_cut)


def _is_consequence(item: dict[str, Any]) -> bool:
    """Whether an error only follows from wrong items of a list, which pydantic does not count."""
    value = item["input"]
    too_short = item["type"] == "too_short" and isinstance(value, list | tuple)
    return too_short and not len(value) < item["ctx"]["min_length"]


def field_at(model: type[BaseModel], data: Any, location: Location) -> FieldInfo | None:
    """The field at a location of a model's data, or the innermost one around it."""
    return _resolve(model, data, location).field


class _ErrorLocation(NamedTuple):
    """The location of an error in the data, and its possible models.

    Attributes:
        location: Keys and indices from the whole data inwards.
        owners: Models that may own the last key.
        inner: Possible models of the location itself.
        field: The last field on the path, or `None`.
        value: The value at the location, or `None`.
    """

    location: Location
    owners: list[type[BaseModel]]
    inner: list[type[BaseModel]]
    field: FieldInfo | None
    value: Any


def _problem(model: type[BaseModel], document: Document, item: dict[str, Any]) -> Problem:
    place = _resolve(model, document.data, item["loc"])
    kind, value = item["type"], item["input"]
    part = place.value if isinstance(place.value, StrictModel) else None
    accepted = ""
    if item["loc"][-1:] == ("[key]",):
        words = "a name is empty" if value == "" else f"the key {format_value(value)} must be text"
    elif kind == "extra_forbidden":
        words = f"unknown key; {suggest_name(place.location[-1], sorted(_keys(place.owners)))}"
    elif part is not None and place.inner:
        words = f"{format_value(part)}: is not accepted"
        accepted = ", ".join(kind.__name__ for kind in place.inner)
    else:
        if part is not None and (kind == "too_short" or value is not part):
            kind, value = "tuple_type", part  # pydantic iterates over the fields of a part
        words = problem_words(kind, value, item["msg"], item.get("ctx", {}))
        if kind == "model_type":
            accepted = ", ".join(_keys(place.inner))
        elif kind not in _STATING_ACCEPTED and place.field is not None:
            words += _bracketed_clause(place.field.description)
    location = place.location
    return Problem(document.line(location), document.path(location), words, accepted)


def _resolve(model: type[BaseModel], data: Any, loc: tuple[str | int, ...]) -> _ErrorLocation:
    """Translate pydantic's location of an error, which also names parts of unions."""
    location: list[str | int] = []
    inner: list[Any] = [model]
    owners: list[type[BaseModel]] = [model]
    field: FieldInfo | None = None
    for position, part in enumerate(loc):
        inside = (isinstance(data, dict) and part in data) or (
            isinstance(data, list | tuple) and isinstance(part, int) and part < len(data)
        )
        models = [kind for kind in inner if _is_model(kind)]
        is_field = isinstance(data, dict) and part in _keys(models)
        if not inside and not (is_field and position == len(loc) - 1):
            inner = [kind for kind in models if kind.__name__ == part] or inner
            continue
        location.append(part)
        owners = models or owners
        for owner in models:
            field = _fields(owner).get(part, field)
        inner = _children(inner, part)
        data = data[part] if inside else None
    models = [kind for kind in inner if _is_model(kind)]
    return _ErrorLocation(tuple(location), owners, models, field, data)


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _fields(model: type[BaseModel]) -> dict[str | int, FieldInfo]:
    """Fields of a model by their keys in a file."""
    model.model_rebuild()  # resolves types that are defined below the model
    return {
        str(key): info
        for name, info in model.model_fields.items()
        for key in getattr(info.validation_alias, "choices", [info.validation_alias or name])
    }


def _keys(models: Iterable[type[BaseModel]]) -> list[str]:
    return list(dict.fromkeys(str(key) for model in models for key in _fields(model)))


def _flat_types(kind: Any) -> list[Any]:
    """Types that a type allows: the members of a union, without annotations."""
    if typing.get_origin(kind) is typing.Annotated:
        return _flat_types(typing.get_args(kind)[0])
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return [member for part in typing.get_args(kind) for member in _flat_types(part)]
    return [kind]


def _children(kinds: Iterable[Any], part: str | int) -> list[Any]:
    """Types of the values under a key or index of some types."""
    children: list[Any] = []
    for kind in kinds:
        if _is_model(kind):
            children += [_fields(kind)[part].annotation] if part in _fields(kind) else []
        elif typing.get_origin(kind) is dict:
            children.append(typing.get_args(kind)[1])
        else:
            children += [item for item in typing.get_args(kind) if item is not Ellipsis]
    return [kind for child in children for kind in _flat_types(child)]


def problem_words(kind: str, value: Any, message: str, context: Mapping[str, Any]) -> str:
    """Describe the problem that pydantic found with a value.

    Args:
        kind: Pydantic's name for the error.
        value: The value found.
        message: Pydantic's message, used if it is from this package.
        context: Bounds or choices given by pydantic.
    """
    if kind == "missing":
        return "is missing and must be given"
    if kind in _OWN_ERRORS:
        words = message.removeprefix("Value error, ")
        return words if isinstance(value, dict) else f"{_value_text(value)}: {words}"
    if kind == "too_short" and not value:
        return f"{format_value(value)}: is empty"
    if kind in ("too_short", "too_long"):
        context = {**context, "count": "1 value" if len(value) == 1 else f"{len(value)} values"}
    words = _ERROR_WORDS.get(kind, "is not accepted").format(**context)
    if kind == "literal_error" and words == "must be True":
        words = "must be true, or left out"
        if str(value).lower() in _YAML_1_1_BOOLEANS:
            return f"{format_value(value)} is text in YAML 1.2: {words}"
    if kind == "string_type" and isinstance(value, int | float):
        words += "; put it in quotes"
    return f"{_value_text(value)}: {words}"


def _value_text(value: Any) -> str:
    return "has no value" if value is None else format_value(value)


def _bracketed_clause(description: str | None) -> str:
    """First clause of a field's description, with its unit, in brackets."""
    first = (description or "").partition("; ")[0]
    if not first or len(first) > MAX_CLAUSE_LENGTH:
        return ""
    return f" ({first if first[1:2].isupper() else f'{first[0].lower()}{first[1:]}'})"
