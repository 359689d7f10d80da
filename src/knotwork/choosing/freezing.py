"""The text of a scenario with numbers in place of what was free."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from knotwork.choosing.choice import ChosenTimes
from knotwork.documents import Location, edited, edited_text, read_text
from knotwork.documents.edits import block


def frozen_text(chosen: ChosenTimes, folder: Path, *, comments: bool = True) -> str:
    """YAML of the scenario, with all else as its file has it; made anew where there is no file.

    Args:
        chosen: What was chosen.
        folder: Where the text will be, for the paths in it.
        comments: Keep the text of the file as it is but for the numbers; else it is made anew.

    Raises:
        InputError: The file can't be read any more, or the numbers can't be put into its text.
    """
    document = chosen.document
    if document.file is None:
        return block(edited(document, chosen.edits).data)
    moved = _moved(document.data, document.file.parent.resolve(), folder.resolve())
    if not comments:
        return block(edited(document, {**chosen.edits, **moved}).data)
    return edited_text(read_text(document.file), {**chosen.edits, **moved})


def _moved(data: Any, old: Path, new: Path) -> dict[Location, Any]:
    """Paths in a file that is in another folder now."""
    if old == new:
        return {}
    edits: dict[Location, Any] = {}

    def move(place: Location, value: Any) -> None:
        if isinstance(value, str) and not Path(value).is_absolute() and (old / value).is_file():
            edits[place] = Path(os.path.relpath(old / value, new)).as_posix()

    robot = data.get("robot")
    move(("robot",), robot)
    if isinstance(robot, dict):
        move(("robot", "urdf"), robot.get("urdf"))
    for i, waypoint in enumerate(data["waypoints"]):
        along = waypoint.get("along")
        if isinstance(along, dict):
            move(("waypoints", i, "along", "points"), along.get("points"))
    return edits
