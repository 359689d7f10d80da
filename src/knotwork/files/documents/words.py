"""Messages for wrong values, in place of those of pydantic."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from knotwork.errors import shown

# Longer descriptions do not help in an error.
LONGEST_HINT = 130
_YES = ("yes", "no", "on", "off", "y", "n")

# By pydantic's name of the error, with placeholders for its bounds.
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
# Errors with a text of this package.
_OWN = ("kind", "waypoint_kind", "along_kind", "value_error")
SAY_WHAT_IS_ACCEPTED = (*_OWN, "literal_error")


def problem_words(kind: str, value: Any, message: str, context: Mapping[str, Any]) -> str:
    """Describe the problem with a value.

    Args:
        kind: Pydantic's name for the error.
        value: The value found.
        message: Pydantic's message, used if it is from this package.
        context: Bounds or choices given by pydantic.
    """
    if kind in _OWN:
        words = message.removeprefix("Value error, ")
        return words if isinstance(value, dict) else f"{_value_text(value)}: {words}"
    if kind == "too_short" and not value:
        return f"{shown(value)}: is empty"
    if kind in ("too_short", "too_long"):
        context = {**context, "count": "1 value" if len(value) == 1 else f"{len(value)} values"}
    words = _ERROR_WORDS.get(kind, "is not accepted").format(**context)
    if kind == "literal_error" and words == "must be True":
        words = "must be true, or left out"
        if str(value).lower() in _YES:
            return f"{shown(value)} is text in YAML 1.2: {words}"
    if kind == "string_type" and isinstance(value, int | float):
        words += "; put it in quotes"
    return f"{_value_text(value)}: {words}"


def _value_text(value: Any) -> str:
    return "has no value" if value is None else shown(value)


def hint(description: str | None) -> str:
    """First clause of a field's description, with its unit, as the accepted values."""
    first, _, others = (description or "").partition("; ")
    if others.endswith("]") and not first.endswith("]"):
        first = f"{first} {others[others.rindex('[') :]}"
    if not first or len(first) > LONGEST_HINT:
        return ""
    return first if first[1:2].isupper() else f"{first[0].lower()}{first[1:]}"
