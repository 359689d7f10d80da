"""A motion over time in a scene's player: frames, waypoints and joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.curves.trajectory.sampling import make_sample_times
from knotwork.robot import Robot
from knotwork.units import Units
from knotwork.view.base_joints import base_joints
from knotwork.view.known_joints import known_positions
from knotwork.view.scene_parts import pack_numbers
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.tool_trace import tool_speeds

FRAME_RATE = 120.0
"""Frame rate of an animation that has fewer frames than the maximum [Hz]."""
MAX_FRAMES = 240_000
MAX_SPEEDS = 30_000


def arm_frames(shown: ShownMotion) -> dict[str, Any]:
    """Give a motion's frames, and the tool's speed at each unless there are too many.

    Between two frames the first one is shown, not interpolated. The last is the motion's end.
    """
    curve, robot = shown.curve, shown.robot
    start, end = float(curve.x[0]), float(curve.x[-1])
    time = make_sample_times(start, end, min(FRAME_RATE, MAX_FRAMES / (end - start)))
    position = np.hstack((curve(time), known_positions(shown.model, time)))
    arm: dict[str, Any] = {
        "start": start,
        "time": pack_numbers((time - start).astype("<f4")),
        "position": pack_numbers(base_joints(robot).positions(position).astype("<f4")),
    }
    if robot.tcp_frame_id is not None and len(time) <= MAX_SPEEDS:
        arm["speed"] = pack_numbers(tool_speeds(shown, time).astype("<f4"))
    return arm


def waypoint_times(shown: ShownMotion) -> list[dict[str, Any]]:
    """Names and times of the waypoints; for a stored trajectory its own ones."""
    waypoints = shown.scenario.waypoints
    names = [waypoint.name for waypoint in waypoints] or [str(i) for i in range(len(shown.times))]
    times = [waypoint.time for waypoint in waypoints] or shown.times.tolist()
    return [{"name": name, "time": time} for name, time in zip(names, times, strict=True)]


def joint_panel(robot: Robot, units: Units) -> list[dict[str, Any]]:
    """Names, units and limits of the joints; `None` for a missing limit."""
    panel = []
    limits = zip(robot.lower_position_limit, robot.upper_position_limit, strict=True)
    for name, unit, bounds in zip(robot.joint_names, robot.joint_units, limits, strict=True):
        factor, shown = units.shown(1.0, unit)
        low, high = (factor * float(bound) if np.isfinite(bound) else None for bound in bounds)
        panel.append({"name": name, "unit": shown, "factor": factor, "low": low, "high": high})
    return panel
