"""`Exportable`: the `to_…` methods of a trajectory, with the options of the functions they call.

`knotwork.files.export` imports trajectories, so trajectories must not import it. These methods
load it when they are called.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knotwork.errors.old_names import renamed_option

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_EXPORT = f"{__package__.partition('.')[0]}.files.export"


def _exporter(function: str, content: str) -> Callable[..., Any]:
    """Make the method that calls a function of `knotwork.files.export`."""

    def export(self: Exportable, **options: Any) -> Any:
        options = renamed_option(options, "fit", "tolerance")
        return getattr(importlib.import_module(_EXPORT), function)(self, **options)

    export.__name__ = function
    export.__doc__ = f"Return {content}; see `knotwork.files.export.{function}`."
    return export


class Exportable:
    """A motion that can be exported: `save_as` writes every format of `knotwork.files.export`."""

    to_ros2: Callable[..., str] = _exporter("to_ros2", "YAML of a ROS 2 message or action goal")
    to_ros2_message: Callable[..., Any] = _exporter("to_ros2_message", "the ROS 2 message object")
    to_pvt: Callable[..., str] = _exporter("to_pvt", "a position-velocity-time table")
    to_urscript: Callable[..., str] = _exporter("to_urscript", "a program for Universal Robots")
    to_csv: Callable[..., str] = _exporter("to_csv", "samples or knots as CSV")
    to_json: Callable[..., str] = _exporter("to_json", "samples or knots as JSON")
    to_npz: Callable[..., bytes] = _exporter("to_npz", "samples or knots as an npz file")
    to_parquet: Callable[..., bytes] = _exporter("to_parquet", "samples or knots as Parquet")
    to_drake: Callable[..., Any] = _exporter("to_drake", "Drake's `PiecewisePolynomial`")
    to_scipy: Callable[..., PPoly] = _exporter("to_scipy", "SciPy's `PPoly`")
    to_mat: Callable[..., bytes] = _exporter("to_mat", "a MAT-file for MATLAB's `ppval`")

    def save_as(self, name: str, path: Path | str, *, force: bool = False, **options: Any) -> Path:
        """Write the motion to a file in a named format; see `knotwork.files.export.save`."""
        export = importlib.import_module(_EXPORT)
        return Path(export.save(self, name, path, force=force, **options))
