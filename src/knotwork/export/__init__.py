"""Trajectories for whatever runs them: one module a format, loaded when it is asked for.

from knotwork.export import save, to_ros2

text = to_ros2(plan.trajectory, goal=True)
save(plan.trajectory, "pvt", "axis_table.csv", degrees=True)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.export.drake import to_drake
    from knotwork.export.formats import checked_target, content, export, save, write
    from knotwork.export.lossless import Points, motion_points
    from knotwork.export.mat import to_mat
    from knotwork.export.pvt import to_pvt
    from knotwork.export.registry import (
        FORMATS,
        Format,
        checked_options,
        file_format,
        get_format,
    )
    from knotwork.export.ros2 import ros2_dict, to_ros2, to_ros2_message
    from knotwork.export.samples import to_csv, to_json, to_npz, to_parquet
    from knotwork.export.scipy_ppoly import to_scipy, to_scipy_npz
    from knotwork.export.table import MotionTable, motion_table

__all__ = [
    "FORMATS",
    "Format",
    "MotionTable",
    "Points",
    "checked_options",
    "checked_target",
    "content",
    "export",
    "file_format",
    "get_format",
    "motion_points",
    "motion_table",
    "ros2_dict",
    "save",
    "to_csv",
    "to_drake",
    "to_json",
    "to_mat",
    "to_npz",
    "to_parquet",
    "to_pvt",
    "to_ros2",
    "to_ros2_message",
    "to_scipy",
    "to_scipy_npz",
    "write",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "drake": ("to_drake",),
        "formats": ("checked_target", "content", "export", "save", "write"),
        "lossless": ("Points", "motion_points"),
        "mat": ("to_mat",),
        "pvt": ("to_pvt",),
        "registry": ("FORMATS", "Format", "checked_options", "file_format", "get_format"),
        "ros2": ("ros2_dict", "to_ros2", "to_ros2_message"),
        "samples": ("to_csv", "to_json", "to_npz", "to_parquet"),
        "scipy_ppoly": ("to_scipy", "to_scipy_npz"),
        "table": ("MotionTable", "motion_table"),
    },
)
