"""`follow_path`: a tool path followed at constant speed, without a scenario."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.curves.interpolation import get_planner
from knotwork.curves.tool_paths import Curve, OrientationCurve, TimedPath, ToolPath, speed_profile
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError, PathError
from knotwork.errors.arguments import require_number, require_type
from knotwork.planning.task_to_joint.waypoint_insertion import insert_path_waypoints
from knotwork.robot import Robot, load_robot
from knotwork.robot.kinematics.following.joints_on_path import JointsOnPath
from knotwork.robot.kinematics.solutions.pose import solve_pose_ik
from knotwork.task import Tolerances
from knotwork.task.scenario import MIN_PATH_TOLERANCE
from knotwork.waypoints import JointWaypoints

START_POSE_TOLERANCE = 1e-6
"""Tolerance of the tool's pose at the start of the path [m, rad]."""

DEFAULT_TOLERANCES = Tolerances.model_construct()

_require_tolerance = partial(require_number, minimum=MIN_PATH_TOLERANCE)


def follow_path(
    robot: Robot | str | Path,
    path: ToolPath | Curve,
    speed: float,
    tolerance: float = DEFAULT_TOLERANCES.path,
    *,
    start: ArrayLike | None = None,
    rotation: ArrayLike | None = None,
    acceleration: float | None = None,
    orientation_tolerance: float = DEFAULT_TOLERANCES.path_orientation,
    speed_tolerance: float = DEFAULT_TOLERANCES.path_speed,
    pull_to_middle: float = 0.0,
) -> JointTrajectory:
    """Follow a tool path at constant speed, through automatically inserted waypoints.

    The motion begins at time 0, in the branch of the start. It is C² and cubic, and is proved to
    keep the tolerances at all times.

    Args:
        robot: The arm, or its name or file.
        path: Path of the tool, in base axes. Along a plain curve the tool keeps its rotation.
        speed: Speed of the TCP along the path [m/s].
        tolerance: Largest distance from the path [m].
        start: Joint positions at the path's start [rad or m], shape (d,); by default those of the
            solution nearest to the robot's configuration `home`.
        rotation: Rotation of the tool along a curve, shape (3, 3); by default the one at the start.
        acceleration: Largest acceleration along the path [m/s²]; the motion then begins and ends at
            rest.
        orientation_tolerance: Largest angle from the path's orientation [rad].
        speed_tolerance: Largest deviation of the speed, as a fraction of it.
        pull_to_middle: Rate at which self-motion pulls joints to the middle of their ranges [1/s].

    Raises:
        InputError: A value is wrong, the arm is not or can't be at the start of the path, or no
            start is given and the robot has no configuration `home`.
        PathError: The path has stops but no acceleration, or is too short or too long.
        FollowingError: A joint limit, a velocity limit or a singularity prevents it.

    >>> arm = kw.load_robot("ur5")
    >>> q = arm.configuration("home")
    >>> at = arm.forward(q).translation
    >>> line = kw.tool_paths.Line(at, at + [0, 0.1, 0])
    >>> motion = kw.follow_path(arm, line, 0.05, 1e-7, start=q)
    >>> motion.waypoint_times.tolist()  # one was inserted
    [0.0, 1.0, 2.0]
    """
    arm = robot if isinstance(robot, Robot) else load_robot(robot)
    arm.require_tool()
    allowed = Tolerances.model_construct(
        path=_require_tolerance(tolerance, "tolerance", "m"),
        path_orientation=_require_tolerance(orientation_tolerance, "orientation_tolerance", "rad"),
        path_speed=_require_tolerance(speed_tolerance, "speed_tolerance"),
    )
    rate = require_number(pull_to_middle, "pull_to_middle", "1/s", minimum=0.0)
    tool_path, q = _path_and_start(arm, path, start, rotation)
    motion = _timed_path(
        tool_path, require_number(speed, "speed", "m/s", positive=True), acceleration
    )
    _check_start(arm, motion, q)
    return _motion_on_path(JointsOnPath(arm, motion, q, rate), allowed)


def _motion_on_path(joints_on_path: JointsOnPath, allowed: Tolerances) -> JointTrajectory:
    """The motion along a path, checked against the limits.

    Raises:
        FollowingError: The motion exceeds a limit of a joint.
    """
    joints_on_path.check()
    arm, followed = joints_on_path.robot, insert_path_waypoints(joints_on_path, allowed)
    waypoints = JointWaypoints(
        joint_names=arm.joint_names,
        time=followed.time,
        position=followed.position,
        velocity=followed.velocity,
        joint_units=arm.joint_units,
        acceleration=followed.acceleration,
    )
    trajectory = get_planner("modified-hermite")(waypoints)
    joints_on_path.check(trajectory.polynomial)
    return trajectory


def _path_and_start(
    robot: Robot, path: ToolPath | Curve, start: ArrayLike | None, rotation: ArrayLike | None
) -> tuple[ToolPath, FloatArray]:
    """The path of the tool, and the joint positions at its start."""
    near = robot.configuration("home") if start is None else start
    near = checked_array(near, (robot.dof,), "start")
    if not isinstance(path, ToolPath):
        require_type(path, Curve, "path", "a ToolPath or a curve of kw.tool_paths")
        constant = robot.forward(near).rotation if rotation is None else rotation
        path = ToolPath([path], OrientationCurve.constant(constant, path.length))
    elif rotation is not None:
        raise InputError(
            "rotation is given together with a ToolPath, which has its own orientation"
        )
    if start is None:
        near = solve_pose_ik(robot, path.pose(0.0), near).q
    return path, near


def _timed_path(path: ToolPath, speed: float, acceleration: float | None) -> TimedPath:
    if acceleration is None and path.stops:
        raise PathError("the path has stops; give acceleration")
    lengths = [curve.length for curve in path.curves]
    end_speed = None if acceleration is None else 0.0
    timing = speed_profile(
        lengths,
        [speed] * len(lengths),
        acceleration=1.0 if acceleration is None else acceleration,
        start_speed=end_speed,
        end_speed=end_speed,
        stops=path.stops,
    )
    return TimedPath(path, timing)


def _check_start(robot: Robot, motion: TimedPath, start: FloatArray) -> None:
    """Raise an error if the tool is not at the start of the path."""
    wanted, actual = motion.tool_path.pose(0.0), robot.forward(start)
    distance = float(np.linalg.norm(actual.translation - wanted.translation))
    angle = float(np.linalg.norm(pin.log3(wanted.rotation.T @ actual.rotation)))
    if max(distance, angle) > START_POSE_TOLERANCE:
        distance, degrees = round(distance, 9), round(float(np.degrees(angle)), 9)
        raise InputError(
            f"start puts the tool {distance:.4g} m and {degrees:.4g} deg from "
            "the beginning of the path; kw.solve_pose_ik(robot, pose, start) gives joint "
            "positions for the pose there"
        )
