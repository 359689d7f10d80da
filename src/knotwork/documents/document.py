"""Plain data, with the place in the file where each part stands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from knotwork.errors import DocumentError, Problem

Location = tuple[str | int, ...]


@dataclass(frozen=True)
class Document:
    """Plain data, and where in the file each part of it stands.

    Attributes:
        data: Mappings, lists, text, numbers, booleans and `None`.
        file: The file it came from, or `None`.
        lines: Line, counted from 1, of each location that is not in the line of the part around
            it.
        prefix: Location of the data in the file.
    """

    data: Any
    file: Path | None = None
    lines: Mapping[Location, int] = field(default_factory=dict)
    prefix: Location = ()

    def part(self, location: Location) -> Document:
        """Take a part as a document of its own that still knows where in the file it stands."""
        data = self.data
        for key in location:
            data = data[key]
        size = len(location)
        lines = {key[size:]: line for key, line in self.lines.items() if key[:size] == location}
        line = self.line(location)
        if line is not None:
            lines.setdefault((), line)
        return Document(data, self.file, lines, self.prefix + location)

    def path(self, location: Location) -> str:
        """Field path of a location in the whole file."""
        return field_path(self.prefix + location)

    def line(self, location: Location) -> int | None:
        """Line of a location, or of the nearest part around it that has one."""
        while location and location not in self.lines:
            location = location[:-1]
        return self.lines.get(location)

    def where(self, location: Location) -> str:
        """Say where a location is, for example `task.yaml: line 12: waypoints[2].time`."""
        line = self.line(location)
        file = str(self.file) if self.file is not None else ""
        place = f"line {line}" if line is not None else ""
        return ": ".join(part for part in (file, place, self.path(location)) if part)

    def error(self, location: Location, message: str, accepted: str = "") -> DocumentError:
        """Make the error for one problem at a location."""
        problem = Problem(self.line(location), self.path(location), message, accepted)
        return DocumentError(self.file, [problem])


def field_path(location: Iterable[str | int]) -> str:
    """Write a location as a field path, for example `waypoints[2].time`."""
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else str(part)
    return path
