"""Where the solver starts: durations from the limits, and plain cubics between the waypoints."""

from __future__ import annotations

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.hermite import two_point_coefficients
from knotwork.timing.problem import TimingProblem
from knotwork.timing.rebuild import Knots, divided
from knotwork.waypoints import FloatArray

LEAST_PHASE = 1e-3
"""No phase of a first motion is shorter than this part of all."""


def first_durations(problem: TimingProblem, velocity: FloatArray) -> FloatArray:
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
    typical = np.maximum(typical, problem.at_least)
    typical = np.where(typical > 0.0, typical, 1.0)
    return np.where(problem.free, 1.3 * typical, problem.duration)


def short_durations(problem: TimingProblem) -> FloatArray:
    """Durations after which a joint that may not stop would have to go back [s], shape (n-1,).

    They lie in the middle of what every joint can take without stopping; NaN where no joint is
    hurried so, or where they don't agree.
    """
    found = np.full(problem.duration.shape, np.nan)
    known = problem.velocity_known
    for i in np.flatnonzero(known[:-1] & known[1:] & problem.free).tolist():
        first, last, _ = problem.possible_durations(i)
        if first.max() <= last.min() < np.inf and last.min() >= problem.at_least[i]:
            found[i] = 0.5 * (first.max() + last.min())
    return found


def first_velocities(problem: TimingProblem, duration: FloatArray | None = None) -> FloatArray:
    """Velocities at the waypoints to start from, shape (n, d): those known, and guesses."""
    v = np.array(problem.velocity)
    known = problem.velocity_known
    if known.all():
        return v
    still = np.zeros_like(v)
    h = first_durations(problem, still) if duration is None else duration
    slope = np.diff(problem.position, axis=0) / h[:, None]
    before, after = np.vstack((slope[:1], slope)), np.vstack((slope, slope[-1:]))
    same = before * after > 0.0
    guess = np.where(same, np.sign(after) * np.minimum(np.abs(before), np.abs(after)), 0.0)
    cap = np.where(np.isinf(problem.limits.velocity), np.inf, 0.8 * problem.limits.velocity)
    guess = np.clip(guess, -cap, cap)
    for i in np.flatnonzero(~known):
        if not problem.along[i]:
            v[i] = guess[i]
            continue
        direction = v[i]
        length = float(direction @ direction)
        factor = max(float(guess[i] @ direction) / length, 0.0) if length else 0.0
        v[i] = min(factor, float(problem.most[i]), _fastest(direction, cap)) * direction
    return v


def _fastest(direction: FloatArray, cap: FloatArray) -> float:
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.min(np.where(direction == 0.0, np.inf, cap / np.abs(direction))))


def plain_cubic(
    time: FloatArray, position: FloatArray, velocity: FloatArray
) -> PiecewisePolynomial:
    """Join the waypoints by cubic Hermite pieces."""
    return PiecewisePolynomial(two_point_coefficients(time, (position, velocity)), time)


def between_stops(problem: TimingProblem, pieces: int) -> Knots | None:
    """The fastest motion of the slowest joint from stop to stop, the others in proportion to it.

    It has seven phases, of jerk up, none, down, none, down, none and up; longer ones are divided
    until there are as many as asked for.

    Args:
        problem: One interval.
        pieces: How many pieces there are to be, at least seven.

    Returns:
        The motion, or `None` where the problem is not of this kind or the jerk is not limited.
    """
    ends = (problem.velocity, problem.acceleration)
    if len(problem.position) != 2 or any(not np.array_equal(one, 0.0 * one) for one in ends):
        return None
    limits, move = problem.limits, np.abs(np.diff(problem.position, axis=0)[0])
    phases = [
        _phases(*joint)
        for joint in zip(move, limits.velocity, limits.acceleration, limits.jerk, strict=True)
    ]
    k = int(np.argmax([span.sum() for span in phases]))
    if not 0.0 < phases[k].sum() < np.inf:
        return None
    span = np.maximum(phases[k], LEAST_PHASE * phases[k].sum())
    a = limits.jerk[k] * phases[k][0] * np.array([0.0, 1, 1, 0, 0, -1, -1, 0])
    part = np.diff(problem.position, axis=0)[0] / move[k]
    found = Knots(
        np.array([0.0, span.sum()]),
        span[None] / span.sum(),
        problem.position,
        problem.velocity,
        (a[:, None] * part)[None],
    )
    return divided(found, pieces)


def _phases(move: float, V: float, A: float, J: float) -> FloatArray:
    """Durations of the seven phases of one joint [s]."""
    if move == 0.0 or np.isinf(J):
        return np.full(7, np.inf if move else 0.0)
    A = min(A, np.sqrt(J * V))
    ramp, cruise, hold = A / J, 0.0, 0.0
    rise = min(ramp, np.cbrt(0.5 * move / J))
    if move > V * (V / A + ramp):
        cruise, hold = move / V - V / A - ramp, V / A - ramp
    elif rise == ramp:
        hold = 0.5 * (np.sqrt(ramp * ramp + 4.0 * move / A) - 3.0 * ramp)
    return np.array([rise, hold, rise, cruise, rise, hold, rise])
