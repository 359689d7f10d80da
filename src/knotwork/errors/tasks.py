"""Errors of infeasible tasks: poses, velocities, tool paths, durations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from knotwork.errors.base import InputError
from knotwork.errors.plain_text import waypoint_text
from knotwork.units import SI, Units

POINT_SHARE = 1e-5
"""The position counts as reached if its error is below this times the angular error [m/rad]."""

SMALL_EXCESS = 1e-4
"""An excess of a joint below this is printed, because the printed position hides it [rad or m]."""


class TaskError(InputError):
    """A waypoint that the arm can't reach as specified.

    Attributes:
        waypoint: Name of the waypoint.
    """

    def __init__(self, waypoint: str, message: str, *, where: str = "", **data: Any) -> None:
        self.waypoint, self.where = waypoint, where
        prefix = f"{where}: " if where else ""
        named = f"{waypoint_text(waypoint)}: " if waypoint else ""
        super().__init__(f"{prefix}{named}{message}", **data)


class OutOfReachError(TaskError):
    """The arm can't reach the pose within its limits."""


class UnreachablePoseError(OutOfReachError):
    """No configuration of the arm brings the tool to the pose.

    The closest pose found within the limits is at the nearest point, and there turned as little as
    possible: a metre counts as 1000 radians.

    >>> import pinocchio as pin
    >>> far = pin.SE3(np.eye(3), np.array([2.0, 0.0, 0.0]))
    >>> try:
    ...     kw.solve_pose_ik(kw.load_robot("ur5"), far, np.zeros(6))
    ... except UnreachablePoseError as error:
    ...     print(round(error.closest_distance, 3))
    1.052

    Attributes:
        closest: Joint positions of the closest pose [rad or m].
        closest_distance: Remaining distance [m].
        closest_angle: Remaining angle [rad].
    """

    closest: Sequence[float] = ()
    closest_distance: float = 0.0
    closest_angle: float = 0.0

    def __init__(
        self,
        waypoint: str,
        *,
        closest: Sequence[float],
        closest_distance: float,
        closest_angle: float,
        where: str = "",
        units: Units = SI,
    ) -> None:
        distance = units.text(closest_distance, "m", ".4g")
        angle = units.text(closest_angle, "rad", ".4g")
        if closest_distance > POINT_SHARE * closest_angle:
            message = f"the pose is out of reach: the nearest point found is {distance} away"
        else:
            message = (
                "the point is reachable, but not in this orientation: the nearest orientation "
                f"found there is off by {angle}"
            )
        super().__init__(
            waypoint,
            message,
            where=where,
            closest=closest,
            closest_distance=closest_distance,
            closest_angle=closest_angle,
        )


class OutsideLimitsError(OutOfReachError):
    """The pose is reachable only with joints outside their position limits.

    Attributes:
        joints: For each joint outside: name, value, lower limit and upper limit [rad or m].
    """

    joints: Sequence[tuple[str, float, float, float]] = ()

    def __init__(
        self,
        waypoint: str,
        joints: Sequence[tuple[str, float, float, float]],
        *,
        joint_units: Mapping[str, str],
        where: str = "",
        units: Units = SI,
    ) -> None:
        parts = []
        for name, value, lower, upper in joints:
            unit = joint_units[name]
            bounds = ", ".join(f"{units.shown(limit, unit)[0]:.6g}" for limit in (lower, upper))
            excess = max(lower - value, value - upper)
            by = f" by {units.text(excess, unit, '.3g')}" if excess < SMALL_EXCESS else ""
            parts.append(f"{name} at {units.text(value, unit)}, outside [{bounds}]{by}")
        message = (
            "the pose is reachable only outside the joint limits: the solution with the smallest "
            f"excess has {'; '.join(parts)}"
        )
        super().__init__(waypoint, message, where=where, joints=joints)


class BranchError(TaskError):
    """The pose is not reachable in the requested branch.

    Attributes:
        branches: The branches in which it is reachable, in words.
    """

    branches: Sequence[str] = ()


class SingularityError(TaskError):
    """The tool can't have the specified velocity, or only at joint speeds beyond the limits.

    Attributes:
        smallest_singular_value: Smallest singular value of the tool Jacobian at the waypoint.
        residual: Residual of the best joint velocities: linear [m/s], angular [rad/s].
        joint_velocity: The required joint speeds, by joint name [rad/s or m/s].
    """

    smallest_singular_value: float = 0.0
    residual: tuple[float, float] = (0.0, 0.0)
    joint_velocity: Mapping[str, float] = MappingProxyType({})


class FollowingError(TaskError):
    """A tool path that the arm can't follow.

    Attributes:
        arc_length: Length that can be followed [m].
        cause: `"joint limit"`, `"velocity limit"`, `"singularity"` or `"collision"`.
        joint: Name of the joint that would be beyond its limit; empty without one.
        value: Position or speed that the joint would have [rad or m, or per second], or `None`.
        bound: Limit that it exceeds [rad or m, or per second], or `None`.
        part_of_speed: Feasible fraction of the speed, if slowing down is sufficient.
    """

    arc_length: float = 0.0
    cause: str = ""
    joint: str = ""
    value: float | None = None
    bound: float | None = None
    part_of_speed: float | None = None


class NoWayFoundError(InputError):
    """No collision-free motion to a waypoint was found. This does not prove that none exists.

    Attributes:
        end: `"start"`, `"goal"` or the number of a waypoint between them (`"1"`, ...), if the
            fault is known to be there; else empty.
        names: Two bodies that are too close there.
        depth: Depth of the bodies within the margin there [m].
        waypoints: Indices of the two waypoints without a motion, if only one solution of each was a
            candidate; else `None`.
    """

    end: str = ""
    names: Sequence[str] = ()
    depth: float = 0.0
    waypoints: Sequence[int] | None = None


class TimingError(InputError):
    """No durations keep the limits of the motion.

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
        waypoint: Index of the waypoint at fault, or of the first waypoint of the interval at fault;
            `None` without a particular one.
        interval: Whether the fault is in the interval from that waypoint to the next one.
        joint: Name of the joint at fault; empty without a particular one.
        limit: `"velocity"`, `"acceleration"`, `"jerk"`, `"position"`, `"effort"`, `"tool speed"`,
            `"duration"`, `"budget"` or `"rounds"`; empty without a particular one.
        value: The requested value, in SI units, or `None`.
        bound: The nearest feasible value, in SI units, or `None` if unknown.
    """

    waypoint: int | None = None
    interval: bool = False
    joint: str = ""
    limit: str = ""
    value: float | None = None
    bound: float | None = None
