"""Variants of a robot: other limits, loads, weights or gravity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from knotwork.errors import RobotError, UnknownNameError
from knotwork.robot.chain_kinematics import ChainKinematics
from knotwork.robot.description import Description, VirtualJoint
from knotwork.robot.joint_limits import limit_tables
from knotwork.robot.payload import Payload
from knotwork.waypoints import read_only

if TYPE_CHECKING:
    from typing_extensions import Self


class Variants(ChainKinematics):
    """Methods that make variants of a robot; the attributes are those of `Robot`."""

    locked: Mapping[str, float]

    def __init__(self, description: Description) -> None:
        self._given = description

    def _replace(self, **changes: Any) -> Self:
        return type(self)(replace(self._given, **changes))

    def with_held(self, *held: Payload) -> Self:
        """The arm with objects held by its tool, in the axes of the TCP; they count in `torque`."""
        self.require_tool()
        return self._replace(held=held)

    def with_virtual_joints(self, *joints: VirtualJoint) -> Self:
        """The chain with virtual joints after the TCP, which move its frame.

        They are last in all arrays, and have no mass and only position limits.
        """
        self.require_tool()
        return self._replace(virtual=joints)

    def with_weights(self, weights: Mapping[str, float]) -> Self:
        """Set weights of the motion of joints.

        They affect the minimum norm of joint velocities of a redundant arm, and the travel by which
        solutions are chosen. A joint with a weight of 0.2 moves more.

        Args:
            weights: Weight of each joint; 1 for others.

        Raises:
            UnknownNameError: There is no such joint.
            RobotError: A joint does not move.

        >>> arm = kw.load_robot("ur5_rail")
        >>> eager, q = arm.with_weights({"rail": 0.2}), arm.configuration("home")
        >>> twist = [0, 0.1, 0, 0, 0, 0]
        >>> [kw.solve_velocity_ik(one, q, twist)[:2].round(3) for one in (arm, eager)]
        [array([0.067, 0.068]), array([0.098, 0.004])]
        """
        for name in weights:
            if name in self.locked:
                raise RobotError(
                    self.name,
                    f"joint {name!r} does not move: it is locked, or no pose is on what it "
                    f"carries; joints that move: {', '.join(self.joint_names)}",
                    joint=name,
                )
            if name not in self.joint_names:
                raise UnknownNameError(
                    "joint", name, self.joint_names, where=f"robot {self.name!r}"
                )
        return self._replace(weights=dict(weights))

    def with_rest(self, name: str) -> Self:
        """Set the joints that are not planned to a named configuration.

        Joints under `locked` in its file, and joints that mimic others, are unchanged.

        Raises:
            RobotError: Another configuration of the task has a joint at another position, or a
                position is outside the limits.
        """
        description, rest = self._given, dict(self._given.rest)
        for joint, value in description.configurations[name].items():
            if (
                joint in self.joint_names
                or joint in description.locked
                or joint in description.urdf.mimics
            ):
                continue
            if rest.setdefault(joint, value) != value:
                raise RobotError(
                    self.name,
                    f"configuration {name!r} has joint {joint!r} at {value:g}, another one of the "
                    f"task at {rest[joint]:g}, and nothing in the task moves it; accepted: the "
                    "same position in both, or a pose on what it carries",
                    joint=joint,
                )
        return self if rest == description.rest else self._replace(rest=rest)

    def with_gravity(self, gravity: ArrayLike) -> Self:
        """Mount the robot differently: on a wall, on a ceiling, or without gravity.

        Args:
            gravity: Gravity in the axes of the base frame [m/s²], shape (3,).

        Raises:
            WaypointDataError: The value is not three finite numbers.

        >>> hanging = kw.load_robot("ur5").with_gravity([0, 0, 9.81])
        >>> still = np.zeros(6)
        >>> hanging.torque(still, still, still)[1:3].round(1)
        array([59.2, 15.7])
        """
        return self._replace(gravity=read_only(gravity, (3,), "gravity"))

    def with_limits(
        self,
        position: Mapping[str, tuple[float, float]] | None = None,
        **magnitudes: float | Mapping[str, float] | None,
    ) -> Self:
        """Override limits, each by joint or as one number for all joints.

        Args:
            position: Joint to lower and upper limit [rad or m].
            magnitudes: `velocity` [rad/s or m/s], `acceleration` [rad/s² or m/s²], `jerk`
                [rad/s³ or m/s³], `effort` [N m or N].

        Raises:
            UnknownNameError: The robot has no such joint or limit.
            RobotError: A magnitude isn't positive, or lower isn't below upper.

        >>> kw.load_robot("planar2").with_limits(velocity={"elbow": 0.5}).velocity_limit
        array([3. , 0.5])
        """
        limits, old = {"position": position, **magnitudes}, self._given.limits
        new = limit_tables(limits, self.joint_names, self._given.urdf, self.name)
        merged = {kind: {**old.get(kind, {}), **table} for kind, table in new.items()}
        return self._replace(limits={**old, **merged})
