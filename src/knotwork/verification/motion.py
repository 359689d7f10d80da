"""The motion that checks look at: its curve in the order of the scenario's joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from knotwork.joint_space import JointSpace
from knotwork.polynomial import PiecewisePolynomial
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

SAMPLES = 500
"""What can't be found from the polynomials is looked at this often, and at every break."""


@dataclass(frozen=True, eq=False)
class Samples:
    """A motion at sampled times.

    Attributes:
        time: [s], shape (n,).
        q: Joint positions [rad or m], shape (n, d).
        v: Joint velocities [rad/s or m/s], shape (n, d).
        a: Joint accelerations [rad/s² or m/s²], shape (n, d).
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray


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

    @cached_property
    def samples(self) -> Samples:
        """The motion at `SAMPLES` even times and at every break."""
        regular = np.linspace(self.start_time, self.end_time, SAMPLES)
        time = np.sort(np.concatenate([regular, self.curve.x]))
        return Samples(time, self.curve(time), self.curve(time, 1), self.curve(time, 2))
