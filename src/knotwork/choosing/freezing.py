"""The text of a scenario with numbers in place of what was free."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from knotwork.choosing.choice import ChosenTimes
from knotwork.documents import Document, Edits, Location, edited, edited_text, read, read_text
from knotwork.documents.edits import block, differences
from knotwork.errors import InputError
from knotwork.task.places import moved_paths


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
    moved = moved_paths(document.data, document.file.parent.resolve(), folder.resolve())
    return {**edits, **moved}
