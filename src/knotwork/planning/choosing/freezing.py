"""Text of a scenario file for a task."""

from __future__ import annotations

from pathlib import Path

from knotwork.errors import InputError
from knotwork.files.documents import apply_edits, edited_text, read, read_text
from knotwork.files.documents.document import Document
from knotwork.files.documents.edits import differences, to_block_yaml
from knotwork.task.places import moved_paths
from knotwork.task.scenario import Scenario


def frozen_text(scenario: Scenario, folder: Path) -> str:
    """YAML of a scenario's task: the text of its file with other values, or else a new text.

    Args:
        scenario: The scenario.
        folder: Folder of the new file, for relative paths.

    Raises:
        InputError: The file can't be read any more, or the values can't be written into its text.
    """
    content = _data(scenario, folder)
    if scenario.source is None:
        return to_block_yaml(content)
    file = read(scenario.source)
    return edited_text(read_text(scenario.source), differences(file.data, content))


def saved_text(scenario: Scenario, folder: Path) -> str:
    """Frozen text; new text with a comment if the text of the file can't be kept."""
    try:
        return frozen_text(scenario, folder)
    except InputError as error:
        why = str(error).replace("\n", " ")
        text = to_block_yaml(_data(scenario, folder))
        return f"# Written anew, without the comments of the original file: {why}\n{text}"


def _data(scenario: Scenario, folder: Path) -> dict[str, object]:
    data, source = scenario.given.to_dict(), scenario.source
    source_folder = Path.cwd() if source is None else source.parent
    moved = moved_paths(data, source_folder.resolve(), folder.resolve())
    content: dict[str, object] = apply_edits(Document(data), moved).data
    return content
