"""Speed overrides with changes slowed down as far as a motion's limits need.

Where a joint is at a limit, the override can't leave or reach 1 there at any rate: a change has to
begin later, take longer, or begin and end a little below 1.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.retiming.clock import Profile, inverse_time, rate_curve
from knotwork.retiming.shortest import use
from knotwork.waypoints import FloatArray

CAPS = (1.0, 0.99, 0.97, 0.94, 0.9, 0.8)
"""Maximum overrides that are tried; the smallest deviation is preferred."""
STRETCHES = (1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 5.0, 8.0)
"""Durations of a change that are tried, relative to the requested one."""
DELAYS = 80
"""Number of start times of a change that are tried, over the duration of the motion."""
SAMPLES = 40
"""Minimum number of samples of a change at which limits are compared."""
GRID = 400
"""Number of samples at which deviations from the profile are compared."""
ASIDE = 1e-9
"""Distance of the samples on both sides of a break [s]."""


def slower_ramps(
    asked: Profile,
    curve: PiecewisePolynomial,
    acceleration: FloatArray,
    jerk: FloatArray,
) -> list[Profile]:
    """Overrides that keep limits at samples, the one nearest the request first.

    Args:
        asked: The override, at most 1.
        curve: Positions over time within the limits, trailing shape (d,).
        acceleration: Acceleration limits, shape (d,); infinite where there is none.
        jerk: Jerk limits, shape (d,).

    Returns:
        One profile for each maximum override, 1 and below, that is feasible.
    """
    duration = float(curve.x[-1] - curve.x[0])
    times = np.linspace(0.0, asked.times[-1] + duration, GRID)
    found = []
    for cap in CAPS:
        if cap < 1.0 and cap >= asked.rates.max():
            continue
        capped = Profile(asked.times, np.minimum(asked.rates, cap))
        ramps = _with_ramps(capped, curve, acceleration, jerk)
        if ramps is not None:
            found.append(ramps)
    return sorted(found, key=lambda one: float(np.abs(one(times) - asked(times)).sum()))


def _with_ramps(
    asked: Profile, curve: PiecewisePolynomial, acceleration: FloatArray, jerk: FloatArray
) -> Profile | None:
    """The override with each change as early and as short as limits allow."""
    duration = float(curve.x[-1] - curve.x[0])
    times, rates = [0.0], [float(asked.rates[0])]
    shown = float(curve.x[0])
    for i, rate in enumerate(asked.rates[1:].tolist()):
        length, old = float(asked.times[i + 1] - asked.times[i]), rates[-1]
        if rate == old or shown >= curve.x[-1]:
            continue
        earliest = max(float(asked.times[i]), times[-1])
        waits = np.linspace(0.0, duration, DELAYS) if old > 0.0 else (0.0,)
        tried = sorted(product(waits, STRETCHES), key=lambda one: one[0] + 0.5 * one[1] * length)
        for wait, stretch in tried:
            begin = shown + old * (earliest + wait - times[-1])
            if begin >= curve.x[-1]:
                continue  # the motion is over before
            if _ramp_fits(curve, begin, old, rate, stretch * length, acceleration, jerk):
                break
        else:
            return None
        begins = earliest + float(wait)
        if begins > times[-1]:
            times.append(begins)
            rates.append(old)
        times.append(begins + stretch * length)
        rates.append(rate)
        shown = begin + 0.5 * (old + rate) * stretch * length
    return Profile(np.array(times), np.array(rates))


def _ramp_fits(
    curve: PiecewisePolynomial,
    begin: float,
    old: float,
    new: float,
    length: float,
    acceleration: FloatArray,
    jerk: FloatArray,
) -> bool:
    """Whether the override may change at a time of the curve, as far as samples show."""
    rate = rate_curve(np.array([0.0, length]), np.array([old, new]))
    clock = rate.antiderivative()
    end = min(float(curve.x[-1]), begin + float(clock(length)))
    breaks = curve.x[(curve.x > begin) & (curve.x < end)] - begin
    places = inverse_time(clock, np.append(breaks, end - begin))
    last = float(places[-1])
    ends = np.concatenate(([0.0, 0.5 * length, last], places))
    times = np.concatenate((ends - ASIDE, ends + ASIDE, np.linspace(0.0, last, SAMPLES)))
    times = np.clip(times, 0.0, min(last, length - ASIDE))
    shown = np.clip(begin + clock(times), curve.x[0], curve.x[-1])
    used = use(curve, (shown, rate(times), rate(times, 1), rate(times, 2)), acceleration, jerk)
    # constant rates may be at a limit themselves, up to rounding
    most = max(np.abs(used.acceleration).max(), np.abs(used.jerk).max())
    return bool(most <= 1.0 + ASIDE)
