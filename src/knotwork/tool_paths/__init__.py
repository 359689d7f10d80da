"""Tool paths: lines, arcs and curves, how the tool turns along them, and their timing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.tool_paths.arc import Arc as Arc
    from knotwork.tool_paths.blend import Blend as Blend
    from knotwork.tool_paths.curve import Curve as Curve
    from knotwork.tool_paths.line import Line as Line
    from knotwork.tool_paths.orientation import OrientationCurve as OrientationCurve
    from knotwork.tool_paths.path import ToolPath as ToolPath
    from knotwork.tool_paths.tangent import tangent_orientation as tangent_orientation
    from knotwork.tool_paths.through_points import ThroughPoints as ThroughPoints
    from knotwork.tool_paths.timed_path import TimedPath as TimedPath
    from knotwork.tool_paths.timing import Timing as Timing
    from knotwork.tool_paths.timing import speed_for_duration as speed_for_duration
    from knotwork.tool_paths.timing import speed_profile as speed_profile

__getattr__, __dir__, __all__ = lazy_names(__name__)
