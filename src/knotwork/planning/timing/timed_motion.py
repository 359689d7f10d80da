"""Results of a timing problem: `TimedCurve`, and `TimedMotion` with its figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from knotwork.arrays import FloatArray, ReadOnlyArrays
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.planning.timing.active_limits import ActiveLimit, find_active_limits
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.verification import metrics

Status = Literal["optimal", "resting", "budget"]


def worst_status(statuses: Iterable[Status]) -> Status:
    """The worst status among the sections of a motion, which is that of the motion."""
    return max(statuses, key=("optimal", "resting", "budget").index, default="optimal")


@dataclass(frozen=True, eq=False)
class TimedCurve:
    """A motion that keeps every limit of a `TimingProblem`, without the figures of `TimedMotion`.

    Attributes:
        time: Times of the waypoints from 0 on [s], shape (n,).
        curve: Joint positions over time.
        status: Status, see `TimedMotion`.
    """

    time: FloatArray
    curve: PiecewisePolynomial
    status: Status


@dataclass(frozen=True, eq=False)
class TimedMotion(ReadOnlyArrays):
    """Solution of a `TimingProblem`: a motion that keeps every limit, with optimised durations.

    Attributes:
        trajectory: Joint trajectory: cubic, C2, from time 0 on.
        time: Times of the waypoints [s], shape (n,).
        velocity: Joint velocities at the waypoints, chosen or given, shape (n, d).
        lower_bound: Lower bound on the duration of motions through these waypoints within the
            limits [s].
        status: `"optimal"`; `"budget"` if the budget ended first, so a better motion may exist; or
            `"resting"` if the arm comes to rest in each interval, because the solver did not
            converge or hardly any gain was possible.
        active_limits: Limits that are active in each interval, the longest first.
        objective_values: Value of each term without its weight, by name: `"time"` [s], and the
            integrals that have a weight.
        iterations: Number of solver steps.
        line: Corners of the polyline from which a collision-free motion was planned, shape (m, d);
            otherwise `None`.
        tries: Number of searches for a collision-free motion.
        extra_clearance: Clearance of a collision-free motion beyond the margins [m]; `None` if not
            requested.
    """

    trajectory: JointTrajectory
    time: FloatArray
    velocity: FloatArray
    lower_bound: float
    status: Status = "optimal"
    active_limits: Sequence[ActiveLimit] = ()
    objective_values: Mapping[str, float] = field(default_factory=dict)
    iterations: int = 0
    line: FloatArray | None = None
    tries: int = 0
    extra_clearance: float | None = None

    @classmethod
    def of(
        cls, problem: TimingProblem, motion: TimedCurve, lower_bound: float, origin: str
    ) -> TimedMotion:
        """A motion that keeps the limits of a problem, with its figures.

        Args:
            problem: The waypoints and the limits.
            motion: The motion.
            lower_bound: Lower bound on the duration [s].
            origin: Source of the motion, see `JointTrajectory`.
        """
        time, curve = motion.time, motion.curve
        trajectory = JointTrajectory(
            problem.joint_names,
            curve,
            joint_units=problem.joint_units,
            origin=origin,
            waypoint_times=time,
        )
        return cls(
            trajectory,
            time=time,
            velocity=np.where(problem.velocity_known[:, None], problem.velocity, curve(time, 1)),
            lower_bound=lower_bound,
            status=motion.status,
            active_limits=find_active_limits(problem, time, curve),
            objective_values=_objective_values(problem, trajectory),
        )

    @property
    def duration(self) -> float:
        """Time from the first waypoint to the last [s]."""
        return float(self.time[-1] - self.time[0])


def _objective_values(problem: TimingProblem, motion: JointTrajectory) -> dict[str, float]:
    """Unweighted values by name: the time, and the other terms with a weight.

    The integrals run over the motion and are summed over the joints.
    """
    values, objective = {"time": motion.duration}, problem.objective
    if objective.jerk:
        values["jerk"] = metrics.integral_of_square(motion, 3)
    if objective.acceleration:
        values["acceleration"] = metrics.integral_of_square(motion, 2)
    if objective.effort:
        values["effort"] = metrics.squared_effort(problem.required_dynamics.robot, motion)
    return values
