"""The initial guess of the solver: plain cubics through the waypoints."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.planning.timing.long_intervals import guessed_states
from knotwork.planning.timing.motion_states import States
from knotwork.planning.timing.timing_problem import TimingProblem


def plain_guess(problem: TimingProblem) -> States:
    """An initial guess of plain cubics, by the states at the breaks of the solver's pieces.

    Joints pass waypoints without a stop where they may.
    """
    velocity = _first_velocities(problem)
    duration = _first_durations(problem, velocity)
    short = _nonstop_durations(problem)
    duration = np.where(np.isnan(short), duration, np.minimum(short, duration))
    if problem.total is not None:
        duration = duration * (problem.total / duration.sum())
    return guessed_states(problem, duration, velocity)


def _first_durations(problem: TimingProblem, velocity: FloatArray) -> FloatArray:
    """Durations in which each interval is likely to be feasible [s], shape (n-1,)."""
    limits = problem.limits
    D = np.abs(np.diff(problem.position, axis=0))
    v0, v1 = np.abs(velocity[:-1]), np.abs(velocity[1:])
    V, A, J = limits.velocity, limits.acceleration, limits.jerk
    with np.errstate(invalid="ignore"):
        ramp = np.where(np.isinf(A), 0.0, np.divide(A, J))  # 0 where the jerk is not limited
        h = np.maximum(np.maximum(D / V, 2.0 * np.sqrt(D / A)), np.cbrt(32.0 * D / J))
        h = h + (v0 + v1) / A + np.where(np.isfinite(ramp), ramp, 0.0)
    typical = h.max(axis=1)
    mean = np.divide(D, np.maximum(v0, v1), out=np.zeros_like(D), where=np.maximum(v0, v1) > 0.0)
    typical = np.where(typical > 0.0, typical, mean.max(axis=1))
    typical = np.maximum(typical, problem.min_duration)
    typical = np.where(typical > 0.0, typical, 1.0)
    return np.where(problem.duration_is_unknown, 1.3 * typical, problem.duration)


def _nonstop_durations(problem: TimingProblem) -> FloatArray:
    """Durations in which no joint has to stop [s], shape (n-1,).

    Each is the middle of the durations in which this holds for all joints. It is NaN if there are
    none, or if none is the longest.
    """
    durations = np.full(problem.duration.shape, np.nan)
    known = problem.velocity_known
    for i in np.flatnonzero(known[:-1] & known[1:] & problem.duration_is_unknown).tolist():
        feasible = problem.feasible_durations(i)
        first, last = feasible.minimum.max(), feasible.early_end.min()
        if max(first, problem.min_duration[i]) <= last < np.inf:
            durations[i] = 0.5 * (first + last)
    return durations


def _first_velocities(problem: TimingProblem) -> FloatArray:
    """Initial velocities at the waypoints, given or guessed, shape (n, d)."""
    v = np.array(problem.velocity)
    known = problem.velocity_known
    if known.all():
        return v
    still = np.zeros_like(v)
    slope = np.diff(problem.position, axis=0) / _first_durations(problem, still)[:, None]
    before, after = np.vstack((slope[:1], slope)), np.vstack((slope, slope[-1:]))
    same = before * after > 0.0
    guess = np.where(same, np.sign(after) * np.minimum(np.abs(before), np.abs(after)), 0.0)
    cap = 0.8 * problem.limits.velocity
    guess = np.clip(guess, -cap, cap)
    for i in np.flatnonzero(~known):
        if not problem.is_direction[i]:
            v[i] = guess[i]
            continue
        direction = v[i]
        length = float(direction @ direction)
        factor = max(float(guess[i] @ direction) / length, 0.0) if length else 0.0
        v[i] = min(factor, float(problem.max_factor[i]), _max_factor(direction, cap)) * direction
    return v


def _max_factor(direction: FloatArray, cap: FloatArray) -> float:
    """Largest factor on a direction with which no joint is faster than its cap."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.min(np.where(direction == 0.0, np.inf, cap / np.abs(direction))))
