"""Result of a timing problem, and progress and budget of its solution."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from knotwork.arrays import FloatArray, ReadOnlyArrays
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors.arguments import require_number

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


@dataclass(frozen=True)
class Progress:
    """Progress of a solution.

    Attributes:
        iterations: Number of solver steps so far.
        seconds: Time since the start [s].
        done: Fraction of solved intervals, 0 to 1, including the progress of a current search for a
            collision-free motion.
        duration: Duration of the best motion of that search [s], finally of the whole motion;
            `None` before there is one.
        trying: Current step of that search, for example `"way 2 of 6"`; finally `"check"`;
            otherwise empty.
    """

    iterations: int
    seconds: float
    done: float
    duration: float | None = None
    trying: str = ""


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
        binding: Active limits of each interval, the longest first.
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
    binding: Sequence[ActiveLimit] = ()
    objective_values: Mapping[str, float] = field(default_factory=dict)
    iterations: int = 0
    line: FloatArray | None = None
    tries: int = 0
    extra_clearance: float | None = None

    @property
    def duration(self) -> float:
        """Time from the first waypoint to the last [s]."""
        return float(self.time[-1] - self.time[0])


@dataclass(eq=False)
class Budget:
    """Progress and time budget of a solution over all its sections.

    Attributes:
        progress: Called after each run of the solver, or `None`.
        seconds: Time for all sections [s], or `None`.
        work: Number of intervals of all sections.
        now: The clock [s].
        begun: Start of the solution by this clock [s].
        iterations: Number of steps so far.
        solved: Number of intervals of solved sections.

    Raises:
        InputError: The budget is not positive.
    """

    progress: Callable[[Progress], None] | None = None
    seconds: float | None = None
    work: int = 1
    now: Callable[[], float] = clock.perf_counter
    iterations: int = 0
    solved: int = 0
    begun: float = field(init=False)

    def __post_init__(self) -> None:
        if self.seconds is not None:
            self.seconds = require_number(self.seconds, "budget", "s", positive=True)
        self.begun = self.now()

    def remaining(self) -> float:
        """Remaining time [s]; infinite without a budget."""
        return np.inf if self.seconds is None else self.begun + self.seconds - self.now()

    def begin(self, intervals: int) -> None:
        """Begin sections with a number of intervals."""
        self.work, self.solved = intervals, 0

    def finish(self, intervals: int) -> None:
        """Count the intervals of solved sections."""
        self.solved += intervals

    @property
    def is_over(self) -> bool:
        """Whether the time has ended."""
        return self.remaining() <= 0.0

    def step(
        self, count: int = 1, duration: float | None = None, trying: str = "", part: float = 0.0
    ) -> None:
        """Count steps and report them; other arguments as the attributes of `Progress`.

        `part` is the finished fraction of the current interval.
        """
        self.iterations += count
        if self.progress is not None:
            seconds, done = self.now() - self.begun, min((self.solved + part) / self.work, 1.0)
            self.progress(Progress(self.iterations, seconds, done, duration, trying))
