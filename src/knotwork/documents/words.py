"""What is wrong with a value, in words of our own instead of pydantic's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from knotwork.documents.document import shown

# Longer descriptions of a field are no help in an error.
LONGEST_HINT = 130
_YES = ("yes", "no", "on", "off", "y", "n")

# By pydantic's name for the error; filled in with the bounds that it tells.
_WORDS = {
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
    "recursion_loop": "holds itself",
}
# Errors whose text is ours already.
_OWN = ("kind", "waypoint_kind", "value_error")
SAY_WHAT_IS_ACCEPTED = (*_OWN, "literal_error")


def problem_words(kind: str, value: Any, said: str, context: Mapping[str, Any]) -> str:
    """Say what is wrong with a value.

    Args:
        kind: Pydantic's name for the error.
        value: What was found.
        said: Pydantic's message, taken where it is one of ours.
        context: The bounds or choices that pydantic tells.
    """
    if kind in _OWN:
        words = said.removeprefix("Value error, ")
        return words if isinstance(value, dict) else f"{_found(value)}: {words}"
    if kind in _SIZES:
        return f"{shown(value)}: {_SIZES[kind](value, context)}"
    words = _WORDS.get(kind, "is not accepted").format(**context)
    if kind == "literal_error" and words == "must be True":
        words = "must be true, or left out"
        if str(value).lower() in _YES:
            return f"{shown(value)} is text in YAML 1.2: {words}"
    if kind == "string_type" and isinstance(value, int | float):
        words += "; put it in quotes"
    return f"{_found(value)}: {words}"


def _found(value: Any) -> str:
    return "has no value" if value is None else shown(value)


def _too_short(value: Any, context: Mapping[str, Any]) -> str:
    return f"has {_count(value)}, fewer than {context['min_length']}" if value else "is empty"


def _too_long(value: Any, context: Mapping[str, Any]) -> str:
    return f"has {_count(value)}, more than {context['max_length']}"


def _count(value: Any) -> str:
    return "1 value" if len(value) == 1 else f"{len(value)} values"


_SIZES: dict[str, Callable[[Any, Mapping[str, Any]], str]] = {
    "too_short": _too_short,
    "too_long": _too_long,
}


def hint(description: str | None) -> str:
    """First clause of a field's description, with its unit, as what would be accepted."""
    first, _, rest = (description or "").partition("; ")
    if rest.endswith("]") and not first.endswith("]"):
        first = f"{first} {rest[rest.rindex('[') :]}"
    if not first or len(first) > LONGEST_HINT:
        return ""
    return first if first[1:2].isupper() else f"{first[0].lower()}{first[1:]}"
