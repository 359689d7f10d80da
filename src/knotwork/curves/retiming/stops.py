"""The shortest stops from a time of a motion: on its path, and of each joint independently."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.curves.retiming.composition import approximate_by_cubics, compose
from knotwork.curves.retiming.shortest_stop import find_shortest_stop
from knotwork.joint_quantities import RATE_QUANTITIES, JointLimits

LIMIT_SHARES = (0.999, 0.99, 0.95)
"""Candidate fractions of the limits at samples, in order, until the limits are kept between
samples. The first one is nearly always sufficient.
"""
MIN_PHASE_DURATION = 1e-9
"""Duration below which phases of a stop are left out [s]: the resolution of times in messages."""
REST_BOUND = 1e-9
"""Bound of velocities and accelerations at rest, relative to the maximum, or to 1 in SI."""
MAX_LATER_STARTS = 3
"""Maximum number of later breaks at which a stop may begin, if the first time has none."""
DURATION_GUESS = 1.3
"""First guess of the duration of a stop on the path, relative to that of independent joints. Most
stops take hardly longer than the latter, which the first trust region of 30 % includes.
"""
MIN_GAIN = 1e-3
"""Minimum relative gain over the curve's next rest for a stop to be searched for."""


def stop_joints(
    q: FloatArray, v: FloatArray, a: FloatArray, limits: JointLimits
) -> PiecewisePolynomial | None:
    """Stop each joint in the shortest time from a state (C2 smooth, cubics), which leaves the path.

    The acceleration changes to a peak, stays there if the peak is at the limit, and changes to
    zero. If the peak p stays below the limit, both ramps together must cancel the velocity:
    v + d (2 p² - a²)/(2 J) = 0, with the sign d = ±1 of the peak.

    Args:
        q: Positions [rad or m], shape (d,).
        v: Velocities.
        a: Accelerations.
        limits: Limits, finite for acceleration and jerk; others are ignored.

    Returns:
        Positions over the time since the state [s]. Joints that stop earlier stay at rest. `None`
        for a state at rest, within rounding: its stop is shorter than `MIN_PHASE_DURATION`.
    """
    jerk = limits.jerk
    # a state above the limit returns to it
    direction = np.where(v + a * np.abs(a) / (2.0 * jerk) > 0.0, -1.0, 1.0)
    unlimited = np.sqrt(np.maximum(0.5 * a**2 - direction * v * jerk, 0.0))
    peak = np.minimum(unlimited, limits.acceleration)
    grow = np.abs(direction * peak - a) / jerk
    fade = peak / jerk
    changed = 0.5 * (a + direction * peak) * grow + 0.5 * direction * peak * fade
    hold = np.maximum(-direction * (v + changed), 0.0) / np.where(peak > 0.0, peak, 1.0)
    corners = np.cumsum([np.zeros_like(q), grow, hold, fade], axis=0)
    heights = np.stack((a, direction * peak, direction * peak, np.zeros_like(a)))
    times = sort_distinct(corners)
    times = times[np.append(True, np.diff(times) > MIN_PHASE_DURATION)]
    if len(times) < 2:
        return None
    columns = zip(corners.T, heights.T, strict=True)
    ramps = np.stack([np.interp(times, when, high) for when, high in columns], axis=1)
    slopes = np.diff(ramps, axis=0) / np.diff(times)[:, None]
    moved = PiecewisePolynomial(np.stack((slopes, ramps[:-1])), times).antiderivative(2)
    c = np.array(moved.c)
    c[-1] += q + v * times[:-1, None]
    c[-2] += v
    return PiecewisePolynomial(c, times)


def stop_on_path(
    curve: PiecewisePolynomial,
    at: float,
    limits: JointLimits,
) -> tuple[PiecewisePolynomial, PiecewisePolynomial] | None:
    """Find the shortest stop on the path (C2 smooth, cubics), with an override of at most 1.

    If the curve comes to rest earlier, that is the stop.

    Args:
        curve: Positions over time, trailing shape (d,).
        at: Start time of the stop [s]; the curve is not at rest.
        limits: Limits; those of acceleration and jerk are kept.

    Returns:
        The clock and the motion; `None` if no such stop keeps the limits before the curve ends. The
        clock is the time of the curve over the time since the start of the stop [s].
    """
    rest_time = find_first_rest(curve, at)
    end = float(curve.x[-1]) if rest_time is None else rest_time
    best = np.inf if rest_time is None else rest_time - at
    later = (curve.x > at + MIN_PHASE_DURATION) & (curve.x < end - MIN_PHASE_DURATION)
    for begin in (at, *curve.x[later][:MAX_LATER_STARTS].tolist()):
        min_duration = _min_duration(curve, begin, limits)
        if begin - at + min_duration >= (1.0 - MIN_GAIN) * best:
            continue
        for share in LIMIT_SHARES:
            guess = min(DURATION_GUESS * min_duration, best)
            clock = find_shortest_stop(curve, begin, end, guess, limits.scaled(share))
            if clock is None or begin - at + clock.x[-1] >= best:
                break
            clock = _start_earlier(clock, at, begin)
            motion, _ = approximate_by_cubics(compose(curve, clock))
            if keeps_joint_limits(motion, curve, limits):
                return clock, motion
    if rest_time is None:
        return None
    clock = PiecewisePolynomial([[1.0], [at]], [0.0, rest_time - at])
    motion = cut_curve(curve, at, rest_time)
    return clock, PiecewisePolynomial(motion.c, motion.x - at)


def find_first_rest(curve: PiecewisePolynomial, at: float) -> float | None:
    """Find the first time, a given one or a later break, at which a curve is at rest, or `None`."""
    times = np.append(at, curve.x[curve.x > at])
    moves = np.zeros(len(times), bool)
    for nu in (1, 2):
        scale = np.maximum(curve.extrema(nu).peak, 1.0)
        moves |= (np.abs(curve(times, nu)) > REST_BOUND * scale).any(axis=1)
    return None if moves.all() else float(times[np.argmin(moves)])


def _min_duration(curve: PiecewisePolynomial, at: float, limits: JointLimits) -> float:
    """Time that the joints need to stop independently, a lower bound of stops on the path [s]."""
    q, v, a = (curve(at, nu) for nu in range(3))
    jerk = np.where(np.isfinite(limits.jerk), limits.jerk, limits.acceleration / MIN_PHASE_DURATION)
    stop = stop_joints(q, v, a, replace(limits, jerk=jerk))
    return 0.0 if stop is None else float(stop.x[-1])


def _start_earlier(clock: PiecewisePolynomial, at: float, begin: float) -> PiecewisePolynomial:
    """Extend a clock to an earlier start, with a rate of 1."""
    if begin == at:
        return clock
    first = np.zeros((len(clock.c), 1))
    first[-2:] = [[1.0], [at]]
    c = np.concatenate((first, clock.c), axis=1)
    return PiecewisePolynomial(c, np.append(0.0, begin - at + clock.x))


def keeps_joint_limits(
    motion: PiecewisePolynomial, curve: PiecewisePolynomial, limits: JointLimits
) -> bool:
    """Whether a motion keeps limits, or exceeds them at most as much as the curve.

    Velocities need no test: the motion is at most as fast as the curve.
    """
    return all(
        (motion.extrema(order).peak <= np.maximum(limits[name], curve.extrema(order).peak)).all()
        for order, name in enumerate(RATE_QUANTITIES, 1)
        if name != "velocity"
    )
