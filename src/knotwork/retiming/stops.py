"""The shortest stops from a moment of a motion on: on its path, and of each joint alone."""

from __future__ import annotations

from itertools import product

import numpy as np

from knotwork.errors import InputError
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.distinct import distinct
from knotwork.retiming.composition import composed, cubic_through
from knotwork.waypoints import FloatArray

SAMPLES = 12
"""Places of each phase of a stop where limits are compared before the exact extrema decide."""
SHARES = (0.999, 0.97, 0.9, 0.8)
"""Parts of the limits that the samples may take, until what lies between them keeps the limits."""
TINY = 1e-9
"""Phases of a stop that are shorter than this [s] are none."""
RAMPS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5])
"""Parts of a stop in which its deceleration grows, and in which it fades."""
SLACK = 1e-6
"""What the optimiser may exceed a limit at a sample by, as a part of it."""


def joint_stop(
    q: FloatArray, v: FloatArray, a: FloatArray, acceleration: FloatArray, jerk: FloatArray
) -> PiecewisePolynomial:
    """Each joint's shortest stop from a state (C2 smooth, cubics); it leaves the path.

    The acceleration goes to a peak, stays there where the limit is reached, and goes to zero. With
    direction d = ±1 of the peak p, v + d (2 p² - a²)/(2 J) = 0 where the limit is not reached.

    Args:
        q: Positions [rad or m], shape (d,).
        v: Velocities.
        a: Accelerations.
        acceleration: Limits of acceleration, finite.
        jerk: Limits of jerk, finite.

    Returns:
        Positions over the time from the state on [s]; joints that stop earlier stand still.
    """
    # a state above the limit gets back to it
    direction = np.where(v + a * np.abs(a) / (2.0 * jerk) > 0.0, -1.0, 1.0)
    free = np.sqrt(np.maximum(0.5 * a**2 - direction * v * jerk, 0.0))
    peak = np.minimum(free, acceleration)
    grow = np.abs(direction * peak - a) / jerk
    fade = peak / jerk
    changed = 0.5 * (a + direction * peak) * grow + 0.5 * direction * peak * fade
    hold = np.maximum(-direction * (v + changed), 0.0) / np.where(peak > 0.0, peak, 1.0)
    corners = np.cumsum([np.zeros_like(q), grow, hold, fade], axis=0)
    heights = np.stack((a, direction * peak, direction * peak, np.zeros_like(a)))
    times = distinct(corners)
    times = times[np.append(True, np.diff(times) > TINY)]
    if len(times) < 2:
        raise InputError("the motion stands still at this moment; there is nothing to stop")
    columns = zip(corners.T, heights.T, strict=True)
    ramps = np.stack([np.interp(times, when, high) for when, high in columns], axis=1)
    moved = _ramps(times, ramps).antiderivative(2)
    c = np.array(moved.c)
    c[-1] += q + v * times[:-1, None]
    c[-2] += v
    return PiecewisePolynomial(c, times)


def stop_on_path(
    curve: PiecewisePolynomial,
    at: float,
    acceleration: FloatArray,
    jerk: FloatArray,
    tolerance: float,
) -> tuple[PiecewisePolynomial, PiecewisePolynomial] | None:
    """The shortest stop on the path that is found (C2 smooth, cubics).

    The override stays 1 for a while, so that a motion which already brakes may go on, and falls to
    0 with a deceleration that grows evenly, stays, and fades evenly. Of a grid of delays, durations
    and ramps the earliest end is taken at which no sample exceeds a limit, and made still earlier
    by an optimiser.

    Args:
        curve: Positions over time, trailing shape (d,).
        at: When the stop begins [s].
        acceleration: Limits [rad/s² or m/s²], shape (d,); infinite where there is none.
        jerk: Limits [rad/s³ or m/s³], shape (d,).
        tolerance: Greatest deviation of a joint from the path [rad or m].

    Returns:
        The clock, which is the time of the curve over the time from the stop's beginning on [s],
        and the motion; `None` where no such stop keeps the limits before the curve ends.
    """
    for share in SHARES:
        clock = _shortest(curve, at, share * acceleration, share * jerk)
        if clock is None:
            return None
        motion, _ = cubic_through(composed(curve, clock), tolerance)
        peaks = motion.extrema(2).peak / acceleration, motion.extrema(3).peak / jerk
        if np.max(peaks) <= 1.0:
            return clock, motion
    return None


