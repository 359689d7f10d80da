"""Waypoints of a task, for the tool (`CartesianWaypoint`) or for the joints (`JointWaypoints`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from knotwork.arrays import (
    FloatArray,
    ReadOnlyArrays,
    check_known_rows,
    checked_array,
    checked_joints,
    checked_rows,
    checked_times,
    rotation_error,
)
from knotwork.errors import ArrayError, WaypointDataError
from knotwork.errors.plain_text import default_waypoint_name

if TYPE_CHECKING:
    import pinocchio as pin


class TorchRanges(NamedTuple):
    """Ranges in which the angles of a torch to its seam may be chosen.

    In the axes of the seam, the rotation of the tool is Rx(-work) Ry(-travel) diag(1, -1, -1)
    Rz(-a), where a is `axis_angle`. With the angles t and w of the pose, the rotation from the tool
    to the pose is A Ry(travel - t) Rx(work - w) A', where A = Rz(a) diag(1, -1, -1) Ry(t).

    Attributes:
        work: Minimum and maximum work angle, relative to that of the pose [rad].
        travel: Minimum and maximum travel angle, relative to that of the pose [rad].
        pose_travel: Travel angle of the pose [rad].
        pose_work: Work angle of the pose [rad].
        axis_angle: Rotation about the tool's z axis, from its x axis to the axis that points along
            the seam [rad].
    """

    work: tuple[float, float]
    travel: tuple[float, float]
    pose_travel: float
    pose_work: float
    axis_angle: float

    @property
    def angles_at_pose(self) -> tuple[float, float, float]:
        """The angles without the ranges."""
        return self.pose_travel, self.pose_work, self.axis_angle


@dataclass(frozen=True)
class PoseFreedom:
    """Freedom of a pose: the tool may turn about its z axis, tilt that axis, and move its TCP.

    Attributes:
        turn: Minimum and maximum turn from the pose [rad]; infinite if unlimited.
        tilt: Maximum angle of the tool's z axis to that of the pose [rad].
        box: Minimum and maximum position along each axis of the pose [m].
        torch: Ranges of a torch's angles to its seam, or `None`.
    """

    turn: tuple[float, float] = (0.0, 0.0)
    tilt: float = 0.0
    box: tuple[tuple[float, float], ...] = ((0.0, 0.0),) * 3
    torch: TorchRanges | None = None

    @property
    def position_is_free(self) -> bool:
        """Whether the TCP may leave the position of the pose."""
        return any(low < high for low, high in self.box)

    def is_within(self, other: PoseFreedom | None) -> bool:
        """Whether another freedom allows every pose that this one allows.

        >>> PoseFreedom((-0.1, 0.1)).is_within(PoseFreedom((-0.2, 0.2), tilt=0.1))
        True
        """
        if other is None or (self.torch is None) != (other.torch is None):
            return self == other
        pairs = [(self.turn, other.turn), *zip(self.box, other.box, strict=True)]
        if self.torch is not None and other.torch is not None:
            if self.torch.angles_at_pose != other.torch.angles_at_pose:
                return False
            pairs.append((self.torch.work, other.torch.work))
            pairs.append((self.torch.travel, other.torch.travel))
        is_inside = all(b[0] <= a[0] and a[1] <= b[1] for a, b in pairs)
        return is_inside and self.tilt <= other.tilt


@dataclass(frozen=True, eq=False)
class CartesianWaypoint:
    """A pose that the tool must reach at a time, with its velocity there.

    Pose and twist are in the robot's base frame, or both are in the world frame.

    Attributes:
        name: Name of the waypoint.
        time: Time [s].
        pose: Pose of the tool centre point (TCP) [m]. The waypoint keeps a copy.
        twist: Velocity of the tool at the TCP, in the axes of that frame (`local_world_aligned`)
            [m/s, rad/s].
        where: Location of its definition, for messages.
        freedom: Freedom of the pose, or `None`.
        in_world_frame: Whether pose and twist are in the world frame (`Robot.world_frame`), not in
            the base frame. They differ only if joints move the base frame.

    Raises:
        WaypointDataError: The pose is not a `pin.SE3`, the twist not a `pin.Motion`, a value is not
            finite, or the pose's rotation is not a rotation matrix.

    >>> import pinocchio as pin
    >>> pose = pin.SE3(pin.rpy.rpyToMatrix(0, 3.14, 0), np.array([0.4, 0.1, 0.3]))
    >>> CartesianWaypoint("on", 1.5, pose, pin.Motion.Zero()).position
    array([0.4, 0.1, 0.3])
    """

    name: str
    time: float
    pose: pin.SE3
    twist: pin.Motion
    where: str = ""
    freedom: PoseFreedom | None = None
    in_world_frame: bool = False

    def __post_init__(self) -> None:
        import pinocchio as pin

        for part, kind in (("pose", pin.SE3), ("twist", pin.Motion)):
            value = getattr(self, part)
            if not isinstance(value, kind):
                raise WaypointDataError(
                    f"{self.name}: {part} must be a pin.{kind.__name__}, not {value!r}"
                )
            object.__setattr__(self, part, value.copy())
        try:
            checked_array(self.pose.homogeneous, (4, 4), f"{self.name}: pose")
            checked_array(self.twist.vector, (6,), f"{self.name}: twist")
            checked_array(self.time, (), f"{self.name}: time")
        except ArrayError as error:
            raise WaypointDataError(str(error), value=error.value) from error
        if fault := rotation_error(self.pose.rotation, 1e-9):
            raise WaypointDataError(f"{self.name}: pose has no rotation matrix: {fault}")

    @property
    def position(self) -> FloatArray:
        """TCP position [m], shape (3,)."""
        return np.array(self.pose.translation)

    @property
    def rotation(self) -> FloatArray:
        """Rotation matrix of the tool, shape (3, 3)."""
        return np.array(self.pose.rotation)

    @property
    def linear(self) -> FloatArray:
        """Linear velocity of the TCP [m/s], shape (3,)."""
        return np.array(self.twist.linear)

    @property
    def angular(self) -> FloatArray:
        """Angular velocity of the tool [rad/s], shape (3,)."""
        return np.array(self.twist.angular)


@dataclass(frozen=True, eq=False)
class JointWaypoints(ReadOnlyArrays):
    """Joint positions and velocities at given times.

    Attributes:
        joint_names: Names of the joints, length d.
        time: Times [s], shape (n,), n >= 2, strictly increasing.
        position: Joint positions [rad or m], shape (n, d).
        velocity: Joint velocities [rad/s or m/s], shape (n, d).
        names: Names of the waypoints, length n; by default `"waypoint 1"` and so on.
        joint_units: `"rad"` or `"m"` for each joint; by default all `"rad"`.
        acceleration: Known joint accelerations, for example along a tool path or during a wait
            [rad/s² or m/s²], shape (n, d), NaN where unknown; or `None`.
        waypoint_rows: Row of each waypoint of the scenario, in order; the other rows were inserted
            along tool paths. By default every row is that of a waypoint.

    Raises:
        WaypointDataError: Shapes do not match, values are not finite, times not increasing,
            accelerations are given for some joints only, or a joint name occurs twice.

    >>> JointWaypoints(("a", "b"), [0, 1], [[0, 0], [1, 2]], [[0, 0], [0, 0]]).joint_units
    ('rad', 'rad')
    """

    joint_names: tuple[str, ...]
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    names: tuple[str, ...] = ()
    joint_units: tuple[str, ...] = ()
    acceleration: FloatArray | None = None
    waypoint_rows: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        def put(attribute: str, value: Any) -> None:
            object.__setattr__(self, attribute, value)

        names, units = checked_joints(self.joint_names, self.joint_units)
        put("joint_names", names)
        put("joint_units", units)
        put("time", checked_times(self.time, self.names or None))
        shape = (len(self.time), len(names))
        put("position", checked_rows(self.position, shape, "position"))
        put("velocity", checked_rows(self.velocity, shape, "velocity"))
        put("names", tuple(self.names) or tuple(map(default_waypoint_name, range(shape[0]))))
        put("waypoint_rows", tuple(self.waypoint_rows) or tuple(range(shape[0])))
        if len(self.names) != shape[0]:
            raise WaypointDataError(f"names must have length {shape[0]}")
        if self.acceleration is not None:
            put(
                "acceleration",
                checked_rows(self.acceleration, shape, "acceleration", unknown=True),
            )
            check_known_rows(self.acceleration, self.names)


@dataclass(frozen=True, eq=False)
class ChosenSection(ReadOnlyArrays):
    """A section with a given motion: accelerations at its knots, linear between them.

    Attributes:
        times: Times of the knots, the waypoints among them [s], shape (m,), m >= 4.
        acceleration: Accelerations at the knots [rad/s² or m/s²], shape (m, d).
        velocity: Joint velocities [rad/s or m/s], shape (d,), at waypoints without a given one, by
            index of the scenario's waypoint.

    Raises:
        WaypointDataError: Shapes do not match, values are not finite, or times not increasing.
    """

    times: FloatArray
    acceleration: FloatArray
    velocity: Mapping[int, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", checked_times(self.times, subject="knot"))
        shape = (len(self.times), *np.shape(self.acceleration)[1:2])
        object.__setattr__(
            self, "acceleration", checked_rows(self.acceleration, shape, "acceleration")
        )
