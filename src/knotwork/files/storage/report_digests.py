"""Consistency of a plan's files: `report.json` states the digests of the others."""

from __future__ import annotations

import hashlib
import json
import os
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


def changed_since_report(path: Path) -> str | None:
    """Describe a file that was changed since the report in its folder; `None` if it was not.

    >>> paths = kw.plan("paper_case").save("motion")
    >>> changed_since_report(Path("motion")) is None
    True
    >>> characters = Path("motion/trajectory.json").write_text("{}")
    >>> changed_since_report(Path("motion"))
    'was changed after report.json next to it was written'

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
    return f"was changed after {REPORT} next to it was written"


def stated_scenario(plan: Path) -> tuple[str | None, str]:
    """Find the scenario of a saved plan, which the report in its folder states.

    Args:
        plan: The folder of the plan, or a file in it.

    Returns:
        A shipped name or a path, or `None`; and a note if the stated file does not exist.
    """
    folder = plan if plan.is_dir() else plan.parent
    try:
        stated = str(_read_report(folder)["scenario_file"] or "")
    except (LookupError, TypeError):
        stated = ""
    if not stated or stated in documents.resources.names("scenarios"):
        return stated or None, ""
    file = folder / stated
    if not file.is_file():
        return None, f"{plan} is a plan of {file}, which does not exist"
    return os.path.relpath(file), ""


def _read_report(folder: Path) -> Any:
    """Read the report in a folder; `None` without a readable one."""
    try:
        return json.loads(documents.read_text(folder / REPORT))
    except (OSError, ValueError, RecursionError, DocumentError):
        return None
