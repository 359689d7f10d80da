"""Proved bounds on the deviation of the tool from a path, in position, orientation and speed.

At each sample the nearest point of the path is found, on the branch of the previous sample. Between
two samples the tool is compared with a point that moves along the path from one to the other, so
that the progress s(t) is continuous. The difference g(t) is within h²/8 · max |g''| of its chord.
|g''| is at most the sum of two accelerations: that of the tool, bounded by the chain of joints, and
that of the point, bounded by the curvature of the path. Orientations are compared as matrices: at
an angle φ they differ by √8 sin(φ/2) in the Frobenius norm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.tool_paths.rotations import rotation_difference
from knotwork.robot import Robot
from knotwork.verification.bounds.path_criteria import (
    PathBound,
    PathErrors,
    PathTolerances,
    bounded_path_errors,
)
from knotwork.verification.bounds.path_samples import PathStretch
from knotwork.verification.bounds.rate_bounds import divide_intervals
from knotwork.waypoints import PoseFreedom

if TYPE_CHECKING:
    from knotwork.curves.tool_paths import TimedPath

SAMPLE_BUDGET = 100_000
"""Maximum number of samples of one stretch. A verdict that is then undecided is not proved."""

SAMPLES_PER_PIECE = 20
"""Minimum budget per piece of the motion."""

FIRST_PARTS = 64
"""Minimum number of intervals of the first division of a stretch."""

BOUND_SHARE = 0.05
"""Tightness of a bound, relative to the tolerance."""

MAX_DIVISION = 16
"""Maximum number of parts of an interval in one round."""

MAX_ROUNDS = 12
"""Maximum number of rounds of division. A verdict that is then undecided is not proved."""


class PathProgress(NamedTuple):
    """Progress of the tool along the path in a stretch, including whole turns.

    Attributes:
        length: Length of the stretch [m].
        start, end: Progress of the tool at both ends [m].
        back: Maximum backward motion [m].
        error: Largest of the errors at both ends and of the backward motion [m].
        time: Time of this error [s].
    """

    length: float
    start: float
    end: float
    back: float
    error: float
    time: float


class StretchBounds(NamedTuple):
    """Bounds on a stretch of a path.

    Attributes:
        times: Ends of the n intervals into which the stretch was divided [s], shape (n + 1,).
        errors: Errors at these times, and bounds on the intervals between them.
        progress: Progress along the path. It is proved where the deviation is proved.
    """

    times: FloatArray
    errors: PathErrors
    progress: PathProgress

    @property
    def worst_errors(self) -> dict[str, PathBound]:
        """The worst errors by the criteria that are judged."""
        return {name: error.worst(self.times) for name, error in self.errors.criteria.items()}

    @property
    def utilisation(self) -> FloatArray:
        """Upper bound on the error of each interval relative to the limits, shape (n,).

        Where a sample exceeds a limit, it is the error of the samples.
        """
        utilisations = [error.utilisation for error in self.errors.criteria.values()]
        return np.asarray(np.max(utilisations, axis=0))


def path_bounds(
    robot: Robot,
    curve: PiecewisePolynomial,
    path: TimedPath,
    interval: tuple[float, float],
    tolerances: PathTolerances,
    freedom: PoseFreedom | None = None,
    start_turn: float = 0.0,
    clock: PiecewisePolynomial | None = None,
) -> StretchBounds:
    """Bound the deviation of the tool from a stretch of a path, over all its time.

    Args:
        robot: The arm.
        curve: Joint positions, trailing shape (d,).
        path: The path and its timing.
        interval: Interval of the stretch [s].
        tolerances: Tolerances, and the required speed.
        freedom: Freedom of the poses: only the tool's z axis is compared, with the tilt added to
            the limit.
        start_turn: Approximate turn of the tool about that axis at the start [rad].
        clock: See `PathStretch`.
    """
    stretch = PathStretch(robot, curve, path, *interval, freedom, clock)
    t = _first_times(curve, interval, tolerances.speed.interval if tolerances.speed else ())
    inside = (curve.x > interval[0]) & (curve.x < interval[1])
    budget = max(SAMPLE_BUDGET, SAMPLES_PER_PIECE * int(inside.sum()))
    # the bounds alone give the required density of samples
    bounds = stretch.bounds(t)
    for _ in range(4):
        angle = tolerances.orientation + (0.0 if freedom is None else freedom.tilt)
        bend, turn = bounds.acceleration / tolerances.position, bounds.rotation
        utilisations = np.maximum(bend, turn / rotation_difference(angle))
        if tolerances.speed:
            utilisations = np.maximum(utilisations, bounds.jerk / tolerances.speed.tolerance)
        needed = np.diff(t) * np.sqrt(utilisations / (8.0 * BOUND_SHARE))
        finer = _divide(t, np.clip(np.ceil(needed), 1, MAX_DIVISION), needed, budget // 4)
        if len(finer) == len(t):
            break
        t, bounds = finer, stretch.bounds(finer)
    samples = stretch.sample(t)
    for remaining in range(MAX_ROUNDS, -1, -1):
        errors = bounded_path_errors(
            path.tool_path, samples, t, bounds, tolerances, freedom, start_turn
        )
        needed = np.max([error.parts for error in errors.criteria.values()], axis=0)
        if not remaining or not needed.any():
            break
        parts = np.where(needed > 0.0, np.clip(np.ceil(needed), 2, MAX_DIVISION), 1)
        finer = _divide(t, parts, needed, budget)
        if len(finer) == len(t):
            break
        t, samples, bounds = finer, stretch.sample(finer), stretch.bounds(finer)
    return StretchBounds(t, errors, _path_progress(stretch, t, samples.s))


def _first_times(
    curve: PiecewisePolynomial, interval: tuple[float, float], full: tuple[float, ...]
) -> FloatArray:
    low, high = max(interval[0], float(curve.x[0])), min(interval[1], float(curve.x[-1]))
    inner = curve.x[(curve.x > low) & (curve.x < high)]
    full_ends = [t for t in full if low < t < high]
    # at a break both sides count, because velocities may jump if the scenario allows it
    before = np.nextafter(inner, -np.inf)
    ends = np.concatenate(([low], inner, [high]))
    middle = 0.5 * (ends[1:] + ends[:-1])  # every piece has an inner sample
    grid = np.linspace(low, high, FIRST_PARTS + 1)
    return sort_distinct(grid, inner, before, middle, full_ends)


def _divide(t: FloatArray, parts: FloatArray, needed: FloatArray, budget: int) -> FloatArray:
    """Divide intervals into parts; if the budget does not suffice, only those that need most."""
    count = parts.astype(np.intp)
    if count.sum() > budget:
        order = np.argsort(-needed, kind="stable")
        allowed = np.cumsum(count[order] - 1) <= budget - len(count)
        count[order[~allowed]] = 1
    return np.append(divide_intervals(t[:-1], np.diff(t), count)[1], t[-1])


def _path_progress(stretch: PathStretch, t: FloatArray, s: FloatArray) -> PathProgress:
    backward = np.maximum.accumulate(s) - s
    i = int(backward.argmax())
    back = float(backward[i])
    start_off, end_off = np.abs(s[[0, -1]] - stretch.timed_arc_length(t[[0, -1]])).tolist()
    error, time = max((start_off, t[0]), (end_off, t[-1]), (back, t[i]))
    start, end = (s[[0, -1]] - stretch.low).tolist()
    return PathProgress(stretch.high - stretch.low, start, end, back, error, float(time))


def path_rounding(robot: Robot, curve: PiecewisePolynomial, path: TimedPath) -> float:
    """Rounding error of bounds on a path: no smaller limit can be proved [m, m/s].

    Args:
        robot: The arm.
        curve: Joint positions along the whole path, trailing shape (d,).
        path: The path and its timing.
    """
    stretch = PathStretch(robot, curve, path, path.start_time, path.end_time)
    return float(stretch.bounds(curve.x).rounding.max())
