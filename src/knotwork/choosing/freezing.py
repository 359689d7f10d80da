"""The text of a scenario with numbers in place of what was free."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from knotwork.choosing.choice import ChosenTimes
from knotwork.documents import Document, Edits, Location, edited, edited_text, read, read_text
from knotwork.documents.edits import block, differences
from knotwork.errors import InputError

PATH_KEYS = frozenset({"file", "mesh", "package_paths", "points", "robot", "srdf", "urdf"})
"""Keys whose text is a path relative to the file, where there is such a file or folder."""


def frozen_text(chosen: ChosenTimes, folder: Path) -> str:
    """YAML of the scenario, with all else as its file has it; made anew where there is no file.

    Args:
        chosen: What was chosen.
        folder: Where the text will be, for the paths in it.

    Raises:
        InputError: The file can't be read any more, or the numbers can't be put into its text.
    """
    return text_with(chosen.document, chosen.edits, folder)


def saved_text(chosen: ChosenTimes, folder: Path) -> str:
    """The same with the scenario's name, which the name of its new file does not say.

    Where the text of the file can't be kept it is made anew, and says so.
    """
    edits = {("name",): chosen.scenario.name, **chosen.edits}
    try:
        return text_with(chosen.document, edits, folder)
    except InputError as error:
        return text_anew(chosen.document, edits, folder, str(error))


def text_with(document: Document, edits: Edits, folder: Path) -> str:
    """YAML of a scenario with other values, to be written into a folder: see `frozen_text`.

    Values of the document that are not those of its file are written, too.
    """
    made = edited(document, _all_edits(document, edits, folder)).data
    if document.file is None:
        return block(made)
    return edited_text(read_text(document.file), differences(read(document.file).data, made))


def text_anew(document: Document, edits: Edits, folder: Path, why: str) -> str:
    """The same without its comments, and why."""
    why = why.replace("\n", " ")
    text = block(edited(document, _all_edits(document, edits, folder)).data)
    return f"# Written anew, without the comments of the file it came from: {why}\n{text}"


def _all_edits(document: Document, edits: Edits, folder: Path) -> dict[Location, Any]:
    if document.file is None:
        return dict(edits)
    moved = _moved(document.data, (), document.file.parent.resolve(), folder.resolve())
    return {**edits, **moved}


def _moved(data: Any, place: Location, old: Path, new: Path) -> dict[Location, Any]:
    """Paths in a file that is in another folder now."""
    if old == new:
        return {}
    if isinstance(data, dict | list):
        parts = data.items() if isinstance(data, dict) else enumerate(data)
        inner = [_moved(value, (*place, key), old, new) for key, value in parts]
        return {location: path for found in inner for location, path in found.items()}
    key = next((part for part in reversed(place) if isinstance(part, str)), "")
    if not isinstance(data, str) or key not in PATH_KEYS:
        return {}
    if Path(data).expanduser().is_absolute() or not (old / data).exists():
        return {}
    if key == "robot" and not (old / data).is_file():
        return {}  # the name of a robot that is shipped
    return {place: Path(os.path.relpath(old / data, new)).as_posix()}
