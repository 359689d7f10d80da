"""Errors of tasks that the arm can't do: poses, velocities, paths to follow, durations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from knotwork.errors.base import InputError
from knotwork.errors.plain_text import called


class TaskError(InputError):
    """A waypoint that the arm can't meet as asked.

    Attributes:
        waypoint: Name of the waypoint.
    """

    def __init__(self, waypoint: str, message: str, *, where: str = "", **data: Any) -> None:
        self.waypoint, self.where = waypoint, where
        prefix = f"{where}: " if where else ""
        named = f"{called(waypoint)}: " if waypoint else ""
        super().__init__(f"{prefix}{named}{message}", **data)


class OutOfReachError(TaskError):
    """The arm does not bring the tool to the pose inside its limits.

    The closest pose is the one with the least distance² + angle² that was found, a metre counting
    as a radian.

    Attributes:
        closest: Joint positions of the closest pose inside the limits [rad or m].
        closest_distance: Distance left with these [m].
        closest_angle: Angle left with these [rad].
        held: Names of the joints that stand at a limit there and would have to go on. There are
            none if the limits make nothing worse.
    """

    closest: Sequence[float] = ()
    closest_distance: float = 0.0
    closest_angle: float = 0.0
    held: Sequence[str] = ()


class UnreachablePoseError(OutOfReachError):
    """No configuration of the arm, inside its limits or out, brings the tool to the pose.

    It has the attributes of `OutOfReachError` and these:

    >>> import pinocchio as pin
    >>> far = pin.SE3(np.eye(3), np.array([2.0, 0.0, 0.0]))
    >>> try:
    ...     kw.solve_pose_ik(kw.load_robot("ur5"), far, np.zeros(6))
    ... except UnreachablePoseError as error:
    ...     print(round(error.point_shortfall, 3))
    1.052

    Attributes:
        position_shortfall: Distance left at the closest pose, limits or not [m].
        orientation_shortfall: Angle left there [rad].
        point_shortfall: Distance left at the nearest point in any orientation, limits or not [m];
            within the tolerance where the point is reached.
        angle_at_point: Angle left where the point is reached, inside the limits if it is reached
            there [rad]; `None` if it is out of reach.
    """

    position_shortfall: float = 0.0
    orientation_shortfall: float = 0.0
    point_shortfall: float = 0.0
    angle_at_point: float | None = None


class OutsideLimitsError(OutOfReachError):
    """The pose is reachable only with joints outside their position limits.

    Attributes, in addition to those of `OutOfReachError`:
        joints: For each joint outside: name, value, lower limit and upper limit [rad or m].
    """

    joints: Sequence[tuple[str, float, float, float]] = ()


class BranchError(TaskError):
    """The pose is not reached in the branch asked for.

    Attributes:
        branches: The branches it is reached in, in words.
    """

    branches: Sequence[str] = ()


class SingularityError(TaskError):
    """The tool can't have the velocity asked for, or only at joint speeds beyond the limits.

    Attributes:
        smallest_singular_value: That of the tool Jacobian at the waypoint.
        residual: What the best joint velocities leave over: linear [m/s], angular [rad/s].
        joint_velocity: The joint speeds that it would take, by joint name [rad/s or m/s].
    """

    smallest_singular_value: float = 0.0
    residual: tuple[float, float] = (0.0, 0.0)
    joint_velocity: Mapping[str, float] = MappingProxyType({})


class FollowingError(TaskError):
    """A tool path that the arm can't follow.

    Attributes:
        arc_length: How far along the path it comes [m].
        cause: `"joint limit"`, `"velocity limit"` or `"singularity"`.
        joint: Name of the joint that would be beyond its limit; empty at a singularity.
        part_of_speed: At which part of its speed the path can be followed, if that is sufficient.
    """

    arc_length: float = 0.0
    cause: str = ""
    joint: str = ""
    part_of_speed: float | None = None


class NoWayFoundError(InputError):
    """No motion that keeps clear was found to a waypoint, which is no proof that there is none.

    Attributes:
        end: `"start"` or `"goal"` where the fault is known to be at one of them; else empty.
        names: The two bodies that are too near one another there, or without each of which alone a
            way was found.
        depth: How far bodies are within the margin there [m].
        waypoints: Indices of those between which no way was found, where only one solution of each
            was looked at; else `None`.
    """

    end: str = ""
    names: Sequence[str] = ()
    depth: float = 0.0
    waypoints: Sequence[int] | None = None


class TimingError(InputError):
    """A motion for which there are no durations that keep its limits.

    >>> ends = [
    ...     {"joints": {"lift": 0}, "velocity": {"lift": 3}},
    ...     {"joints": {"lift": 1}, "after": "fastest"},
    ... ]
    >>> try:
    ...     kw.plan({"limits": {"velocity": 1, "acceleration": 2}, "waypoints": ends})
    ... except TimingError as error:
    ...     print(error.joint, error.limit, error.value)
    lift velocity 3.0

    Attributes:
        waypoint: Index of the waypoint at fault, or of the one before the interval at fault;
            `None` if it is none in particular.
        interval: Whether the interval from that waypoint to the next one is meant.
        joint: Name of the joint at fault; empty if it is none in particular.
        limit: `"velocity"`, `"acceleration"`, `"jerk"`, `"position"`, `"effort"`, `"tool speed"`,
            `"duration"` or `"budget"`; empty if it is none in particular.
        value: What was asked for, in SI units, or `None`.
        bound: The nearest value that would be feasible, in SI units, or `None` if it is not known.
    """

    waypoint: int | None = None
    interval: bool = False
    joint: str = ""
    limit: str = ""
    value: float | None = None
    bound: float | None = None
