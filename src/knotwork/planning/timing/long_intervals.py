"""Long given durations next to unknown ones: the arm slows down in them.

Neighbours are faster if the arm moves at the ends of such an interval. With gentle accelerations
alone it would move far away and back in the meantime. So the interval has four short pieces for
changes of velocity, two at each end, and a long one with bounded velocities between them.
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.planning.timing.motion_states import States, states_of
from knotwork.planning.timing.spline import pieces_per_interval
from knotwork.planning.timing.timing_problem import TimingProblem

MIN_STOPS = 6.0
"""Minimum duration of a long interval, relative to that of a stop from any velocity."""

MIDDLE_BREAKS = (2, 3)
"""The ends of the long piece, by the number of pieces before."""

MIDDLE_FACTOR = 2.0
"""Largest velocity in the long piece relative to its mean; that from rest to rest needs 1.5."""


def stop_times(problem: TimingProblem) -> FloatArray:
    """Time for a stop from any velocity in each long interval [s], NaN in others, shape (n-1,)."""
    limits = problem.limits
    with np.errstate(invalid="ignore"):
        stops = limits.velocity / limits.acceleration + limits.acceleration / limits.jerk
    stop = float(np.max(stops, initial=0.0, where=np.isfinite(stops)))
    is_fastest = problem.objective.only_time and problem.total is None
    has_long = stop and is_fastest and problem.duration_is_unknown.any()
    least = MIN_STOPS * stop if has_long else np.inf
    return np.where(problem.duration > least, stop, np.nan)


def max_middle_velocities(problem: TimingProblem) -> FloatArray:
    """Largest velocities in the middle of each interval [rad/s or m/s], shape (n-1, d)."""
    stop = stop_times(problem)[:, None]
    distance = np.abs(np.diff(problem.position, axis=0)) + problem.limits.velocity * stop
    mean = distance / (problem.duration[:, None] - 2.0 * stop)
    return np.where(np.isnan(stop), np.inf, MIDDLE_FACTOR * mean)


def guessed_states(problem: TimingProblem, duration: FloatArray, velocity: FloatArray) -> States:
    """A guess of plain cubics: between waypoints, in long intervals between stops.

    Args:
        problem: The problem.
        duration: Guessed durations between the waypoints [s], shape (n-1,).
        velocity: Guessed velocities at the waypoints, shape (n, d).
    """
    pieces = pieces_per_interval(len(duration))
    spans, position = np.repeat(duration[:, None] / pieces, pieces, axis=1), problem.position
    time, stops = np.append(0.0, np.cumsum(duration)), stop_times(problem)
    for i in np.flatnonzero(~np.isnan(stops))[::-1].tolist():
        stop, middle = stops[i], duration[i] - 2.0 * stops[i]
        spans[i] = (stop / 2, stop / 2, middle, stop / 2, stop / 2)
        slowed = position[i : i + 2] + stop / 2 * velocity[i : i + 2] * [[1.0], [-1.0]]
        mean = np.diff(slowed, axis=0) / middle
        time = np.insert(time, i + 1, (time[i] + stop, time[i + 1] - stop))
        position = np.insert(position, i + 1, slowed, axis=0)
        velocity = np.insert(velocity, i + 1, np.vstack((mean, mean)), axis=0)
    curve = PiecewisePolynomial(two_point_coefficients(time, (position, velocity)), time)
    return states_of(curve, spans.ravel())
