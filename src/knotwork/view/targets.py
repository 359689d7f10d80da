"""Poses and velocities given at waypoints, and arrows for the velocities."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.view.mesh import Mesh, merge_meshes
from knotwork.view.primitive_meshes import arrow
from knotwork.view.shown_motion import CACHED_MOTIONS, ShownMotion
from knotwork.waypoints import CartesianWaypoint

ARROW_COLOUR = (0.9, 0.35, 0.0, 1.0)
_NICE_SECONDS = [mantissa * 10.0**power for power in range(3, -5, -1) for mantissa in (5, 2, 1)]
"""Durations of motion that arrows may represent, the longest first [s]."""
ASIDE_DISTANCE = 0.014
"""Distance of arrows from the path, relative to the scene, so that they do not hide its colours."""
MIN_DRAWN_SPEED = 1e-9
"""Speed below which a waypoint is a stop [m/s]."""


class ToolTarget(NamedTuple):
    """The given pose and velocity of the tool at a waypoint, in the axes of the URDF's root.

    Attributes:
        name: Name of the waypoint.
        time: Its time [s].
        pose: Pose of the TCP [m], as `pin.SE3`.
        linear, angular: Velocity at the TCP [m/s, rad/s], shape (3,) each.
        in_world_frame: Whether they are given in the world frame, which moves if joints move the
            base. They are then as at the time of the waypoint.
    """

    name: str
    time: float
    pose: pin.SE3
    linear: FloatArray
    angular: FloatArray
    in_world_frame: bool


@lru_cache(CACHED_MOTIONS)
def tool_targets(shown: ShownMotion) -> Sequence[ToolTarget]:
    """Find the given tool pose and velocity of each waypoint.

    A wait appears once, at its start.
    """
    scenario, joints, robot, curve = shown.scenario, shown.joints, shown.robot, shown.curve
    if robot.tcp_frame_id is None:
        return []
    base = robot.base_placement
    at_tool = []
    for i, (waypoint, state) in enumerate(zip(scenario.waypoints, joints.targets, strict=True)):
        if i - 1 in joints.rest_intervals:
            continue
        if state is not None:
            pose, twist = robot.forward(state.position), robot.twist(state.position, state.velocity)
        elif isinstance(waypoint, CartesianWaypoint):
            pose, twist = waypoint.pose, waypoint.twist
            if waypoint.in_world_frame:
                q = curve(np.clip(waypoint.time, curve.x[0], curve.x[-1]))
                away = robot.forward(q) * robot.tool_pose(q, in_world_frame=True).inverse()
                turn, pose = away.rotation, away * pose
                twist = pin.Motion(turn @ twist.linear, turn @ twist.angular)
        linear, angular = base.rotation @ twist.linear, base.rotation @ twist.angular
        target = ToolTarget(
            waypoint.name, waypoint.time, base * pose, linear, angular, waypoint.in_world_frame
        )
        at_tool.append(target)
    return at_tool


def given_velocities(shown: ShownMotion) -> list[ToolTarget]:
    """The waypoints at the tool whose velocity was given, not chosen by planning."""
    chosen = shown.chosen_velocities
    return [target for target in tool_targets(shown) if target.name not in chosen]


def spacings(targets: Sequence[ToolTarget]) -> FloatArray:
    """Distances between consecutive waypoints that are not at the same point [m]."""
    points = np.array([target.pose.translation for target in targets]).reshape(-1, 3)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(lengths[lengths > 1e-6])


def velocity_arrows(targets: Sequence[ToolTarget], size: float) -> tuple[Mesh, float] | None:
    """Draw the linear velocities; `None` if all are stops.

    The longest arrow is at most a sixth of the scene, and about as long as the waypoint spacing.

    Returns:
        The arrows, and the time in which the tool moves by their length [s].
    """
    moving = [target for target in targets if np.linalg.norm(target.linear) > MIN_DRAWN_SPEED]
    if not moving:
        return None
    longest = size / 6
    distances = spacings(targets)
    if len(distances):
        longest = min(longest, max(float(np.median(distances)), 0.04 * size))
    fastest = max(float(np.linalg.norm(target.linear)) for target in moving)
    fitting = (seconds for seconds in _NICE_SECONDS if seconds * fastest <= longest)
    seconds = next(fitting, _NICE_SECONDS[-1])
    arrows = []
    for target in moving:
        foot = target.pose.translation + ASIDE_DISTANCE * size * _aside(target)
        arrows.append(arrow(foot, foot + seconds * target.linear, 0.0024 * size, ARROW_COLOUR))
    return merge_meshes(arrows), seconds


def _aside(target: ToolTarget) -> FloatArray:
    """Unit vector perpendicular to the velocity, towards the tool's body."""
    along = target.linear / np.linalg.norm(target.linear)
    for axis in (-target.pose.rotation[:, 2], target.pose.rotation[:, 0]):
        across = axis - (axis @ along) * along
        length = float(np.linalg.norm(across))
        if length > 0.3:
            break
    return np.asarray(across / length)
