"""The path of the tool in a motion, its speed, and exceeded limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.verification.limits import LIMIT_GROUPS, limit_slack
from knotwork.view.plotted_utilisation import sample_utilisation
from knotwork.view.shown_motion import CACHED_MOTIONS, ShownMotion
from knotwork.view.targets import tool_targets

TRACE_SAMPLES = 1200


@dataclass(frozen=True, eq=False)
class ToolTrace:
    """The tool centre point over time, in the axes of the URDF's root.

    Attributes:
        time: Times [s], shape (n,).
        position: Positions [m], shape (n, 3).
        speed: Speeds [m/s], from `tool_speeds`, shape (n,).
        exceeded: Whether a limit of joints, tool or links is exceeded, or bodies are too close,
            shape (n,).
    """

    time: FloatArray
    position: FloatArray
    speed: FloatArray
    exceeded: BoolArray


@lru_cache(CACHED_MOTIONS)
def tool_trace(shown: ShownMotion) -> ToolTrace | None:
    """Sample the tool's path evenly in time, at breaks, and where something fails.

    Returns:
        The path, which is cached; `None` without a tool.
    """
    if shown.robot.tcp_frame_id is None:
        return None
    robot, curve = shown.robot, shown.curve
    failures = [failure for failure in shown.failures if failure.subject != "path"]
    limits = [failure for failure in failures if failure.group in LIMIT_GROUPS]
    spans = [span for failure in failures for span in failure.intervals]
    start, end = float(curve.x[0]), float(curve.x[-1])
    worst = [failure.time for failure in limits if failure.time is not None]
    further_times = [*(target.time for target in tool_targets(shown)), *np.ravel(spans), *worst]
    inner = [at for at in further_times if start <= at <= end]
    breaks = curve.x[:: len(curve.x) // (TRACE_SAMPLES + 1) + 1]
    time = np.unique(np.concatenate([np.linspace(start, end, TRACE_SAMPLES), breaks, inner]))
    base = robot.base_placement
    position = np.array([(base * robot.forward(row)).translation for row in curve(time)])
    speed = tool_speeds(shown, time)
    exceeded = np.zeros(len(time), dtype=bool)
    for begin, end in spans:
        exceeded |= (time >= begin) & (time <= end)
    for failure, utilisation in sample_utilisation(shown, limits, time):
        limit = abs(failure.limit or 1.0)
        exceeded |= utilisation > 1.0 + limit_slack(limit) / limit
    return ToolTrace(time, position, speed, exceeded)


def tool_speeds(shown: ShownMotion, time: FloatArray) -> FloatArray:
    """Speed of the tool centre point [m/s], shape (n,), at times of shape (n,).

    Along a tool path the speed is relative to the frame of the path, like the given speed.
    """
    robot, curve, paths = shown.robot, shown.curve, shown.scenario.paths
    q, v = curve(time), curve(time, 1)
    velocity = np.array([robot.jacobian(a)[:3] @ b for a, b in zip(q, v, strict=True)])
    speed = np.linalg.norm(velocity, axis=1)
    for motion in (path.timed_path for path in paths if path.timed_path.has_own_clock):
        on = (time >= motion.start_time) & (time <= motion.end_time)
        poses = [robot.forward(row) for row in q[on]]
        place = np.array([pose.translation for pose in poses]).reshape(-1, 3)
        turn = np.array([pose.rotation for pose in poses]).reshape(-1, 3, 3)
        _, _, relative = motion.woven_frame.relative_motion(time[on], place, turn, velocity[on])
        speed[on] = np.linalg.norm(relative, axis=1)
    return np.asarray(speed)
