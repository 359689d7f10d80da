"""The motion that checks look at: its curve in the order of the scenario's joints."""

from __future__ import annotations

from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.trajectory import JointTrajectory


class Motion:
    """What is checked; every check is given the same.

    Attributes:
        trajectory: As it was given.
        curve: Joint positions, trailing shape (d,), joints in the order of the joint space.
    """

    def __init__(self, trajectory: JointTrajectory, space: JointSpace) -> None:
        self.trajectory = trajectory
        self.curve: PiecewisePolynomial = trajectory.reordered(
            space.joint_names, space.joint_units
        ).polynomial

    @property
    def start_time(self) -> float:
        """When it begins [s]."""
        return float(self.curve.x[0])

    @property
    def end_time(self) -> float:
        """When it ends [s]."""
        return float(self.curve.x[-1])
