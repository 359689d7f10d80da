"""Sources of a task's data, and the paths in it, which are relative to its file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.errors.arguments import require_type
from knotwork.files import documents
from knotwork.files.documents import Document, Location, apply_edits, resources
from knotwork.task.task_part import plain

PATH_KEYS = frozenset(
    {"file", "mesh", "motion", "package_paths", "points", "robot", "scenario", "srdf", "urdf"}
)
"""Keys whose text is a path relative to the file, if the file or folder exists."""


def moved_paths(
    data: Any, old: Path, new: Path | None, place: Location = ()
) -> dict[Location, str]:
    """Relative paths of a file that moves to another folder, by location.

    Args:
        data: Content of the file.
        old: Its old folder.
        new: Its new folder; `None` for absolute paths.
        place: Location of the data in the file.
    """
    if old == new:
        return {}
    if isinstance(data, dict | list):
        parts = data.items() if isinstance(data, dict) else enumerate(data)
        inner = [moved_paths(value, old, new, (*place, key)) for key, value in parts]
        return {location: path for moved in inner for location, path in moved.items()}
    key = next((part for part in reversed(place) if isinstance(part, str)), "")
    if not isinstance(data, str) or key not in PATH_KEYS:
        return {}
    if Path(data).expanduser().is_absolute() or not (old / data).exists():
        return {}
    if key in ("robot", "scenario") and not (old / data).is_file():
        return {}  # the name of a shipped file
    path = old / data if new is None else Path(os.path.relpath(old / data, new))
    return {place: path.as_posix()}


def with_moved_paths(data: Any, old: Path, new: Path | None) -> Any:
    """The content of a file that moves to another folder; see `moved_paths`."""
    return apply_edits(Document(data), moved_paths(data, old.resolve(), new)).data


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
