"""Errors of infeasible tasks: poses, velocities, tool paths, durations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from knotwork.errors.base import InputError
from knotwork.errors.plain_text import waypoint_text
from knotwork.units import SI, Units

REACHED_POINT_RATIO = 1e-5
"""Ratio of position to angular error [m/rad] below which only the orientation is unreachable."""

SMALL_EXCESS = 1e-4
"""Excess of a joint [rad or m] that its printed position would hide, so that it is printed too."""
SMALL_RESIDUAL = 1e-12
"""Residual of a velocity that rounding explains [m/s or rad/s]."""
SMALL_TWIST_PART = 1e-3
"""Linear or angular part, as a fraction of its twist, below which it is not printed."""
AXIS_COSINE = 0.999
"""Component of a unit vector above which the vector is printed as an axis, such as `z`."""


class TaskError(InputError):
    """A waypoint that the arm can't reach as specified.

    Attributes:
        waypoint: Name of the waypoint.
    """

    def __init__(self, waypoint: str, message: str, *, prefixed: bool = True, **data: Any) -> None:
        """Begin the message with the waypoint, if `prefixed`."""
        self.waypoint = waypoint
        prefix = f"{waypoint_text(waypoint)}: " if waypoint and prefixed else ""
        super().__init__(f"{prefix}{message}", **data)


class OutOfReachError(TaskError):
    """The arm can't reach the pose within its limits."""


class UnreachablePoseError(OutOfReachError):
    """No configuration of the arm brings the tool to the pose.

    `closest` is the configuration found within the limits that brings the TCP nearest to the point;
    among equal ones, that with the smallest angle from the pose, for 1 mm counts as 1 rad.

    >>> import pinocchio as pin
    >>> far = pin.SE3(np.eye(3), np.array([2.0, 0.0, 0.0]))
    >>> try:
    ...     kw.solve_pose_ik(kw.load_robot("ur5"), far, np.zeros(6))
    ... except UnreachablePoseError as error:
    ...     print(round(error.closest_distance, 3))
    1.052

    Attributes:
        closest: Its joint positions [rad or m].
        closest_distance: Distance of its TCP from the point [m].
        closest_angle: Its angle from the pose [rad].
    """

    closest: Sequence[float] = ()
    closest_distance: float = 0.0
    closest_angle: float = 0.0

    def __init__(
        self,
        waypoint: str,
        *,
        closest_distance: float,
        closest_angle: float,
        units: Units = SI,
        **data: Any,
    ) -> None:
        distance = units.text(closest_distance, "m", ".4g")
        angle = units.text(closest_angle, "rad", ".4g")
        if closest_distance > REACHED_POINT_RATIO * closest_angle:
            message = f"the pose is out of reach: the nearest point found is {distance} away"
        else:
            message = (
                "the point is reachable, but not in this orientation: the nearest orientation "
                f"found there is off by {angle}"
            )
        data |= {"closest_distance": closest_distance, "closest_angle": closest_angle}
        super().__init__(waypoint, message, **data)


class OutsideLimitsError(OutOfReachError):
    """The pose is reachable only with joints outside their position limits.

    Attributes:
        joints: Name, value, lower and upper limit of each joint outside its limits [rad or m].
    """

    joints: Sequence[tuple[str, float, float, float]] = ()

    def __init__(
        self,
        waypoint: str,
        joints: Sequence[tuple[str, float, float, float]],
        *,
        joint_units: Mapping[str, str],
        units: Units = SI,
        **data: Any,
    ) -> None:
        parts = []
        for name, value, lower, upper in joints:
            unit = joint_units[name]
            bounds = ", ".join(units.number(limit, unit, ".6g") for limit in (lower, upper))
            excess = max(lower - value, value - upper)
            by = f" by {units.text(excess, unit, '.3g')}" if excess < SMALL_EXCESS else ""
            parts.append(f"{name} at {units.text(value, unit)}, outside [{bounds}]{by}")
        message = (
            "the pose is reachable only outside the joint limits: the solution with the smallest "
            f"excess has {'; '.join(parts)}"
        )
        super().__init__(waypoint, message, joints=joints, **data)


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

    def __init__(
        self,
        waypoint: str,
        direction: Sequence[float],
        fast_joints: Sequence[FastJoint],
        *,
        smallest_singular_value: float,
        residual: tuple[float, float],
        units: Units = SI,
        **data: Any,
    ) -> None:
        """Write the message.

        Args:
            waypoint: Name of the waypoint.
            direction: Twist of the unattainable component or, with fast joints, of the direction
                in which the arm is singular: linear, then angular, shape (6,).
            fast_joints: Joints that would be too fast; none if the velocity is unattainable.
            smallest_singular_value: The attribute.
            residual: The attribute.
            units: Units of speeds.
            data: Other attributes.
        """
        smallest = f"smallest singular value {smallest_singular_value:.3g}"
        along = _name_axes(direction)
        if fast_joints:
            needed = ", ".join(joint.text(units) for joint in fast_joints)
            fraction = min(joint.plausible / joint.speed for joint in fast_joints)
            message = (
                f"the arm is close to a singularity ({smallest}, {along}) and would need {needed}; "
                f"{fraction:.3g} of the speed is feasible"
            )
        else:
            amounts = [
                units.text(amount, unit, ".3g")
                for amount, unit in zip(residual, ("m/s", "rad/s"), strict=True)
                if amount > SMALL_RESIDUAL
            ]
            message = (
                f"the arm can't give the tool this velocity: a component of "
                f"{' and '.join(amounts)} {along} is unattainable here ({smallest})"
            )
        data |= {"smallest_singular_value": smallest_singular_value, "residual": residual}
        super().__init__(waypoint, message, **data)


