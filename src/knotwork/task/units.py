"""The units of a task's values: those in brackets in the descriptions of its fields."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from functools import cache
from typing import Any

from knotwork.documents import Location
from knotwork.task.part import TaskPart

_UNIT = re.compile(r"\[([^\]]+)\]")


@cache
def units_of(part: type[TaskPart]) -> dict[str, tuple[str, str]]:
    """The key and the unit of each field that has one unit, by name."""
    found = {}
    for name, field in part.model_fields.items():
        units = set(_UNIT.findall(field.description or ""))
        key = str(field.validation_alias or name)
        found[name] = key, units.pop() if len(units) == 1 else ""
    return found


def numbers(
    part: TaskPart, units: Collection[str], location: Location = ()
) -> Iterator[tuple[Location, str, float]]:
    """All given numbers in some units: where they are in a file, the unit, and the value.

    Args:
        part: A task, or a part of one.
        units: As descriptions of fields have them, for example `"angle"`.
        location: Where the part is.
    """
    for name, (key, unit) in units_of(type(part)).items():
        if name in part.model_fields_set:
            yield from _numbers(getattr(part, name), units, (*location, key), unit)


def _numbers(
    value: Any, units: Collection[str], place: Location, unit: str
) -> Iterator[tuple[Location, str, float]]:
    if isinstance(value, TaskPart):
        yield from numbers(value, units, place)
    elif isinstance(value, dict | list):
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            if unit in units or not isinstance(one, float):
                yield from _numbers(one, units, (*place, key), unit)
    elif isinstance(value, float) and unit in units:
        yield place, unit, value
