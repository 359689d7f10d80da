"""The unit of a value of a scenario's file, as the schema's descriptions say it in brackets."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from knotwork.documents import Location
from knotwork.task import Task
from knotwork.units import Units

_UNIT = re.compile(r" \[([^\]]+)\]")


def unit_of(location: Location, units: Units) -> str:
    """The unit of a value; empty where it has none, or one of several.

    >>> unit_of(("frames", "block", "rpy", 2), Units("mm", "deg"))
    'deg'

    Args:
        location: Where it is in the file.
        units: Those of the file.
    """
    whole = Task.model_json_schema()
    parts: list[dict[str, Any]] = [whole]
    found: set[str] = set()
    for key in location:
        parts = [child for part in parts for child in _below(part, key, whole)]
        stated = {unit for part in parts for unit in _UNIT.findall(part.get("description", ""))}
        found = stated or found
    text = found.pop() if len(found) == 1 else ""
    if " or " in text:
        return ""
    return text.replace("length", units.length).replace("angle", units.angle)


def _below(part: dict[str, Any], key: str | int, whole: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What the schema says of a key or an item of a part of the file, in each form it may have."""
    if "$ref" in part:
        yield from _below(whole["$defs"][part["$ref"].rpartition("/")[2]], key, whole)
    for form in (*part.get("anyOf", ()), *part.get("oneOf", ())):
        yield from _below(form, key, whole)
    if isinstance(key, int):
        yield from [part["items"]] if "items" in part else part.get("prefixItems", [])
    elif key in part.get("properties", {}):
        yield part["properties"][key]
    elif isinstance(part.get("additionalProperties"), dict):
        yield part["additionalProperties"]
