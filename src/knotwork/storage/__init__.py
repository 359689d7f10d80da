"""Trajectories, samples and reports to and from files.

Reading needs more than writing does, so it is loaded only when something is read.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from knotwork.storage.writing import samples_to_csv, to_json, trajectory_to_dict, write_files

if TYPE_CHECKING:
    from knotwork.storage.reading import (
        knot_disagreement,
        load_trajectory,
        read_trajectory_document,
        trajectory_from_dict,
    )

__all__ = [
    "knot_disagreement",
    "load_trajectory",
    "read_trajectory_document",
    "samples_to_csv",
    "to_json",
    "trajectory_from_dict",
    "trajectory_to_dict",
    "write_files",
]


def __getattr__(name: str) -> Any:
    """Load what reads files when it is first asked for."""
    if name not in __all__:
        raise AttributeError(f"module 'knotwork.storage' has no attribute {name!r}")
    return getattr(importlib.import_module("knotwork.storage.reading"), name)
