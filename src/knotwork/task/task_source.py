"""Sources of a task's data, and the paths in it, which are relative to its file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from knotwork.errors import InputError
from knotwork.errors.arguments import require_type
from knotwork.files import documents
from knotwork.files.documents import Document, Location, apply_edits, field_at, resources
from knotwork.files.documents.values import is_marked
from knotwork.task.task_part import plain

ROBOT_PATHS = frozenset({"package_paths", "srdf", "urdf"})
"""Keys for paths in a robot that is described in place, whose model is not a part of the task."""


def moved_paths(
    model: type[BaseModel], data: Any, old: Path, new: Path | None
) -> dict[Location, str]:
    """Paths of a file that moves to another folder, if a file or folder exists there, by location.

    Args:
        model: Model of the file, which marks its paths.
        data: Content of the file.
        old: Its old folder.
        new: Its new folder; `None` for absolute paths.
    """
    if old == new:
        return {}
    moved: dict[Location, str] = {}
    for location, text in texts_in(data):
        path = old / text
        if not os.path.exists(path) or os.path.isabs(text):
            continue
        if not is_marked(field_at(model, data, location), "path"):
            continue
        if location[0] == "robot" and location[1:] and ROBOT_PATHS.isdisjoint(location):
            continue
        if location[-1] in ("robot", "scenario") and not path.is_file():
            continue  # the name of a shipped file
        moved[location] = (path if new is None else Path(os.path.relpath(path, new))).as_posix()
    return moved


def texts_in(data: Any, location: Location = ()) -> Iterator[tuple[Location, str]]:
    """All texts of a file's content, with their locations."""
    if isinstance(data, str):
        yield location, data
    elif isinstance(data, Mapping | list | tuple):
        for key, value in data.items() if isinstance(data, Mapping) else enumerate(data):
            yield from texts_in(value, (*location, key))


def with_moved_paths(model: type[BaseModel], data: Any, old: Path, new: Path | None) -> Any:
    """The content of a file that moves to another folder; see `moved_paths`."""
    return apply_edits(Document(data), moved_paths(model, data, old.resolve(), new)).data


def read_document(reference: str | Path | Mapping[str, Any]) -> Document:
    """The data of a task: a shipped scenario by name, a file by path, or a mapping.

    Raises:
        InputError: The file is missing, can't be read, or describes a robot; or the reference has
            another type.
    """
    if isinstance(reference, Mapping):
        return Document(plain(reference))
    accepted = "a shipped name, the path of a file, a mapping or a Task"
    require_type(reference, str | Path, "scenario", accepted)
    path = resources.find("scenarios", reference)
    if path.suffix.lower() in (".urdf", ".xacro", ".sdf"):
        raise InputError(
            f"{path} is a robot, not a scenario; give a scenario, a YAML file that names its robot "
            "with the key robot"
        )
    return documents.read(path)
