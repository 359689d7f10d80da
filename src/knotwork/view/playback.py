"""A motion over time in a scene's player: frames, joints, use of limits and failures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.scenario.joint_space import JointSpace
from knotwork.scene.model import CollisionModel
from knotwork.trajectory import JointTrajectory
from knotwork.trajectory.sampling import sample_times
from knotwork.units import Units
from knotwork.verification import Report
from knotwork.view.clearance_curve import clearance_curve, nearest_around
from knotwork.view.footing import footing
from knotwork.view.limit_share import limit_shares
from knotwork.view.moving_things import known_positions
from knotwork.view.packing import packed_numbers
from knotwork.view.tool_curves import stretches
from knotwork.view.tool_trace import tool_speeds
from knotwork.waypoints import FloatArray

LEAST_RATE = 60.0
"""Frames a second that an animation has at least."""

RATE = 120.0
MOST_FRAMES = 240_000
MOST_SPEEDS = 30_000


def frame_times(curve: PiecewisePolynomial) -> FloatArray:
    """Times of an animation's frames [s], `RATE` a second or, if it is long, `LEAST_RATE`.

    Between two frames the first is shown, and none is made up. The last is the end of the motion.

    Raises:
        InputError: It lasts so long that no page could hold it.
    """
    start, end = float(curve.x[0]), float(curve.x[-1])
    duration = end - start
    rate = RATE if duration * RATE < MOST_FRAMES else LEAST_RATE
    if duration * rate >= MOST_FRAMES:
        raise InputError(
            f"the motion lasts {duration:g} s; an animation of {LEAST_RATE:g} frames a second can "
            f"last {MOST_FRAMES / LEAST_RATE:g} s at most: view a part of it"
        )
    return sample_times(start, end, rate)


def arm_frames(
    name: str,
    curve: PiecewisePolynomial,
    robot: Robot,
    model: CollisionModel | None = None,
    paths: Sequence[ScenarioPath] = (),
) -> dict[str, Any]:
    """Give a motion's frames, and the tool's speed at each unless there are too many.

    Args:
        name: Of the motion.
        curve: Joint positions, trailing shape (d,).
        robot: The arm.
        model: Where something moves by itself: positions of its joints follow the robot's.
        paths: Those of the task.
    """
    time = frame_times(curve)
    position = curve(time)
    shown = footing(robot).positions(np.hstack((position, known_positions(model, time))))
    arm: dict[str, Any] = {
        "name": name,
        "start": float(time[0]),
        "time": packed_numbers((time - time[0]).astype("<f4")),
        "position": packed_numbers(shown.astype("<f4")),
    }
    if robot.tcp_frame_id is not None and len(time) <= MOST_SPEEDS:
        speed = tool_speeds(robot, curve, time, paths)
        arm["speed"] = packed_numbers(speed.astype("<f4"))
    return arm


def waypoint_times(scenario: Scenario | None, trajectory: JointTrajectory) -> list[dict[str, Any]]:
    """Give names and times of the waypoints, of a stored trajectory those that it knows."""
    if scenario is not None:
        return [{"name": one.name, "time": one.time} for one in scenario.waypoints]
    times = trajectory.waypoint_times if trajectory.waypoint_times is not None else ()
    return [{"name": str(i), "time": float(time)} for i, time in enumerate(times)]


SAMPLES = 800
# A break at one time is shown this wide, in parts of the motion.
LEAST_WIDTH = 0.003


def strip(
    robot: Robot,
    trajectory: JointTrajectory,
    scenario: Scenario | None,
    space: JointSpace | None,
    report: Report | None,
) -> dict[str, Any]:
    """Give the use of limits, speeds along paths, clearance, failures and events, over time.

    Args:
        robot: The arm.
        trajectory: Its motion, joints in the robot's order.
        scenario: The task.
        space: Its limits.
        report: Of the check; the use of the limits in it is shown.

    Returns:
        Times from the start of the motion [s].
    """
    curve = trajectory.polynomial
    start, end = float(curve.x[0]), float(curve.x[-1])
    found = report.failures if report is not None else ()
    least = 0.5 * LEAST_WIDTH * (end - start)
    broken = []
    for one in found:
        if one.at is not None:
            for low, high in one.spans or ((one.at, one.at),):
                broken.append([max(low - least, start) - start, min(high + least, end) - start])
    asked = [
        [max(part.full_speed[0], low) - start, min(part.full_speed[1], high) - start, part.speed]
        for _, part, low, high in stretches(scenario, curve)
    ]
    time = np.linspace(start, end, SAMPLES)
    shares = (
        [share for _, share in limit_shares(robot, curve, space, report.findings, time)]
        if report is not None and space is not None
        else []
    )
    use = np.max([np.zeros(SAMPLES), *shares], axis=0)
    return {
        "use": packed_numbers(use.astype("<f4")),
        "asked": asked,
        "broken": broken,
        "clearance": _clearance(trajectory, scenario, space, report),
        "events": [[one.time - start, one.said] for one in trajectory.events],
        "segments": [[one.start - start, one.end - start, one.name] for one in trajectory.segments],
    }


def _clearance(
    trajectory: JointTrajectory,
    scenario: Scenario | None,
    space: JointSpace | None,
    report: Report | None,
) -> dict[str, Any] | None:
    """Clearance from what stands around over time, the nearest pairs, and what is to be kept."""
    nearest = nearest_around(report.findings) if report is not None else None
    also = [] if nearest is None or nearest.time is None else [nearest.time]
    start, end = trajectory.start_time, trajectory.end_time
    found = clearance_curve(trajectory, scenario, space, (start, end), also)
    if found is None or scenario is None:
        return None
    return {
        "time": (found.time - start).tolist(),
        "distance": [round(d, 6) if np.isfinite(d) else None for d in found.distance.tolist()],
        "pair": found.pair,
        "names": found.names,
        "margin": scenario.scene.rules.margin,
    }


def joint_panel(robot: Robot, units: Units) -> list[dict[str, Any]]:
    """Names, units and limits of the joints; `None` for a limit that there is not."""
    panel = []
    limits = zip(robot.lower_position_limit, robot.upper_position_limit, strict=True)
    for name, unit, bounds in zip(robot.joint_names, robot.joint_units, limits, strict=True):
        factor, shown = units.shown(1.0, unit)
        low, high = (factor * float(bound) if np.isfinite(bound) else None for bound in bounds)
        panel.append({"name": name, "unit": shown, "factor": factor, "low": low, "high": high})
    return panel
