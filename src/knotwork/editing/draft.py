"""A scenario file while it is edited: each edit is one of its text, which keeps comments."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from knotwork import storage
from knotwork.documents import REMOVED, Document, Location, parse, read_text
from knotwork.documents.items import changed_text
from knotwork.errors import InputError

MOST_STEPS = 1000
"""Edits that can be undone."""


class Draft:
    """The text of a scenario file, edits that can be undone, and the file they are saved in.

    Threads may share it.

    Attributes:
        file: The file.
        text: As edited.
        revision: Number of changes of the text so far.
        layout: Number of those after which a part may be at another place.
    """

    def __init__(self, file: Path) -> None:
        """Read a file.

        Raises:
            DocumentError: It can't be read.
        """
        self.file, self.revision, self.layout = file, 0, 0
        self.text = self._disk = read_text(file)
        self._past: list[str] = []
        self._future: list[str] = []
        self._gesture = ""
        self._lock = threading.RLock()

    def document(self) -> Document:
        """The data of the text, and where it stands in it.

        Raises:
            DocumentError: The text is not YAML.
        """
        return parse(self.text, self.file)

    def state(self) -> dict[str, Any]:
        """What a page shows of it, as plain data."""
        with self._lock:
            try:
                data = _finite(self.document().data)
            except InputError:
                data = None
            return {
                "revision": self.revision,
                "file": self.file.name,
                "data": data,
                "undo": bool(self._past),
                "redo": bool(self._future),
                "unsaved": self.text != self._disk,
            }

    def apply(self, changes: Sequence[Mapping[str, Any]], gesture: str = "") -> None:
        """Change the text, all or nothing.

        Args:
            changes: Each `{"at": location}` with a `"value"`, or without one to take it out;
                `"insert"` is true for an item that is put into a list.
            gesture: Edits of one, such as a drag, are undone together.

        Raises:
            InputError: A change can't be written into the text.
        """
        with self._lock:
            text = self.text
            for one in changes:
                value = one.get("value", REMOVED)
                at, insert = _location(one), bool(one.get("insert"))
                text = changed_text(text, at, value, insert=insert)
                self.layout += value is REMOVED or insert or len(at) == 1
            self._put(text, gesture)

    def undo(self) -> None:
        """Take back the last edit, if there is one."""
        self._swap(self._past, self._future)

    def redo(self) -> None:
        """Make the edit again that was taken back last, if there is one."""
        self._swap(self._future, self._past)

    def reread(self) -> bool:
        """Read the file again; what another program wrote is an edit. Whether there was one.

        Raises:
            DocumentError: It can't be read.
        """
        with self._lock:
            text = read_text(self.file)
            changed = text != self._disk
            if changed:
                self._disk = text
                self.layout += 1
                self._put(text)
            return changed

    def save(self) -> None:
        """Write the text into the file, whole or not at all.

        Raises:
            InputError: It can't be written, or another program has changed the file: then its
                text is taken over, and `undo` leads back to this one.
        """
        with self._lock:
            if self.file.exists() and self.reread():
                raise InputError(
                    f"{self.file} was changed by another program and is not overwritten; what it "
                    "wrote is shown, and undo returns to your edits"
                )
            ends = b"\r\n" if self.file.exists() and b"\r\n" in self.file.read_bytes() else b"\n"
            text = self.text.encode().replace(b"\n", ends)
            storage.write_file(self.file.resolve(), text, what="a scenario")
            self._disk, self._gesture = self.text, ""

    def _put(self, text: str, gesture: str = "") -> None:
        if text == self.text:
            return
        if not gesture or gesture != self._gesture:
            self._past = [*self._past[-MOST_STEPS:], self.text]
        self._future.clear()
        self._gesture = gesture
        self.text = text
        self.revision += 1

    def _swap(self, taken: list[str], kept: list[str]) -> None:
        with self._lock:
            if taken:
                kept.append(self.text)
                self.text = taken.pop()
                self._gesture = ""
                self.layout += 1
                self.revision += 1


def _location(change: Mapping[str, Any]) -> Location:
    given = change.get("at")
    fine = isinstance(given, list | tuple) and given and all(type(k) in (str, int) for k in given)
    if not fine:
        raise InputError(f"an edit is at {given!r}; accepted: a list of keys and indices")
    return tuple(given or ())


def _finite(data: Any) -> Any:
    """Data as JSON has it, which knows no infinite numbers."""
    if isinstance(data, dict):
        return {str(key): _finite(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_finite(value) for value in data]
    return str(data) if isinstance(data, float) and not math.isfinite(data) else data
