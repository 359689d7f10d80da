"""Deviation of the tool from the straight path between its waypoints."""

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
# What a radian counts where the tool moves and turns at once [m].
RADIAN = 0.1


@dataclass(frozen=True)
class PathDeviation:
    """Largest distance of the tool from the straight path, sampled.

    Attributes:
        position: Distance of the TCP from the nearest pose on the line between two waypoints [m].
        orientation: Angle of the tool from that pose, which turns evenly along the line [rad].
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
    """Distance [m] and angle [rad] of a pose from the nearest one on the straight path to another.

    On a line that is short for its turn, distances alone would not tell how far the tool has
    come: a radian counts as 0.1 m.
    """
    line: FloatArray = end.translation - start.translation
    turn = pin.log3(start.rotation.T @ end.rotation)
    moved = pose.translation - start.translation
    turned = pin.log3(start.rotation.T @ pose.rotation)
    whole = float(line @ line) + RADIAN**2 * float(turn @ turn)
    come = float(moved @ line) + RADIAN**2 * float(turned @ turn)
    along = min(max(come / max(whole, np.finfo(float).tiny), 0.0), 1.0)
    straight = pin.SE3(start.rotation @ pin.exp3(along * turn), start.translation + along * line)
    off = float(np.linalg.norm(pose.translation - straight.translation))
    return off, float(np.linalg.norm(pin.log3(straight.rotation.T @ pose.rotation)))
