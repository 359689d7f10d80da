"""Consistency of a plan's files: `report.json` states the digests of the others."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knotwork.errors import DocumentError
from knotwork.files import documents

REPORT = "report.json"


def digests(contents: Mapping[str, str]) -> dict[str, str]:
    """SHA-256 of the contents of files by name, as `report.json` has them under `files`.

    >>> digests({"trajectory.json": "{}"})["trajectory.json"][:15]
    'sha256:44136fa3'
    """
    return {name: _digest(content.encode()) for name, content in contents.items()}


def _digest(content: bytes) -> str:
    return f"sha256:{hashlib.sha256(content).hexdigest()}"


def set_disagreement(path: Path) -> str | None:
    """Describe a file that was changed since the report in its folder; `None` if it was not.

    >>> paths = kw.plan("paper_case").save("motion")
    >>> set_disagreement(Path("motion")) is None
    True
    >>> characters = Path("motion/trajectory.json").write_text("{}")
    >>> set_disagreement(Path("motion"))
    'is not the file that report.json next to it was written with: it was changed since'

    Args:
        path: A file, or a folder with a `trajectory.json`.
    """
    path = path / "trajectory.json" if path.is_dir() else path
    try:
        stated = _read_report(path.parent)["files"][path.name]
        actual = _digest(path.read_bytes())
    except (OSError, LookupError, TypeError):
        return None  # there is no report of this file
    if stated == actual:
        return None
    return f"is not the file that {REPORT} next to it was written with: it was changed since"


def stated_scenario(path: Path) -> str | None:
    """Name or path of the scenario, from the report in the folder of a plan; or `None`.

    Args:
        path: A trajectory, or a folder with a `trajectory.json`.
    """
    try:
        stated = _read_report(path if path.is_dir() else path.parent)["scenario_file"]
    except (LookupError, TypeError):
        return None
    return stated if isinstance(stated, str) else None


def _read_report(folder: Path) -> Any:
    """Read the report in a folder; `None` without a readable one."""
    try:
        return json.loads(documents.read_text(folder / REPORT))
    except (OSError, ValueError, RecursionError, DocumentError):
        return None
