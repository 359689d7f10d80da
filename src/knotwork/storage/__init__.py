"""Trajectories, samples and reports to and from files.

Reading needs more than writing does, so it is loaded only when something is read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names
from knotwork.storage.writing import (
    to_csv,
    to_json,
    trajectory_to_dict,
    write_file,
    write_files,
)

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
    "to_csv",
    "to_json",
    "trajectory_from_dict",
    "trajectory_to_dict",
    "write_file",
    "write_files",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "reading": (
            "knot_disagreement",
            "load_trajectory",
            "read_trajectory_document",
            "trajectory_from_dict",
        )
    },
)
