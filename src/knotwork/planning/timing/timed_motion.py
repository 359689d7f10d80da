"""Result of a timing problem."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from knotwork.arrays import FloatArray, ReadOnlyArrays
from knotwork.curves.trajectory import JointTrajectory

Status = Literal["optimal", "resting", "budget"]


def worst_status(statuses: Iterable[Status]) -> Status:
    """The worst status among the sections of a motion, which is that of the motion."""
    return max(statuses, key=("optimal", "resting", "budget").index, default="optimal")


@dataclass(frozen=True)
class ActiveLimit:
    """An active limit of an interval.

    Attributes:
        start, end: Names of the waypoints at the ends of the interval.
        subject: Name of the joint or link; empty for the tool and for other bounds.
        quantity: `"velocity"`, `"acceleration"`, `"jerk"`, `"position"`, `"effort"` or
            `"tool_speed"`; for a speed along a path also other bounds.
        share: Fraction of the interval's duration in which the limit is active. It is 0 if a peak
            is only near the limit, and `None` for a bound on a constant speed along a path.
    """

    start: str
    end: str
    subject: str
    quantity: str
    share: float | None


@dataclass(frozen=True, eq=False)
class TimedMotion(ReadOnlyArrays):
    """Solution of a `TimingProblem`: a motion that keeps every limit, with optimised durations.

    Attributes:
        trajectory: Joint trajectory: cubic, C2, from time 0 on.
        time: Times of the waypoints [s], shape (n,).
        velocity: Joint velocities at the waypoints, chosen or given, shape (n, d).
        lower_bound: Lower bound on the duration of motions through these waypoints within the
            limits [s].
        status: `"optimal"`; `"budget"` if the budget ended first, so a better motion may
            exist; or `"resting"` if the arm comes to rest in each interval, because the solver did
            not converge or hardly any gain was possible.
        active_limits: Limits that are active in each interval, the longest first.
        objective_values: Unweighted value of each term by name: `"time"` [s], and the integrals
            with a weight.
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

    @property
    def duration(self) -> float:
        """Time from the first waypoint to the last [s]."""
        return float(self.time[-1] - self.time[0])
