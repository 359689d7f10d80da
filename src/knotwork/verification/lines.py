"""Intervals that look as if the tool were to go along a line, and nothing holds it to one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from knotwork.scenario import Scenario
from knotwork.verification.motion import Motion
from knotwork.waypoints import CartesianWaypoint, FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot

ALIKE = 0.1
"""Speeds at both ends that differ by no more than this part are about the same."""

ALONG = np.cos(np.radians(15.0))
"""Both velocities are within 15 degrees of the chord."""

DISAGREES = 0.2
"""The chord over the time differs from the speeds asked for by more than this part."""

NOTABLE = 0.01
"""Deviations below this part of the chord, and speeds within this part times 5, pass for a line."""

IN_TIME = 0.02
"""The chord takes the time there is, at the speed of both ends, but for this part: a line is meant
whatever the directions of the ends."""

FAR = 0.1
"""Such an interval is named where the tool leaves the chord by more than this part of it."""

RADIAN = 0.1
"""What a radian counts where the tool goes and turns at once [m]."""

SAMPLES = 60


def line_not_held(
    motion: Motion,
    scenario: Scenario,
    robot: Robot,
    first: CartesianWaypoint,
    second: CartesianWaypoint,
) -> str:
    """Say how far the tool leaves a line that was probably meant; empty if none was or it doesn't.

    Args:
        motion: The motion.
        scenario: Its task.
        robot: The arm.
        first: The waypoint where an interval begins that is on no tool path.
        second: The one where it ends.
    """
    chord = second.position - first.position
    length, time = float(np.linalg.norm(chord)), second.time - first.time
    speeds = np.array([np.linalg.norm(one.linear) for one in (first, second)])
    if length < 1e-6 or not speeds.all() or motion.end_time < second.time - 1e-9:
        return ""
    direction, asked = chord / length, float(speeds.mean())
    along = [float(one.linear @ direction) for one in (first, second)]
    ratio = length / time / asked
    straight = min(along / speeds) >= ALONG
    turning = RADIAN * max(np.linalg.norm(one.angular) for one in (first, second)) > speeds.max()
    meant = straight or abs(ratio - 1.0) <= IN_TIME
    if not meant or turning or np.ptp(speeds) > ALIKE * speeds.max():
        return ""
    notable = NOTABLE if straight else FAR
    position, speed = _tool(motion, robot, np.linspace(first.time, second.time, SAMPLES + 1))
    gone = position - first.position
    off = float(np.linalg.norm(gone - np.outer(gone @ direction, direction), axis=1).max())
    uneven = max(speed.max() / asked - 1.0, 1.0 - speed.min() / asked)
    if off < notable * length and uneven < 5.0 * notable:
        return ""
    scale, unit = scenario.shown_length
    words = (
        f"between {first.name!r} and {second.name!r} the tool leaves the straight line by "
        f"{scale * off:.3g} {unit}, at {scale * speed.min():.3g} to {scale * speed.max():.3g} "
        f"{unit}/s; `along: line` holds it"
    )
    if abs(ratio - 1.0) > DISAGREES:
        words += (
            f" ({scale * length:.4g} {unit} in {time:.4g} s are {scale * length / time:.4g} "
            f"{unit}/s, and {scale * asked:.4g} {unit}/s is asked for)"
        )
    return words


def _tool(motion: Motion, robot: Robot, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions [m], shape (k, 3), and speeds [m/s] of the tool."""
    times = np.clip(times, motion.start_time, motion.end_time)
    q, v = motion.curve(times), motion.curve(times, 1)
    position = np.array([robot.forward(one).translation for one in q])
    twists = [robot.twist(one, rate).linear for one, rate in zip(q, v, strict=True)]
    return position, np.linalg.norm(twists, axis=1)
