"""The draft of a scenario file: edits of its text, which keep comments, with undo."""

from __future__ import annotations

import codecs
import hashlib
import json
import math
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.files import storage
from knotwork.files.documents import REMOVED, Document, Location, parse, read_text
from knotwork.files.documents.edits import with_change
from knotwork.robot import Robot
from knotwork.task.si_units import unit_at

MAX_EDITS = 1000
"""Maximum number of edits that can be undone."""


class Draft:
    """The text of a scenario file, edits with undo, and the file itself.

    Thread-safe.

    Attributes:
        file: The file.
        revision: Number of changes so far.
    """

    def __init__(self, file: Path) -> None:
        """Read a file.

        Raises:
            DocumentError: The file can't be read.
        """
        self.file, self.revision = file, 0
        self._disk = read_text(file)
        self._texts, self._index = [self._disk], 0
        self._gesture = ""
        self._lock = threading.RLock()

    @property
    def text(self) -> str:
        """The edited text."""
        return self._texts[self._index]

    def document(self) -> Document:
        """The data of the text, with locations.

        Raises:
            DocumentError: The text is not YAML.
        """
        return _parse(self.text, self.file)

    def state(self) -> dict[str, Any]:
        """State for a page, as plain data."""
        with self._lock:
            try:
                data = self.document().data
            except InputError:
                data = None
            return {
                "revision": self.revision,
                "file": self.file.name,
                "data": _with_leaves(data, _finite),
                "structure": structure_digest(data),
                "undo": self._index > 0,
                "redo": self._index + 1 < len(self._texts),
                "unsaved": self.text != self._disk,
            }

    def apply(self, changes: Sequence[Mapping[str, Any]], gesture: str = "") -> None:
        """Change the text, all or nothing.

        Args:
            changes: Mappings with a location `"at"` and a `"value"`; without a value, the location
                is removed. `"insert"` is true to insert an item into a list.
            gesture: Edits of one gesture, such as a drag, are undone together.

        Raises:
            InputError: A change can't be written into the text.
        """
        with self._lock:
            text = self.text
            for change in changes:
                value, insert = change.get("value", REMOVED), bool(change.get("insert"))
                text = with_change(text, _location(change), value, insert=insert)
            self._set_text(text, gesture)

    def undo(self) -> None:
        """Undo the last edit, if there is one."""
        self._go_to(self._index - 1)

    def redo(self) -> None:
        """Redo the last undone edit, if there is one."""
        self._go_to(self._index + 1)

    def reread(self) -> bool:
        """Read the file again, and return whether it has changed; the change becomes an edit.

        Raises:
            DocumentError: The file can't be read.
        """
        with self._lock:
            text = read_text(self.file)
            changed = text != self._disk
            if changed:
                self._disk = text
                self._set_text(text)
            return changed

    def save(self) -> None:
        """Write the text into the file, whole or not at all.

        Raises:
            InputError: The file can't be written, or another program has changed it. In that case
                its text becomes the draft, and `undo` restores the previous one.
        """
        with self._lock:
            if self.file.exists() and self.reread():
                raise InputError(
                    f"{self.file} was changed by another program and is not overwritten; the new "
                    "text is shown, and undo returns to your edits"
                )
            old = self.file.read_bytes() if self.file.exists() else b""
            mark = codecs.BOM_UTF8 if old.startswith(codecs.BOM_UTF8) else b""
            ends = b"\r\n" if b"\r\n" in old else b"\n"
            text = mark + self.text.encode().replace(b"\n", ends)
            storage.write_file(self.file.resolve(), text, kind="a scenario")
            self._disk, self._gesture = self.text, ""

    def _set_text(self, text: str, gesture: str = "") -> None:
        if text == self.text:
            return
        same_gesture = bool(gesture) and gesture == self._gesture
        past = self._texts[: self._index + (0 if same_gesture else 1)]
        self._texts = [*past[-MAX_EDITS:], text]
        self._go_to(len(self._texts) - 1)
        self._gesture = gesture

    def _go_to(self, index: int) -> None:
        """Make one of the texts the present one, if the index is valid."""
        with self._lock:
            if 0 <= index < len(self._texts):
                self._index, self._gesture = index, ""
                self.revision += 1


@lru_cache(maxsize=4)
def _parse(text: str, file: Path) -> Document:
    """The parsed text, cached, as it is used several times for each edit."""
    return parse(text, file)


def structure_digest(data: Any) -> str:
    """A short digest of a text's structure, without its numbers.

    Names and locations in one text are valid in any other with the same structure.
    """
    words = json.dumps(_with_leaves(data, _numberless), default=str)
    return hashlib.sha256(words.encode()).hexdigest()[:16]


def unit_by_location(data: Any, robot: Robot | None) -> dict[str, str]:
    """The units of the values of a file, by `location_key`."""
    joints = {} if robot is None else dict(zip(robot.joint_names, robot.joint_units, strict=True))
    located_units = ((at, unit_at(data, at, joints)) for at in _locations(data))
    return {location_key(at): unit for at, unit in located_units if unit}


def location_key(at: Location) -> str:
    """A location as a page writes it, as JSON."""
    return json.dumps(at, separators=(",", ":"), ensure_ascii=False)


def _locations(data: Any, at: Location = ()) -> Iterator[Location]:
    """Locations of all values of a file, including mappings, lists and their items."""
    parts = data.items() if isinstance(data, dict) else enumerate(data)
    for key, part in parts:
        yield (*at, key)
        if isinstance(part, dict | list):
            yield from _locations(part, (*at, key))


def _with_leaves(data: Any, change: Callable[[Any], Any]) -> Any:
    """Copy data with each number, text and other single value changed by a function."""
    if isinstance(data, dict):
        return {str(key): _with_leaves(value, change) for key, value in data.items()}
    if isinstance(data, list):
        return [_with_leaves(value, change) for value in data]
    return change(data)


def _numberless(value: Any) -> Any:
    return 0 if isinstance(value, float) or type(value) is int else value


def _location(change: Mapping[str, Any]) -> Location:
    at = change.get("at")
    is_valid = isinstance(at, list | tuple) and at and all(type(key) in (str, int) for key in at)
    if not is_valid:
        raise InputError(f"an edit is at {at!r}; accepted: a list of keys and indices")
    return tuple(at or ())


def _finite(value: Any) -> Any:
    """A value for JSON, which has no infinite numbers."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
