"""Deviation of the tool from straight lines between waypoints that no tool path joins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import JointTrajectory
from knotwork.robot import Robot
from knotwork.task.scenario import ScenarioPath
from knotwork.waypoints import CartesianWaypoint

DEVIATION_SAMPLES = 40
"""Number of intervals between two waypoints at whose ends the deviation is measured."""
RADIAN_LENGTH = 0.1
"""Length equivalent to a radian where the tool moves and turns simultaneously [m]."""


@dataclass(frozen=True)
class PathDeviation:
    """Largest distance of the tool from the straight path, sampled.

    Attributes:
        position: Distance of the TCP from the nearest pose on the line between two waypoints [m].
        orientation: Angle of the tool from that pose, which turns uniformly along the line [rad].
    """

    position: float
    orientation: float


def straight_path_deviation(
    robot: Robot,
    trajectory: JointTrajectory,
    waypoints: Sequence[object],
    paths: Sequence[ScenarioPath] = (),
) -> PathDeviation | None:
    """Measure the deviation of the tool from straight lines between waypoints given by poses.

    >>> plan = kw.plan("planar2_closed_form")
    >>> robot, waypoints = plan.joints.robot, plan.scenario.waypoints
    >>> off = straight_path_deviation(robot, plan.trajectory, waypoints)
    >>> round(off.position, 4), round(off.orientation, 4)
    (0.0732, 0.0778)

    Args:
        robot: The arm.
        trajectory: The motion, joints in the robot's order.
        waypoints: Waypoints of the scenario; intervals next to joint waypoints are left out.
        paths: Tool paths through the waypoints; their intervals are left out, too.

    Returns:
        The largest deviations, or `None` if no two poses follow each other.
    """
    deviations = [
        deviation_from_line(robot.forward(q), before.pose, after.pose)
        for before, after in straight_legs(waypoints, paths)
        for q in trajectory.position(np.linspace(before.time, after.time, DEVIATION_SAMPLES + 1))
    ]
    return PathDeviation(*np.max(deviations, axis=0).tolist()) if deviations else None


def straight_legs(
    waypoints: Sequence[object], paths: Sequence[ScenarioPath]
) -> list[tuple[CartesianWaypoint, CartesianWaypoint]]:
    """Pairs of consecutive poses without a tool path between them."""
    along = {i for path in paths for i in range(path.first, path.last)}
    return [
        (before, after)
        for i, (before, after) in enumerate(pairwise(waypoints))
        if i not in along
        and isinstance(before, CartesianWaypoint)
        and isinstance(after, CartesianWaypoint)
        and not (before.in_world_frame or after.in_world_frame)
    ]


def deviation_from_line(pose: pin.SE3, start: pin.SE3, end: pin.SE3) -> tuple[float, float]:
    """Distance [m] and angle [rad] of a pose from the nearest one on the line between two poses.

    On a short line with a large turn, distances alone would not locate the tool along it, so a
    radian counts as 0.1 m.

    >>> points = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.0], [2.0, 0.0, 0.0]])
    >>> start, pose, end = (pin.SE3(np.eye(3), point) for point in points)
    >>> deviation_from_line(pose, start, end)
    (0.5, 0.0)
    """
    line: FloatArray = end.translation - start.translation
    turn = pin.log3(start.rotation.T @ end.rotation)
    moved = pose.translation - start.translation
    turned = pin.log3(start.rotation.T @ pose.rotation)
    square = float(line @ line) + RADIAN_LENGTH**2 * float(turn @ turn)
    product = float(moved @ line) + RADIAN_LENGTH**2 * float(turned @ turn)
    along = min(max(product / max(square, np.finfo(float).tiny), 0.0), 1.0)
    straight = pin.SE3(start.rotation @ pin.exp3(along * turn), start.translation + along * line)
    off = float(np.linalg.norm(pose.translation - straight.translation))
    return off, float(np.linalg.norm(pin.log3(straight.rotation.T @ pose.rotation)))
