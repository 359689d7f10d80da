"""Results: waypoints at the joints, the solutions chosen for them, and the reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from knotwork.waypoints import FloatArray, JointWaypoints

if TYPE_CHECKING:
    from knotwork.kinematics.following.joint_field import Pull
    from knotwork.robot import Robot

Step: TypeAlias = tuple[int, FloatArray, FloatArray]
"""Interval between two waypoints, and joint positions at its ends [rad or m], shape (d,) each."""


@dataclass(frozen=True)
class Choice:
    """The solution chosen at a waypoint given by a pose.

    Attributes:
        waypoint: Name of the waypoint.
        branch: What its branch is called, for example `shoulder left, elbow up, no flip`; empty
            where branches have no names.
        turns: Joint and whole turns away from within half a turn of zero, where there are any.
        branches: Branches inside the limits; for an arm that moves freely at the pose, samples.
        solutions: Solutions inside the limits, turns counted.
        sampled: The arm moves freely at the pose.
        reason: Why this one.
    """

    waypoint: str
    branch: str
    turns: tuple[tuple[str, int], ...]
    branches: int
    solutions: int
    sampled: bool
    reason: str


class PathStart(NamedTuple):
    """How the arm comes onto a path.

    Attributes:
        robot: With the virtual joints of what its poses leave open, which are the last.
        q: Joint positions where it begins [rad or m], shape (d,).
        pull: What self-motion follows along it.
    """

    robot: Robot
    q: FloatArray
    pull: Pull


@dataclass(frozen=True, eq=False)
class TaskSolution:
    """Waypoints at the joints, and how they were chosen.

    Attributes:
        waypoints: Joint positions and velocities.
        feasible: Whether joints keep velocity limits at waypoints and in the mean between.
        choices: The solutions chosen at the waypoints given by poses, in order.
        sequence: Joint positions at the scenario's waypoints [rad or m], with the virtual joints of
            its poses, shape (n, d); `None` if no other ones may be feasible and clear.
        starts: Of tool paths that begin at a pose, by their first waypoint.
    """

    waypoints: JointWaypoints
    feasible: bool = True
    choices: tuple[Choice, ...] = ()
    sequence: FloatArray | None = None
    starts: Mapping[int, PathStart] = field(default_factory=dict, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Give the choices as plain data, ready for JSON."""
        choices = []
        for choice in self.choices:
            data = asdict(choice)
            data["turns"] = dict(choice.turns)
            choices.append(data)
        return {"choices": choices, "feasible": self.feasible}
