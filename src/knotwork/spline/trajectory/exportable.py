"""`Exportable`: the `to_…` methods of a trajectory, and their options.

`knotwork.export` imports trajectories, so trajectories must not import it. These methods load it
when they are called.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

if TYPE_CHECKING:
    from scipy.interpolate import PPoly
    from typing_extensions import Unpack

_EXPORT = f"{__package__.partition('.')[0]}.export"


class MessageOptions(TypedDict, total=False):
    """Options of ROS 2 messages.

    Attributes:
        goal: Give a goal of `FollowJointTrajectory`. Its field `trajectory` is the message.
        accelerations: Send accelerations as well, so that the controller uses quintics.
        fit: Insert points until the motion is met within this tolerance [rad or m]; by default
            the knots must define it exactly.
    """

    goal: bool
    accelerations: bool
    fit: float | None


class DriveOptions(TypedDict, total=False):
    """Options of position-velocity-time tables.

    A drive's position is scale·q + offset and its velocity scale·q̇, with q in rad, deg or m.

    Attributes:
        degrees: Give revolute joints in deg instead of rad; prismatic ones stay in m.
        scale: Drive units per rad (deg, m) by joint name, not 0; by default 1.
        offset: Position of the drive, in its units, at joint position 0; by default 0.
        incremental: Give the time of each row since the previous row, and not since the start.
        fit: Insert points until the motion is met within this tolerance [rad or m]; by default
            the knots must define it exactly.
    """

    degrees: bool
    scale: Mapping[str, float] | None
    offset: Mapping[str, float] | None
    incremental: bool
    fit: float | None


class ScriptOptions(TypedDict, total=False):
    """Options of programs for controllers.

    Attributes:
        fit: Insert points until the motion is met within this tolerance [rad]; by default the
            knots must define it exactly.
    """

    fit: float | None


class ArmOptions(ScriptOptions, total=False):
    """Options of programs that set the tool, or have external axes.

    Attributes:
        robot: The `knotwork.Robot` with its tool.
    """

    robot: Any


class RobotOptions(TypedDict, total=False):
    """Options of positions that must keep limits of a robot, or define axes in their own way.

    Attributes:
        robot: The `knotwork.Robot`, which `franka` needs.
    """

    robot: Any


class RateOptions(TypedDict, total=False):
    """Options of keyframes.

    Attributes:
        rate: Keyframes per second [Hz], 100 by default. The last one is exactly at the end.
        lead: kv/kp of the position actuators [s], 0 by default. It is the lead time of the
            controls.
    """

    rate: float
    lead: float


class TableOptions(TypedDict, total=False):
    """Options of the sampled formats: CSV, JSON, npz and Parquet.

    Attributes:
        rate: Samples per second [Hz], 100 by default. The last one is exactly at the end, at any
            rate.
        knots_only: Take points that define the whole motion instead of samples.
        accelerations: Include accelerations at these points, for quintics instead of cubics.
        fit: Insert points until the motion is met within this tolerance [rad or m].
        robot: `knotwork.Robot` that gives pose and twist of the tool.
        labels: Include the names of segments and events in each row; by default if there are
            events.
    """

    rate: float | None
    knots_only: bool
    accelerations: bool
    fit: float | None
    robot: Any
    labels: bool | None


class Exportable:
    """A motion that can be exported in every format of `knotwork.export`."""

    def _exported(self, function: str, *arguments: Any, **options: Any) -> Any:
        return getattr(importlib.import_module(_EXPORT), function)(self, *arguments, **options)

    def save_as(self, name: str, path: Path | str, *, force: bool = False, **options: Any) -> Path:
        """Write it to a file in the format of a name; see `knotwork.export.save`."""
        return Path(self._exported("save", name, path, force=force, **options))

    def to_ros2(self, **options: Unpack[MessageOptions]) -> str:
        """Give YAML of a ROS 2 message or action goal; see `knotwork.export.to_ros2`."""
        return str(self._exported("to_ros2", **options))

    def to_ros2_message(self, **options: Unpack[MessageOptions]) -> Any:
        """Give the ROS 2 message object; see `knotwork.export.to_ros2_message`."""
        return self._exported("to_ros2_message", **options)

    def to_pvt(self, **options: Unpack[DriveOptions]) -> str:
        """Give a position-velocity-time table; see `knotwork.export.to_pvt`."""
        return str(self._exported("to_pvt", **options))

    def to_urscript(self, **options: Unpack[ArmOptions]) -> str:
        """Give a program for Universal Robots; see `knotwork.export.to_urscript`."""
        return str(self._exported("to_urscript", **options))

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
