"""`Exportable`: the `to_…` methods of a trajectory, and the options of each.

`knotwork.files.export` imports trajectories, so trajectories must not import it. These methods
load it when they are called.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, cast

if TYPE_CHECKING:
    from scipy.interpolate import PPoly
    from typing_extensions import Unpack


class MessageOptions(TypedDict, total=False):
    """Options of ROS 2 messages, as of `knotwork.files.export.ros2_dict`."""

    goal: bool
    accelerations: bool
    tolerance: float | None


class DriveOptions(TypedDict, total=False):
    """Options of tables for drives, as of `knotwork.files.export.to_pvt`."""

    degrees: bool
    scale: Mapping[str, float] | None
    offset: Mapping[str, float] | None
    incremental: bool
    tolerance: float | None


class ProgramOptions(TypedDict, total=False):
    """Options of programs, as of `knotwork.files.export.to_urscript`."""

    tolerance: float | None
    robot: Any


class TableOptions(TypedDict, total=False):
    """Options of samples and knots, as of `knotwork.files.export.motion_table`."""

    rate: float | None
    knots_only: bool
    accelerations: bool
    tolerance: float | None
    robot: Any
    labels: bool | None


def _export_package() -> Any:
    return importlib.import_module("knotwork.files.export")


class Exportable:
    """A motion that can be exported: `save_as` writes every format of `knotwork.files.export`."""

    def _content(self, name: str, options: Mapping[str, Any]) -> Any:
        return _export_package().content(self, name, **options)

    def to_ros2(self, **options: Unpack[MessageOptions]) -> str:
        """Return YAML of a ROS 2 message or action goal; see `knotwork.files.export.to_ros2`.

        Options: `goal`, `accelerations`, `tolerance` [rad or m].
        """
        return str(self._content("ros2", options))

    def to_ros2_message(self, **options: Unpack[MessageOptions]) -> Any:
        """Return the ROS 2 message object; see `knotwork.files.export.to_ros2_message`.

        Options: `goal`, `accelerations`, `tolerance` [rad or m].
        """
        export = _export_package()
        checked = export.checked_options(export.get_format("ros2"), options)
        return export.to_ros2_message(self, **checked)

    def to_pvt(self, **options: Unpack[DriveOptions]) -> str:
        """Return a position-velocity-time table; see `knotwork.files.export.to_pvt`.

        Options: `degrees`, `scale`, `offset`, `incremental`, `tolerance` [rad or m].
        """
        return str(self._content("pvt", options))

    def to_urscript(self, **options: Unpack[ProgramOptions]) -> str:
        """Return a program for Universal Robots; see `knotwork.files.export.to_urscript`.

        Options: `tolerance` [rad or m], `robot`.
        """
        return str(self._content("urscript", options))

    def to_csv(self, **options: Unpack[TableOptions]) -> str:
        """Return samples or knots as CSV; see `knotwork.files.export.to_csv`.

        Options: `rate` [Hz], `knots_only`, `accelerations`, `tolerance` [rad or m], `robot`,
        `labels`.
        """
        return str(self._content("csv", options))

    def to_json(self, **options: Unpack[TableOptions]) -> str:
        """Return samples or knots as JSON; see `knotwork.files.export.to_json`.

        Options: those of `to_csv`.
        """
        return str(self._content("json", options))

    def to_npz(self, **options: Unpack[TableOptions]) -> bytes:
        """Return samples or knots as an npz file; see `knotwork.files.export.to_npz`.

        Options: those of `to_csv`.
        """
        return bytes(self._content("npz", options))

    def to_parquet(self, **options: Unpack[TableOptions]) -> bytes:
        """Return samples or knots as Parquet; see `knotwork.files.export.to_parquet`.

        Options: those of `to_csv`.
        """
        return bytes(self._content("parquet", options))

    def to_drake(self) -> Any:
        """Return Drake's `PiecewisePolynomial`; see `knotwork.files.export.to_drake`."""
        return _export_package().to_drake(self)

    def to_scipy(self) -> PPoly:
        """Return SciPy's `PPoly`; see `knotwork.files.export.to_scipy`."""
        return cast("PPoly", _export_package().to_scipy(self))

    def to_mat(self) -> bytes:
        """Return a MAT-file for MATLAB's `ppval`; see `knotwork.files.export.to_mat`."""
        return bytes(self._content("mat", {}))

    def save_as(self, name: str, path: Path | str, *, force: bool = False, **options: Any) -> Path:
        """Write the motion to a file in a named format; see `knotwork.files.export.save`."""
        export = _export_package()
        return Path(export.save(self, name, path, force=force, **options))
