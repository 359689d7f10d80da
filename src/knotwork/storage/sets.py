"""What ties the files of a plan together: `report.json` says what the others hold."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from knotwork import documents
from knotwork.errors import DocumentError

REPORT = "report.json"


def digests(contents: Mapping[str, str]) -> dict[str, str]:
    """SHA-256 of files by name, as `report.json` states them under `files`."""
    return {name: _digest(content.encode()) for name, content in contents.items()}


def _digest(content: bytes) -> str:
    return f"sha256:{hashlib.sha256(content).hexdigest()}"


def set_disagreement(path: Path) -> str | None:
    """Say that a file is not the one that the report beside it was written with, if it is not.

    Args:
        path: A file, or a folder with a `trajectory.json`.
    """
    path = path / "trajectory.json" if path.is_dir() else path
    try:
        report = json.loads(documents.read_text(path.parent / REPORT))
        stated = report["files"][path.name]
        found = _digest(path.read_bytes())
    except (OSError, ValueError, LookupError, TypeError, RecursionError, DocumentError):
        return None  # there is no report, or it says nothing of the file
    if stated == found:
        return None
    return f"is not the file that {REPORT} beside it was written with: it was changed since"
