"""The checked motion: its curve in the order of the scenario's joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

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


@dataclass(frozen=True, eq=False)
class Execution:
    """The other clock by which a motion executes a task, or a part of it.

    Attributes:
        clock: Time of the task over that of the motion [s].
        arrivals: Times in the motion [s] at which waypoints are passed, by index in the scenario.
        ends: Names of the ends of the motion, where the task has no waypoint.
    """

    clock: PiecewisePolynomial
    arrivals: Mapping[int, float]
    ends: tuple[str, str]

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
        first, last = self.clock(self.clock.x[[0, -1]]).tolist()
        if stretch.end <= first or last <= stretch.start:
            return names, replace(stretch, start=start, end=start)
        executed_names = (
            names[0] if waypoint in self.arrivals else self.ends[0],
            names[1] if waypoint + 1 in self.arrivals else self.ends[1],
        )
        executed = replace(
            stretch,
            start=self.arrivals.get(waypoint, start),
            end=self.arrivals.get(waypoint + 1, end),
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
