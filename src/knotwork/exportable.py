"""`Exportable`: the `to_…` methods of a trajectory.

What writes the formats knows trajectories, so trajectories must not know it. When one of these
methods is called, it asks the package itself for `knotwork.export`, and hands it the trajectory;
nothing is loaded before.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

if TYPE_CHECKING:
    from scipy.interpolate import PPoly
    from typing_extensions import Unpack

_EXPORT = f"{__package__}.export"


class TableOptions(TypedDict, total=False):
    """Options of the sampled formats: CSV, JSON, npz and Parquet.

    Attributes:
        rate: Samples a second [Hz], 100 by default; the last one is at the end exactly, whatever
            the rate.
        knots_only: Take points that carry the whole motion instead of samples.
        accelerations: These points carry accelerations too, for quintics instead of cubics.
        fit: Insert points until the motion is met within this tolerance [rad or m].
        robot: `knotwork.Robot` that gives pose and twist of the tool.
    """

    rate: float | None
    knots_only: bool
    accelerations: bool
    fit: float | None
    robot: Any


class Exportable:
    """A motion that can be handed over in every format of `knotwork.export`."""

    def _exported(self, function: str, *arguments: Any, **options: Any) -> Any:
        return getattr(importlib.import_module(_EXPORT), function)(self, *arguments, **options)

    def save_as(self, name: str, path: Path | str, *, force: bool = False, **options: Any) -> Path:
        """Write it to a file in the format of a name; see `knotwork.export.save`."""
        path = self._exported("save", name, path, force=force, **options)
        return Path(path)

    def to_ros2(
        self, *, goal: bool = False, accelerations: bool = False, fit: float | None = None
    ) -> str:
        """Give YAML of a ROS 2 message or action goal; see `knotwork.export.to_ros2`."""
        return str(self._exported("to_ros2", goal=goal, accelerations=accelerations, fit=fit))

    def to_ros2_message(
        self, *, goal: bool = False, accelerations: bool = False, fit: float | None = None
    ) -> Any:
        """Give the ROS 2 message object; see `knotwork.export.to_ros2_message`."""
        return self._exported("to_ros2_message", goal=goal, accelerations=accelerations, fit=fit)

    def to_pvt(
        self,
        *,
        degrees: bool = False,
        scale: Mapping[str, float] | None = None,
        offset: Mapping[str, float] | None = None,
        incremental: bool = False,
        fit: float | None = None,
    ) -> str:
        """Give a position-velocity-time table; see `knotwork.export.to_pvt`."""
        return str(
            self._exported(
                "to_pvt",
                degrees=degrees,
                scale=scale,
                offset=offset,
                incremental=incremental,
                fit=fit,
            )
        )

    def to_csv(self, **options: Unpack[TableOptions]) -> str:
        """Give samples or knots as CSV; see `knotwork.export.to_csv`."""
        return str(self._exported("to_csv", **options))

    def to_json(self, **options: Unpack[TableOptions]) -> str:
        """Give samples or knots as JSON; see `knotwork.export.to_json`."""
        return str(self._exported("to_json", **options))

    def to_npz(self, **options: Unpack[TableOptions]) -> bytes:
        """Give samples or knots as an npz file; see `knotwork.export.to_npz`."""
        return bytes(self._exported("to_npz", **options))

    def to_parquet(self, **options: Unpack[TableOptions]) -> bytes:
        """Give samples or knots as a Parquet file; see `knotwork.export.to_parquet`."""
        return bytes(self._exported("to_parquet", **options))

    def to_drake(self) -> Any:
        """Give Drake's `PiecewisePolynomial`; see `knotwork.export.to_drake`."""
        return self._exported("to_drake")

    def to_scipy(self) -> PPoly:
        """Give SciPy's `PPoly`; see `knotwork.export.to_scipy`."""
        return self._exported("to_scipy")

    def to_mat(self) -> bytes:
        """Give a MAT-file for MATLAB's `ppval`; see `knotwork.export.to_mat`."""
        return bytes(self._exported("to_mat"))
