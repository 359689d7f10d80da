"""`Exportable`: the `to_…` methods of a trajectory, with the options of the functions they call.

`knotwork.files.export` imports trajectories, so trajectories must not import it. These methods
load it when they are called.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from knotwork.errors.old_names import renamed_option

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_EXPORT = f"{__package__.partition('.')[0]}.files.export"


class Exportable:
    """A motion that can be exported: `save_as` writes every format of `knotwork.files.export`."""

    def _export(self, function: str, options: dict[str, Any]) -> Any:
        """Call a function of `knotwork.files.export`."""
        options = renamed_option(options, "fit", "tolerance")
        return getattr(importlib.import_module(_EXPORT), function)(self, **options)

    def to_ros2(self, **options: Any) -> str:
        """Return YAML of a ROS 2 message or action goal; see `knotwork.files.export.to_ros2`."""
        return str(self._export("to_ros2", options))

    def to_ros2_message(self, **options: Any) -> Any:
        """Return the ROS 2 message object; see `knotwork.files.export.to_ros2_message`."""
        return self._export("to_ros2_message", options)

    def to_pvt(self, **options: Any) -> str:
        """Return a position-velocity-time table; see `knotwork.files.export.to_pvt`."""
        return str(self._export("to_pvt", options))

    def to_urscript(self, **options: Any) -> str:
        """Return a program for Universal Robots; see `knotwork.files.export.to_urscript`."""
        return str(self._export("to_urscript", options))

    def to_csv(self, **options: Any) -> str:
        """Return samples or knots as CSV; see `knotwork.files.export.to_csv`."""
        return str(self._export("to_csv", options))

    def to_json(self, **options: Any) -> str:
        """Return samples or knots as JSON; see `knotwork.files.export.to_json`."""
        return str(self._export("to_json", options))

    def to_npz(self, **options: Any) -> bytes:
        """Return samples or knots as an npz file; see `knotwork.files.export.to_npz`."""
        return bytes(self._export("to_npz", options))

    def to_parquet(self, **options: Any) -> bytes:
        """Return samples or knots as Parquet; see `knotwork.files.export.to_parquet`."""
        return bytes(self._export("to_parquet", options))

    def to_drake(self, **options: Any) -> Any:
        """Return Drake's `PiecewisePolynomial`; see `knotwork.files.export.to_drake`."""
        return self._export("to_drake", options)

    def to_scipy(self, **options: Any) -> PPoly:
        """Return SciPy's `PPoly`; see `knotwork.files.export.to_scipy`."""
        return cast("PPoly", self._export("to_scipy", options))

    def to_mat(self, **options: Any) -> bytes:
        """Return a MAT-file for MATLAB's `ppval`; see `knotwork.files.export.to_mat`."""
        return bytes(self._export("to_mat", options))

    def save_as(self, name: str, path: Path | str, *, force: bool = False, **options: Any) -> Path:
        """Write the motion to a file in a named format; see `knotwork.files.export.save`."""
        return Path(self._export("save", {"name": name, "path": path, "force": force, **options}))
