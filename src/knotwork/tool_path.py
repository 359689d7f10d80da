"""How far a joint motion takes the tool from the straight path between its waypoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin

from knotwork.robot import Robot
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import CartesianWaypoint, FloatArray

SAMPLES = 40
# Poses nearer than this to each other are at one place, where the tool only turns [m].
SMALLEST_LINE = 1e-9


@dataclass(frozen=True)
class PathDeviation:
    """Largest distance of the tool from the straight path, sampled.

    Attributes:
        position: Of the TCP from the line between two waypoints [m].
        orientation: Angle from the orientation that turns evenly along that line [rad].
    """

    position: float
    orientation: float


def straight_path_deviation(
    robot: Robot, trajectory: JointTrajectory, waypoints: Sequence[object]
) -> PathDeviation | None:
    """Measure how far the tool strays from straight lines between waypoints given by poses.

    Args:
        robot: The arm.
        trajectory: Its motion, joints in the robot's order.
        waypoints: Those of the scenario; intervals beside joint waypoints are left out.

    Returns:
        The largest deviations, or `None` if no two poses follow each other.
    """
    position = orientation = 0.0
    found = False
    for before, after in pairwise(waypoints):
        if not (isinstance(before, CartesianWaypoint) and isinstance(after, CartesianWaypoint)):
            continue
        found = True
        for q in trajectory.position(np.linspace(before.time, after.time, SAMPLES + 1)):
            off, turned = deviation_from_line(robot.forward(q), before.pose, after.pose)
            position, orientation = max(position, off), max(orientation, turned)
    return PathDeviation(position, orientation) if found else None


def deviation_from_line(pose: pin.SE3, start: pin.SE3, end: pin.SE3) -> tuple[float, float]:
    """Distance [m] and angle [rad] of a pose from the nearest on the straight path to another."""
    line: FloatArray = end.translation - start.translation
    turn = pin.log3(start.rotation.T @ end.rotation)
    length = float(line @ line)
    if length > SMALLEST_LINE**2:
        along = float((pose.translation - start.translation) @ line) / length
    else:  # the tool only turns: how far it has come shows in its rotation
        done = pin.log3(start.rotation.T @ pose.rotation)
        along = float(done @ turn) / max(float(turn @ turn), np.finfo(float).tiny)
    along = min(max(along, 0.0), 1.0)
    straight = pin.SE3(start.rotation @ pin.exp3(along * turn), start.translation + along * line)
    off = float(np.linalg.norm(pose.translation - straight.translation))
    return off, float(np.linalg.norm(pin.log3(straight.rotation.T @ pose.rotation)))
