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
"""A time within this distance of a waypoint's [s] is at the waypoint."""

OUTSIDE = "outside the waypoints"


class Motion:
    """The motion to check, shared by all checks.

    >>> plan = kw.plan("paper_case")
    >>> motion = kw.verification.Motion(plan.trajectory, plan.space)
    >>> motion.end_time, motion.curve(25.0)
    (25.0, array([3.14159265]))

    Attributes:
        trajectory: The motion with its own names and order of joints.
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
    """A waypoint that an executed motion reaches, or an end of that motion.

    Attributes:
        time: Time in the executed motion [s].
        name: Name of the waypoint or the end.
        waypoint: Index of the waypoint in the scenario; -1 for an end between waypoints.
    """

    time: float
    name: str
    waypoint: int = -1


@dataclass(frozen=True, eq=False)
class Execution:
    """A planned motion executed with another clock, or left early by a stop.

    Attributes:
        motion: The executed motion of the joints.
        clock: Time in the planned motion as a function of time in the executed one; constant if the
            executed motion leaves the planned path.
        arrivals: Ends of the executed motion and the waypoints that it passes, in order of time.
    """

    motion: PiecewisePolynomial
    clock: PiecewisePolynomial
    arrivals: Sequence[Arrival]

    @property
    def ends(self) -> tuple[str, str]:
        """Names of the two ends of the executed motion."""
        return self.arrivals[0].name, self.arrivals[-1].name

    @property
    def span(self) -> tuple[float, float]:
        """The interval of the planned motion that is executed [s]."""
        start, end = self.clock(self.clock.x[[0, -1]]).tolist()
        return start, end

    @property
    def is_on_path(self) -> bool:
        """Whether the executed motion follows the planned path."""
        return self.span[0] < self.span[1]

    @property
    def waypoint_times(self) -> dict[int, float]:
        """Times in the executed motion [s] of the waypoints that it passes, by index."""
        return {waypoint: time for time, _, waypoint in self.arrivals if waypoint >= 0}

    def executed_stretch(
        self, stretch: Stretch, waypoint: int, names: tuple[str, str]
    ) -> tuple[tuple[str, str], Stretch]:
        """Names of the ends of a stretch's executed part, and that part, possibly empty.

        Its speed is infinite, which means that any speed is accepted.

        Args:
            stretch: A stretch of a tool path in the planned motion.
            waypoint: Index in the scenario of the waypoint at its start.
            names: Names of the waypoints at both ends.
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
    """Name the waypoint at a time [s], or the two waypoints before and after it."""
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
