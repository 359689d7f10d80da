"""Values of a scenario by their path, for example `frames.block.position[0]`.

They are set in the plain data of a file, since a path may name a key that is left out, and a value
may decide what kind of waypoint or shape it belongs to. Each row is validated once.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from knotwork.errors import InputError, suggest_name
from knotwork.files.documents import Document, Edits, Location, apply_edits, field_path, validate
from knotwork.task import Task
from knotwork.task.scenario import Scenario, resolve_task

_KINDS: dict[type, tuple[str, str]] = {dict: ("a mapping", ".key"), list: ("a list", "[index]")}
_PATH = re.compile(r"[^.\[\]]+(\.[^.\[\]]+|\[[^\[\]]+\])*")
_PATH_PART = re.compile(r"\[([^\[\]]+)\]|([^.\[\]]+)")


def location_of(path: str, document: Document) -> Location:
    """Find the location of a field path in a document.

    The last key may be missing, since a scenario may leave it out. Items of lists are selected
    by index, waypoints also by name.

    Raises:
        InputError: The path is malformed, or does not exist.

    >>> task = Document({"waypoints": [{"name": "pick", "after": 1}]})
    >>> location_of("waypoints[pick].after", task), location_of("knots", task)
    (('waypoints', 0, 'after'), ('knots',))
    """
    parts = _parts(path)
    data = document.data
    location: Location = ()
    for i, (key, in_brackets) in enumerate(parts):
        part: Any
        last = i + 1 == len(parts)
        if isinstance(data, Mapping) and not in_brackets:
            if key not in data and not last:
                raise _missing_key(path, location, key, data)
            part, data = key, data.get(key)
        elif isinstance(data, list) and in_brackets:
            part = _index(path, location, key, data)
            data = data[part]
        else:
            kind, accepted = _KINDS.get(type(data), ("a single value", "nothing more"))
            key_text = f"[{key}]" if in_brackets else f".{key}"
            raise InputError(
                f"{path}: {_where(location)} is {kind}, which has no {key_text}; accepted: "
                f"{accepted}"
            )
        location = (*location, part)
    return location


def scenario_with(document: Document, edits: Edits) -> Scenario:
    """Resolve the scenario of a document with other values.

    Args:
        document: The document.
        edits: Values by location in the document.

    Raises:
        DocumentError: Some values are wrong.
    """
    return resolve_task(validate(Task, apply_edits(document, edits)), document)


def _parts(path: str) -> list[tuple[str, bool]]:
    """Keys and indices of a path, and whether each is in brackets."""
    if not _PATH.fullmatch(path):
        raise InputError(
            f"{path!r} is not a path of a value; accepted: keys separated by dots and indices in "
            "brackets, for example frames.block.position[0]"
        )
    return [(index or key, bool(index)) for index, key in _PATH_PART.findall(path)]


def _index(path: str, location: Location, key: str, items: list[Any]) -> int:
    if key.isdecimal() and int(key) < len(items):
        return int(key)
    names = [str(item.get("name", "")) if isinstance(item, Mapping) else "" for item in items]
    if key and key in names:
        return names.index(key)
    known = [name for name in names if name]
    if known and not key.lstrip("-").isdecimal():
        raise _missing_key(path, location, key, known)
    accepted = f"; accepted: 0 to {len(items) - 1}" if items else ""
    raise InputError(
        f"{path}: {_where(location)} has {len(items)} items, so [{key}] does not exist{accepted}"
    )


def _missing_key(path: str, location: Location, key: str, known: Any) -> InputError:
    return InputError(f"{path}: {_where(location)} has no {key!r}; {suggest_name(key, known)}")


def _where(location: Location) -> str:
    return field_path(location) or "the scenario"
