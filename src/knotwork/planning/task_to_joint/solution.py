"""Results: joint waypoints, the solutions chosen for them, and the reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from knotwork.waypoints import FloatArray, JointWaypoints

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.robot.kinematics.following.joint_field import Pull

SequenceStep: TypeAlias = tuple[int, FloatArray, FloatArray]
"""Interval between two waypoints, and joint positions at its ends [rad or m], shape (d,) each."""


@dataclass(frozen=True)
class Choice:
    """The solution chosen at a waypoint given by a pose.

    Attributes:
        waypoint: Name of the waypoint.
        branch: Name of the branch, for example `shoulder left, elbow up, no flip`; empty where
            branches have no names.
        turns: Whole turns of the joints that are not within half a turn of zero, by joint.
        branches: Number of branches inside the limits; for a redundant arm, of samples.
        solutions: Number of solutions inside the limits, turns included.
        sampled: The arm is redundant at the pose.
    """

    waypoint: str
    branch: str
    turns: Mapping[str, int]
    branches: int
    solutions: int
    sampled: bool


@dataclass(frozen=True)
class Infeasibility:
    """A velocity limit that is exceeded with every choice of solutions.

    At a waypoint the velocity of the tool is too high, in an interval the mean velocity of a joint.

    Attributes:
        waypoint: Name of the waypoint, or of the first waypoint of the interval.
        until: Name of the waypoint where the interval ends; empty at a waypoint.
        start: Time of the waypoint, or start of the interval [s].
        end: End of the interval [s]; at a waypoint equal to `start`.
        joint: The joint with the largest relative excess.
        velocity: The speed that the joint needs [rad/s or m/s].
        limit: The joint's velocity limit [rad/s or m/s].
        unit: `rad/s` or `m/s`.
    """

    waypoint: str
    until: str
    start: float
    end: float
    joint: str
    velocity: float
    limit: float
    unit: str

    @property
    def fraction(self) -> float:
        """The feasible fraction of the velocity."""
        return self.limit / self.velocity


class PathStart(NamedTuple):
    """The arm at the start of a path.

    Attributes:
        robot: The arm followed by the virtual joints of the path's freedom.
        q: Joint positions at the start [rad or m], shape (d,).
        pull: Target of the self-motion along the path.
    """

    robot: Robot
    q: FloatArray
    pull: Pull


@dataclass(frozen=True, eq=False)
class TaskSolution:
    """Waypoints at the joints, and how they were chosen.

    Attributes:
        waypoints: Joint positions and velocities.
        infeasibilities: Velocity limits that are exceeded with every choice of solutions.
        choices: The solutions chosen at the waypoints given by poses, in order.
        sequence: Joint positions at the scenario's waypoints [rad or m], with the virtual joints of
            its poses, shape (n, d). It is `None` if no other sequence may be feasible and
            collision-free.
        starts: Starts of tool paths that begin at a pose, by index of their first waypoint.
    """

    waypoints: JointWaypoints
    infeasibilities: tuple[Infeasibility, ...] = ()
    choices: tuple[Choice, ...] = ()
    sequence: FloatArray | None = None
    starts: Mapping[int, PathStart] = field(default_factory=dict, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Give the choices and infeasibilities as plain data, ready for JSON."""
        infeasible = [
            {**asdict(infeasibility), "fraction": infeasibility.fraction}
            for infeasibility in self.infeasibilities
        ]
        choices = [asdict(choice) for choice in self.choices]
        return {"choices": choices, "infeasibilities": infeasible}
