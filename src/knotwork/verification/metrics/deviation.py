"""Deviation of the tool from its path, or from straight lines between its waypoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin

from knotwork.robot import Robot
from knotwork.scenario import ScenarioPath, Stretch
from knotwork.spline.trajectory import JointTrajectory
from knotwork.tool_paths.progress import progress
from knotwork.tool_paths.rotations import angle_of
from knotwork.waypoints import CartesianWaypoint, FloatArray

LINE_SAMPLES = 40
RADIAN_LENGTH = 0.1
"""Length equivalent to a radian where the tool moves and turns at once [m]."""


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
    >>> robot, waypoints = plan.space.robot, plan.scenario.waypoints
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
        for q in trajectory.position(np.linspace(before.time, after.time, LINE_SAMPLES + 1))
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
        and not (before.standing or after.standing)
    ]


def deviation_from_line(pose: pin.SE3, start: pin.SE3, end: pin.SE3) -> tuple[float, float]:
    """Distance [m] and angle [rad] of a pose from the nearest one on the line between two poses.

    On a line that is short for its turn, distances alone would not locate the tool:
    a radian counts as 0.1 m.

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


def deviation_from_path(
    robot: Robot, q: FloatArray, path: ScenarioPath, stretch: Stretch, times: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distances [m] and angles [rad] of the tool from the nearest points of a stretch of a path.

    Args:
        robot: The arm.
        q: Joint positions at the times [rad or m], shape (k, d).
        path: The path.
        stretch: The stretch of the path.
        times: Times in order, guesses of the nearest points [s], shape (k,).
    """
    place, rotation, _, s = _relative_motion(robot, q, np.zeros_like(q), path, stretch, times)
    offset, gap = path.motion.path.gaps(place, rotation, s, axis=path.freedom is not None)
    return offset, angle_of(gap)


def speed_along_path(
    robot: Robot,
    q: FloatArray,
    v: FloatArray,
    path: ScenarioPath,
    stretch: Stretch,
    times: FloatArray,
) -> FloatArray:
    """Velocity of the tool along a stretch of a path [m/s], negative backwards, shape (k,).

    Args:
        robot: The arm.
        q: Joint positions at the times [rad or m], shape (k, d).
        v: Joint velocities [rad/s or m/s], shape (k, d).
        path: The path.
        stretch: The stretch of the path.
        times: Times in order [s], shape (k,).
    """
    _, _, velocity, s = _relative_motion(robot, q, v, path, stretch, times)
    return np.asarray((velocity * path.motion.path.position(s, 1)).sum(axis=1))


def _relative_motion(
    robot: Robot,
    q: FloatArray,
    v: FloatArray,
    path: ScenarioPath,
    stretch: Stretch,
    times: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Position, rotation and velocity of the tool in the path's frame, and its progress [m]."""
    poses = [robot.forward(row) for row in q]
    place = np.array([pose.translation for pose in poses]).reshape(-1, 3)
    rotation = np.array([pose.rotation for pose in poses]).reshape(-1, 3, 3)
    velocity = np.array([robot.twist(*row).linear for row in zip(q, v, strict=True)])
    motion = path.motion
    place, rotation, velocity = motion.seen(times, place, rotation, velocity.reshape(-1, 3))
    low, high = motion.arc_length(np.array([stretch.start, stretch.end])).tolist()
    guess = motion.arc_length(np.clip(times, stretch.start, stretch.end))
    return place, rotation, velocity, progress(motion.path, place, guess, (low, high))
