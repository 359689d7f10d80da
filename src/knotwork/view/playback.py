"""A motion over time in a scene's player: frames, waypoints and joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.scenario import ScenarioPath
from knotwork.scene.collision_model import CollisionModel
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.trajectory.sampling import sample_times
from knotwork.units import Units
from knotwork.view.base_joints import base_joints
from knotwork.view.known_joints import known_positions
from knotwork.view.scene_parts import pack_numbers
from knotwork.view.shown_motion import ShownMotion
from knotwork.view.tool_trace import tool_speeds
from knotwork.waypoints import FloatArray

LEAST_FRAME_RATE = 60.0
"""Lowest frame rate of an animation [Hz]."""

FRAME_RATE = 120.0
MOST_FRAMES = 240_000
MOST_SPEEDS = 30_000


def frame_times(curve: PiecewisePolynomial) -> FloatArray:
    """Times of an animation's frames [s], at `FRAME_RATE` or, for a long one, `LEAST_FRAME_RATE`.

    Between two frames the first one is shown, not interpolated. The last is the motion's end.

    Raises:
        InputError: The motion is too long for a page.
    """
    start, end = float(curve.x[0]), float(curve.x[-1])
    duration = end - start
    rate = FRAME_RATE if duration * FRAME_RATE < MOST_FRAMES else LEAST_FRAME_RATE
    if duration * rate >= MOST_FRAMES:
        raise InputError(
            f"the motion lasts {duration:g} s; an animation of {LEAST_FRAME_RATE:g} frames "
            f"a second can last {MOST_FRAMES / LEAST_FRAME_RATE:g} s at most: view a part of it"
        )
    return sample_times(start, end, rate)


def arm_frames(
    curve: PiecewisePolynomial,
    robot: Robot,
    model: CollisionModel | None,
    paths: Sequence[ScenarioPath],
) -> dict[str, Any]:
    """Give a motion's frames, and the tool's speed at each unless there are too many.

    Args:
        curve: Joint positions, trailing shape (d,).
        robot: The arm.
        model: Collision model with the positions of joints after the robot's, if there are any.
        paths: Tool paths of the task.
    """
    time = frame_times(curve)
    position = curve(time)
    shown = base_joints(robot).positions(np.hstack((position, known_positions(model, time))))
    arm: dict[str, Any] = {
        "start": float(time[0]),
        "time": pack_numbers((time - time[0]).astype("<f4")),
        "position": pack_numbers(shown.astype("<f4")),
    }
    if robot.tcp_frame_id is not None and len(time) <= MOST_SPEEDS:
        speed = tool_speeds(robot, curve, time, paths)
        arm["speed"] = pack_numbers(speed.astype("<f4"))
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
