"""The checked motion: its curve in the order of the scenario's joints."""

from __future__ import annotations

from knotwork.errors.plain_text import waypoint_text
from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.trajectory import JointTrajectory

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


def place_of_time(scenario: Scenario, time: float) -> str:
    """Text of the position of a time among the waypoints."""
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
