"""The checked motion: its curve in the order of the scenario's joints."""

from __future__ import annotations

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors.plain_text import quoted_waypoint, waypoint_text
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints

AT_WAYPOINT = 1e-6
"""Difference of times within which a time is at a waypoint [s]."""

TIME_ROUNDING = 1e-9
"""Relative rounding tolerance of times."""
MAX_TIME_SLACK = 1e-6
"""Maximum rounding tolerance of times [s], unless their floating-point resolution is coarser."""


class Motion:
    """The motion to check, shared by all checks.

    >>> plan = kw.plan("paper_case")
    >>> motion = kw.verification.Motion(plan.trajectory, plan.joints)
    >>> motion.end_time, motion.curve(25.0)
    (25.0, array([3.14159265]))

    Attributes:
        trajectory: The motion with its own names and order of joints.
        curve: Joint positions, trailing shape (d,), joints in the order of `joints`.
    """

    def __init__(self, trajectory: JointTrajectory, joints: ScenarioJoints) -> None:
        self.trajectory = trajectory
        self.curve: PiecewisePolynomial = trajectory.reordered(
            joints.joint_names, joints.joint_units
        ).polynomial

    @property
    def start_time(self) -> float:
        """Start time [s]."""
        return float(self.curve.x[0])

    @property
    def end_time(self) -> float:
        """End time [s]."""
        return float(self.curve.x[-1])


def time_slack(*times: float) -> float:
    """Difference that rounding explains between one of these times and the same in a file [s]."""
    largest = max(1.0, *map(abs, times))
    return float(max(min(TIME_ROUNDING * largest, MAX_TIME_SLACK), 8.0 * np.spacing(largest)))


def describe_time(scenario: Scenario, time: float) -> str:
    """Name the waypoint at a time [s], or the two before and after it, in a clause."""
    before = None
    for waypoint in scenario.waypoints:
        if abs(waypoint.time - time) <= AT_WAYPOINT:
            return f"at {waypoint_text(waypoint.name)}"
        if waypoint.time > time:
            if before is None:
                break
            return f"between {quoted_waypoint(before)} and {quoted_waypoint(waypoint.name)}"
        before = waypoint.name
    return "outside the waypoints"
