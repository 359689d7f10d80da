"""Results: waypoints at the joints, the solutions chosen for them, and the reasons."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import asdict, dataclass, field
from typing import Any

from knotwork.waypoints import IndexArray, JointWaypoints


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


@dataclass(frozen=True)
class Infeasibility:
    """A velocity limit that is exceeded however the solutions are chosen.

    At a waypoint the tool's velocity is too high; in an interval the mean velocity of a joint.

    Attributes:
        waypoint: Name of the waypoint, or of the one where the interval begins.
        until: Name of the waypoint where the interval ends; empty at a waypoint.
        start: Time of the waypoint, or where the interval begins [s].
        end: Where the interval ends [s]; at a waypoint the same as `start`.
        joint: The joint that is farthest beyond its limit.
        velocity: The speed it needs [rad/s or m/s].
        limit: Its velocity limit [rad/s or m/s].
        unit: `rad/s` or `m/s`.
        sentence: All of it in words, with every joint beyond its limit and what is feasible.
    """

    waypoint: str
    until: str
    start: float
    end: float
    joint: str
    velocity: float
    limit: float
    unit: str
    sentence: str

    @property
    def fraction(self) -> float:
        """The part of the velocity that is feasible."""
        return self.limit / self.velocity

    def __str__(self) -> str:
        return self.sentence


@dataclass(frozen=True, eq=False)
class TaskSolution:
    """Waypoints at the joints, and how they were chosen.

    Attributes:
        waypoints: Joint positions and velocities.
        rows: Which of them are those of the scenario, by index, shape (n,).
        infeasibilities: Velocity limits that are exceeded however the solutions are chosen.
        choices: The solutions chosen at the waypoints given by poses, in order.
    """

    waypoints: JointWaypoints
    rows: IndexArray
    infeasibilities: tuple[Infeasibility, ...] = ()
    choices: tuple[Choice, ...] = ()
    _avoid: Callable[[Collection[int]], TaskSolution | None] | None = field(
        default=None, repr=False
    )

    def __getstate__(self) -> dict[str, Any]:
        """The state to copy or pickle: without the search."""
        return {**self.__dict__, "_avoid": None}

    def avoiding(self, intervals: Collection[int]) -> TaskSolution | None:
        """The next best solution, without the steps that this one takes on some intervals.

        Steps that were given up before stay so.

        Args:
            intervals: Indices of the waypoints where they begin.

        Returns:
            It, or `None` if there is no other that may be feasible and clear.
        """
        if self._avoid is None:
            return None
        return self._avoid(intervals)

    def to_dict(self) -> dict[str, Any]:
        """Give the choices and infeasibilities as plain data, ready for JSON."""
        choices = []
        for choice in self.choices:
            data = asdict(choice)
            data["turns"] = dict(choice.turns)
            choices.append(data)
        infeasible = [{**asdict(one), "fraction": one.fraction} for one in self.infeasibilities]
        return {"choices": choices, "infeasibilities": infeasible}
