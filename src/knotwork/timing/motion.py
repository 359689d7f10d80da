"""`TimedMotion`: the motion that was found, what bounds its duration, and where limits bind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray, ReadOnlyArrays

Status = Literal["optimal", "resting", "stopped"]


def status_of(parts: Iterable[Status]) -> Status:
    """The status of a motion made of parts: the least that any of them has."""
    return max(parts, key=("optimal", "resting", "stopped").index, default="optimal")


@dataclass(frozen=True)
class Binding:
    """A limit that keeps an interval from being faster.

    Attributes:
        start, end: Names of the waypoints that the interval lies between.
        joint: Name of the joint; empty for the tool.
        quantity: `"velocity"`, `"acceleration"`, `"jerk"`, `"position"`, `"effort"` or
            `"tool speed"`; of a speed along a path also what else bounds it.
        share: For how much of the interval's duration the joint is at it, from 0 to 1: 0 where it
            only comes near at its peak; `None` for what bounds a constant speed along a path.
    """

    start: str
    end: str
    joint: str
    quantity: str
    share: float | None


@dataclass(frozen=True)
class Progress:
    """How far a solution has come.

    Attributes:
        iterations: Steps of the solver so far.
        seconds: Time since the start [s].
        done: Part of the intervals that are already solved, from 0 to 1; of one whose way is
            searched for, the part of its tries.
        duration: How long the best motion lasts that a search for a way has so far [s], in the end
            that of the whole motion; `None` before there is one.
        trying: What that search tries, for example `"way 2 of 6"`; in the end `"check"`; empty
            elsewhere.
    """

    iterations: int
    seconds: float
    done: float
    duration: float | None = None
    trying: str = ""


@dataclass(frozen=True, eq=False)
class TimedMotion(ReadOnlyArrays):
    """A motion that keeps every limit, with durations chosen.

    Attributes:
        trajectory: Its joints over time: cubic, C2, from time 0 on.
        time: Times of the waypoints [s], shape (n,).
        velocity: Joint velocities at the waypoints, chosen or given, shape (n, d).
        acceleration: Joint accelerations at the waypoints, shape (n, d).
        lower_bound: No motion through these waypoints that keeps the limits is shorter [s].
        status: `"optimal"`, or `"stopped"` where the budget ended first: the motion keeps every
            limit, but a better one may exist; or `"resting"` where no start led to a solution,
            or hardly anything could be won, and the arm comes to rest in each interval.
        binding: Where which limit is met, by interval, the longest first.
        objective: Value of each term, by name, before it is weighted: `"time"` [s], and the
            integrals that have a weight.
        iterations: Steps of the solver.
        seconds: What the solution took [s].
        line: Corners of the clear polyline that it was made from, shape (m, d); `None` for a motion
            that does not find its way.
        tries: Number of ways that were looked for.
        room: Clearance that a way keeps beyond the margins [m]; `None` if none was asked for.
    """

    trajectory: JointTrajectory
    time: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    lower_bound: float
    status: Status = "optimal"
    binding: Sequence[Binding] = ()
    objective: Mapping[str, float] = field(default_factory=dict)
    iterations: int = 0
    seconds: float = 0.0
    line: FloatArray | None = None
    tries: int = 0
    room: float | None = None

    @property
    def duration(self) -> float:
        """Time from the first waypoint to the last [s]."""
        return float(self.time[-1] - self.time[0])
