"""Results: joint waypoints, the solutions chosen for them, and the reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from knotwork.arrays import FloatArray
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.task_to_joint.path_track import PathTrack
    from knotwork.verification import Finding

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
        branches: Number of branches inside the limits, or of samples.
        solutions: Number of solutions inside the limits, turns included.
        sampled: The pose has infinitely many solutions, or very many, and samples were compared.
    """

    waypoint: str
    branch: str
    turns: Mapping[str, int]
    branches: int
    solutions: int
    sampled: bool


@dataclass(frozen=True, eq=False)
class TaskSolution:
    """Waypoints at the joints, and how they were chosen.

    Attributes:
        waypoints: Joint positions and velocities.
        infeasibilities: Failures of velocity limits that are exceeded with every choice of
            solutions.
        choices: The solutions chosen at the waypoints given by poses, in order.
        sequence: Joint positions at the scenario's waypoints [rad or m], with the virtual joints of
            its poses, shape (n, d). It is `None` if no other sequence is better.
        collisions: Number of solutions and steps in it that collide or are blocked.
        tracks: Tracks of the tool paths with the motion along each, by index of its first waypoint.
    """

    waypoints: JointWaypoints
    infeasibilities: tuple[Finding, ...] = ()
    choices: tuple[Choice, ...] = ()
    sequence: FloatArray | None = None
    collisions: int = 0
    tracks: Mapping[int, PathTrack] = field(default_factory=dict, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Give the choices as plain data, ready for JSON."""
        return {"choices": [asdict(choice) for choice in self.choices]}