class FastJoint(NamedTuple):
    """A joint that would have to be too fast near a singularity.

    Attributes:
        name: Name of the joint.
        unit: Unit of its speed, `"rad/s"` or `"m/s"`.
        speed: Required speed.
        limit: Velocity limit, infinite without one.
        plausible: Highest plausible speed: the limit, or a general bound below it.
    """

    name: str
    unit: str
    speed: float
    limit: float
    plausible: float

    def text(self, units: Units) -> str:
        """Write the joint, its speed and its limit."""
        limit = "no limit given"
        if math.isfinite(self.limit):
            limit = f"limit {units.number(self.limit, self.unit)}"
        return f"{self.name} at {units.text(self.speed, self.unit, '.4g')} ({limit})"


def _name_axes(twist: Sequence[float]) -> str:
    """Describe the direction of a twist, for example `along z of the base frame`."""
    parts, size = [], math.hypot(*twist)
    for verb, vector in (("along", twist[:3]), ("about", twist[3:])):
        norm = math.hypot(*vector)
        if norm < SMALL_TWIST_PART * size:
            continue
        unit = [value / norm for value in vector]
        axis = max(range(3), key=lambda i: abs(unit[i]))
        values = ", ".join(f"{round(value, 2) + 0.0:.2f}" for value in unit)
        parts.append(f"{verb} {'xyz'[axis] if abs(unit[axis]) > AXIS_COSINE else f'({values})'}")
    return f"{' and '.join(parts)} of the base frame"


class NoWayFoundError(InputError):
    """No collision-free motion to a waypoint was found. This does not prove that none exists.

    Attributes:
        waypoint_index: Index of the waypoint at fault; `None` without one.
        bodies: Names of two bodies that are too close there.
        shortfall: Missing distance between them, from the required clearance [m].
        between: Indices of the two waypoints between which no motion was found, if only one
            solution of each was a candidate; else `None`.
    """

    waypoint_index: int | None = None
    bodies: Sequence[str] = ()
    shortfall: float = 0.0
    between: tuple[int, int] | None = None


class TimingError(InputError):
    """No durations keep the limits of the motion.

    >>> ends = [
    ...     {"joints": {"lift": 0}, "velocity": {"lift": 3}},
    ...     {"joints": {"lift": 1}, "after": "fastest"},
    ... ]
    >>> try:
    ...     kw.plan({"limits": {"velocity": 1, "acceleration": 2}, "waypoints": ends})
    ... except TimingError as error:
    ...     print(error.joint, error.cause, error.value)
    lift velocity 3.0

    Attributes:
        waypoint_index: Index of the waypoint at fault, or of the first waypoint of the interval at
            fault; `None` without a particular one.
        in_interval: Whether the fault is in the interval from that waypoint to the next one.
        joint: Name of the joint at fault; empty without a particular one.
        cause: `"velocity"`, `"acceleration"`, `"jerk"`, `"position"`, `"effort"`, `"tool_speed"`,
            `"duration"`, `"budget"` or `"rounds"`; empty without a particular one.
        value: The requested value, in SI units, or `None`.
        feasible_value: The nearest feasible value, in SI units, or `None` if unknown.
    """

    others: Sequence[TimingError] = ()
    waypoint_index: int | None = None
    in_interval: bool = False
    joint: str = ""
    cause: str = ""
    value: float | None = None
    feasible_value: float | None = None
