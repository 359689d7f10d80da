"""Trajectories for whatever runs them: one module a family of formats, loaded when asked for.

from knotwork.export import save, to_ros2

text = to_ros2(plan.trajectory, goal=True)
save(plan.trajectory, "pvt", "axis_table.csv", degrees=True)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.export.formats import checked_target as checked_target
    from knotwork.export.formats import content as content
    from knotwork.export.formats import export as export
    from knotwork.export.formats import save as save
    from knotwork.export.formats import write as write
    from knotwork.export.lossless import Points as Points
    from knotwork.export.lossless import motion_points as motion_points
    from knotwork.export.polynomials import to_drake as to_drake
    from knotwork.export.polynomials import to_mat as to_mat
    from knotwork.export.polynomials import to_scipy as to_scipy
    from knotwork.export.polynomials import to_scipy_npz as to_scipy_npz
    from knotwork.export.pvt import to_pvt as to_pvt
    from knotwork.export.registry import FORMATS as FORMATS
    from knotwork.export.registry import Format as Format
    from knotwork.export.registry import checked_options as checked_options
    from knotwork.export.registry import file_format as file_format
    from knotwork.export.registry import get_format as get_format
    from knotwork.export.ros2 import ros2_dict as ros2_dict
    from knotwork.export.ros2 import to_ros2 as to_ros2
    from knotwork.export.ros2 import to_ros2_message as to_ros2_message
    from knotwork.export.samples import to_csv as to_csv
    from knotwork.export.samples import to_json as to_json
    from knotwork.export.samples import to_npz as to_npz
    from knotwork.export.samples import to_parquet as to_parquet
    from knotwork.export.table import MotionTable as MotionTable
    from knotwork.export.table import motion_table as motion_table
    from knotwork.export.urscript import to_urscript as to_urscript

__getattr__, __dir__, __all__ = lazy_names(__name__)
