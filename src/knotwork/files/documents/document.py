"""`Document`: plain data, with the location of each part in its file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from knotwork.errors import DocumentError, InputError, Problem, suggest_name

Location = tuple[str | int, ...]


@dataclass(frozen=True, kw_only=True)
class Locations:
    """Location of each part of the data in its file, for messages.

    Attributes:
        file: The file, or `None`.
        lines: Line, counted from 1, of each location in the file that does not share the line of
            the enclosing part.
        prefix: Location of the data in the whole data; empty if they are all of it.
        origins: Location in the file by location in the whole data, where the two differ.
    """

    file: Path | None = None
    lines: Mapping[Location, int] = field(default_factory=dict, repr=False)
    prefix: Location = ()
    origins: Mapping[Location, Location] = field(default_factory=dict, repr=False)

    def in_file(self, location: Location) -> Location:
        """Location in the file of a location in the data."""
        location = self.prefix + location
        for size in range(len(location), 0, -1) if self.origins else ():
            if (origin := self.origins.get(location[:size])) is not None:
                return origin + location[size:]
        return location

    def path(self, location: Location) -> str:
        """Field path of a location in the whole file."""
        return field_path(self.in_file(location))

    def line(self, location: Location) -> int | None:
        """Line of a location, or of the innermost enclosing part that has one."""
        location = self.in_file(location)
        while location and location not in self.lines:
            location = location[:-1]
        return self.lines.get(location)

    def where(self, location: Location) -> str:
        """Describe a location, for example `task.yaml: line 12: waypoints[2].time`."""
        line = self.line(location)
        file = str(self.file) if self.file is not None else ""
        in_file = f"line {line}" if line is not None else ""
        return ": ".join(part for part in (file, in_file, self.path(location)) if part)

    def error(self, location: Location, message: str, accepted: str = "") -> DocumentError:
        """Make the error for one problem at a location."""
        problem = Problem(self.line(location), self.path(location), message, accepted)
        return DocumentError(self.file, [problem])

    def check_name(
        self, location: Location, kind: str, name: str, available: Iterable[str]
    ) -> None:
        """Refuse an unknown name at a location.

        Raises:
            DocumentError: The name is not available.
        """
        available = list(available)
        if name not in available:
            raise self.error(location, f"unknown {kind} {name!r}; {suggest_name(name, available)}")

    @contextmanager
    def errors_at(self, *location: str | int) -> Iterator[None]:
        """Locate errors of the input that are raised inside, unless they are problems of a file.

        Args:
            location: Keys and indices of the value at fault, for example `"tool", "frame"`.
        """
        try:
            yield
        except InputError as error:
            if not isinstance(error, DocumentError):
                error.locate(self.where(location))
            raise

    def named_file(self, name: str, location: Location) -> Path:
        """Path of another file, whose name at a location is relative to the folder of this one.

        Raises:
            DocumentError: The file does not exist.
        """
        path = (self.file.parent if self.file is not None else Path()) / Path(name).expanduser()
        if not path.is_file():
            fault = f"{path} is not a regular file" if path.exists() else f"there is no file {path}"
            raise self.error(location, fault)
        return path

    def document(self, data: Any, location: Location) -> Document:
        """Make data at a location a document, with locations in the same file."""
        prefix = self.prefix + location
        return Document(data, file=self.file, lines=self.lines, prefix=prefix, origins=self.origins)


@dataclass(frozen=True)
class Document(Locations):
    """Plain data, and the location of each part in its file.

    Attributes:
        data: Mappings, lists, text, numbers, booleans and `None`.
    """

    data: Any

    def part(self, location: Location) -> Document:
        """Make a part a document, with locations in the same file."""
        data = self.data
        for key in location:
            data = data[key]
        return self.document(data, location)


def field_path(location: Iterable[str | int]) -> str:
    """Write a location as a field path, for example `waypoints[2].time`."""
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else str(part)
    return path
