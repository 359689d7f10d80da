"""The checked motion: its curve in the order of the scenario's joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors.plain_text import waypoint_text
from knotwork.task.scenario import Scenario, Stretch
from knotwork.task.scenario.joint_space import JointSpace

AT_WAYPOINT = 1e-6
"""Times within this of a waypoint [s] are at the waypoint."""

OUTSIDE = "outside the waypoints"


class Motion:
    """The motion to check, shared by all checks.

    >>> plan = kw.plan("paper_case")
    >>> motion = kw.verification.Motion(plan.trajectory, plan.space)
    >>> motion.end_time, motion.curve(25.0)
    (25.0, array([3.14159265]))

    Attributes:
        trajectory: The trajectory.
        curve: Joint positions, trailing shape (d,), joints in the order of the joint space.
    """

    def __init__(self, trajectory: JointTrajectory, space: JointSpace) -> None:
        self.trajectory = trajectory
        self.curve: PiecewisePolynomial = trajectory.reordered(
            space.joint_names, space.joint_units
        ).polynomial

    @property
    def start_time(self) -> float:
        """Start time [s]."""
        return float(self.curve.x[0])

    @property
    def end_time(self) -> float:
        """End time [s]."""
        return float(self.curve.x[-1])


class Arrival(NamedTuple):
    """A waypoint that an executed motion reaches, or one of its ends.

    Attributes:
        time: Time in this motion [s].
        name: Its name.
        waypoint: Index in the scenario; -1 for an end of the motion between waypoints.
    """

    time: float
    name: str
    waypoint: int = -1


@dataclass(frozen=True, eq=False)
class Execution:
    """A planned motion executed with another clock, or left early by a stop.

    Attributes:
        motion: The executed motion of the joints.
        clock: Time of the planned motion over that of the executed one; constant if it leaves the
            path.
        arrivals: Its ends and the waypoints that it passes, in order of time.
    """

    motion: PiecewisePolynomial
    clock: PiecewisePolynomial
    arrivals: Sequence[Arrival]

    @property
    def ends(self) -> tuple[str, str]:
        """Names of its ends."""
        return self.arrivals[0].name, self.arrivals[-1].name

    @property
    def span(self) -> tuple[float, float]:
        """Time interval of the planned motion that is executed [s]."""
        start, end = self.clock(self.clock.x[[0, -1]]).tolist()
        return start, end

    @property
    def is_on_path(self) -> bool:
        """Whether it follows the planned motion."""
        return self.span[0] < self.span[1]

    @property
    def waypoint_times(self) -> dict[int, float]:
        """Times [s] of the waypoints that it passes, by index in the scenario."""
        return {waypoint: time for time, _, waypoint in self.arrivals if waypoint >= 0}

    def stretch(
        self, stretch: Stretch, waypoint: int, names: tuple[str, str]
    ) -> tuple[tuple[str, str], Stretch]:
        """Ends and executed part of a stretch of a tool path, at any speed; it may be empty.

        Args:
            stretch: The stretch.
            waypoint: Index in the scenario of the waypoint at its start.
            names: Names of the waypoints at its ends.
        """
        start, end = self.clock.x[[0, -1]].tolist()
        (first, last), times = self.span, self.waypoint_times
        if stretch.end <= first or last <= stretch.start:
            return names, replace(stretch, start=start, end=start)
        executed_names = (
            names[0] if waypoint in times else self.ends[0],
            names[1] if waypoint + 1 in times else self.ends[1],
        )
        executed = replace(
            stretch,
            start=times.get(waypoint, start),
            end=times.get(waypoint + 1, end),
            speed=np.inf,
            full_speed_interval=(np.inf, np.inf),
        )
        return executed_names, executed


def describe_time(scenario: Scenario, time: float) -> str:
    """The waypoint at a time [s], or the two around it, as text."""
    before = None
    for waypoint in scenario.waypoints:
        if abs(waypoint.time - time) <= AT_WAYPOINT:
            return f"at {waypoint_text(waypoint.name)}"
        if waypoint.time > time:
            if before is None:
                break
            return f"between {before!r} and {waypoint.name!r}"
        before = waypoint.name
    return OUTSIDE