def _shortest(
    curve: PiecewisePolynomial, at: float, acceleration: FloatArray, jerk: FloatArray
) -> PiecewisePolynomial | None:
    """The clock of the shortest stop of which no sample exceeds a limit."""
    from scipy.optimize import minimize

    left = float(curve.x[-1]) - at
    delays, spans = np.linspace(0.0, left, 9), left * np.geomspace(1e-3, 2.0, 81)
    best: tuple[float, ...] = (np.inf,)
    for shape in product(RAMPS, RAMPS):
        used = _used(curve, at, _unit_clock(*shape), delays, spans, acceleration, jerk)
        ends = np.where(used.max(axis=2) <= 1.0, delays[:, None] + spans, np.inf)
        i, j = np.unravel_index(np.argmin(ends), ends.shape)
        best = min(best, (float(ends[i, j]), float(delays[i]), float(spans[j]), *shape))
    if not np.isfinite(best[0]):
        return None

    def room(stop: FloatArray) -> FloatArray:
        used = _used(curve, at, _unit_clock(*stop[2:]), stop[:1], stop[1:2], acceleration, jerk)
        return np.asarray(1.0 - used[0, 0])

    start = np.array(best[1:])
    found = minimize(
        lambda stop: stop[0] + stop[1],
        start,
        method="SLSQP",
        bounds=((0.0, left), (1e-3 * left, 2.0 * left), (0.01, 0.499), (0.01, 0.499)),
        constraints={"type": "ineq", "fun": room},
    ).x
    delay, span, up, down = found if room(found).min() >= -SLACK else start
    unit = _unit_clock(up, down)
    c = unit.c * span ** -np.arange(2.0, -2.0, -1.0)[:, None]
    if delay <= TINY:
        c[-1] += at
        return PiecewisePolynomial(c, span * unit.x)
    c[-1] += at + delay
    c = np.concatenate((np.array([[0.0], [0.0], [1.0], [at]]), c), axis=1)
    return PiecewisePolynomial(c, np.append(0.0, delay + span * unit.x))


def _ramps(times: FloatArray, heights: FloatArray) -> PiecewisePolynomial:
    """Lines between points, as a curve; of points at one time the last counts."""
    kept = np.append(np.diff(times) > 0.0, True)
    times, heights = times[kept], heights[kept]
    slope = (np.diff(heights, axis=0).T / np.diff(times)).T
    return PiecewisePolynomial(np.stack((slope, heights[:-1])), times)


def _unit_clock(grow: float, fade: float) -> PiecewisePolynomial:
    """A clock whose rate goes from 1 to 0 in one unit of time."""
    peak = -1.0 / (1.0 - 0.5 * (grow + fade))
    corners = np.array([0.0, grow, 1.0 - fade, 1.0])
    clock = _ramps(corners, np.array([0.0, peak, peak, 0.0])).antiderivative(2)
    c = np.array(clock.c)
    c[-2] += 1.0
    c[-1] += clock.x[:-1]
    return PiecewisePolynomial(c, clock.x)


def _used(
    curve: PiecewisePolynomial,
    at: float,
    unit: PiecewisePolynomial,
    delays: FloatArray,
    spans: FloatArray,
    acceleration: FloatArray,
    jerk: FloatArray,
) -> FloatArray:
    """Parts of limits that stops use at samples, shape (delays, spans, samples).

    With the rate s of the clock the acceleration is q₂ s² + q₁ s', and the jerk
    q₃ s³ + 3 q₂ s s' + q₁ s'', where qₖ is the k-th derivative of the curve.
    """
    parts = np.linspace(0.0, 1.0 - TINY, SAMPLES)  # of each phase, to just before its end
    u = (unit.x[:-1, None] + np.diff(unit.x)[:, None] * parts).ravel()
    time = at + delays[:, None, None] + spans[:, None] * unit(u)
    beyond = time[..., -1:] - curve.x[-1]
    time = np.minimum(time, curve.x[-1])
    rate = unit(u, 1)[:, None]
    change, bend = (unit(u, nu)[:, None] / spans[:, None, None] ** (nu - 1) for nu in (2, 3))
    q1, q2, q3 = (curve(time, nu) for nu in (1, 2, 3))
    use = np.abs(q2 * rate**2 + q1 * change) / acceleration
    jolt = np.abs(q3 * rate**3 + 3.0 * q2 * rate * change + q1 * bend) / jerk
    used = [one.reshape(*one.shape[:2], -1) for one in (use, jolt)]
    return np.concatenate((*used, 1.0 + beyond), axis=2)
