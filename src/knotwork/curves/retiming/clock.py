"""Clocks: the time τ of a planned motion as a curve over execution time t.

A clock is C2 smooth and never decreases; its rate τ' is the speed override.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.monotone import first_times
from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.errors import InputError
from knotwork.errors.arguments import require_number, require_type

END_TOLERANCE = 1e-12
"""Difference from the end, relative to it, that rounding explains."""


def make_rate_curve(times: FloatArray, rates: FloatArray) -> PiecewisePolynomial:
    """Make the rate over time (C1 smooth): two parabolas between values, with zero slope at each.

    Args:
        times: Strictly increasing [s], shape (n,), n >= 2.
        rates: Rates, shape (n,).
    """
    middle = 0.5 * (times[1:] + times[:-1])
    half, rise = 0.5 * np.diff(times), np.diff(rates)
    breaks = np.sort(np.concatenate((times, middle)))
    bend, zero = 0.5 * rise / half**2, np.zeros_like(rise)
    first = np.stack((bend, zero, rates[:-1]))
    second = np.stack((-bend, rise / half, rates[:-1] + 0.5 * rise))
    return PiecewisePolynomial(np.stack((first, second), axis=2).reshape(3, -1), breaks)


class SpeedOverride(NamedTuple):
    """A speed override over time, with smooth changes between values.

    Attributes:
        times: From 0 on, strictly increasing [s], shape (n,).
        rates: Overrides, 1 is the planned speed, shape (n,).
    """

    times: FloatArray
    rates: FloatArray

    def clock(self, start: float, duration: float) -> PiecewisePolynomial:
        """Make the clock of a motion: its time over execution time (C2 smooth).

        The clock ends with the motion, or with the override if that ends at 0.

        Args:
            start: Start time of the motion [s].
            duration: Duration of the motion [s].
        """
        times, rates = self
        if rates[-1] > 0.0:  # the last override stays until the motion ends
            end = times[-1] + 2.0 * duration / rates[-1]
            times, rates = np.append(times, end), np.append(rates, rates[-1])
        clock = make_rate_curve(times, rates).antiderivative()
        if float(clock(times[-1])) > duration:
            end = float(first_times(clock, np.array([duration]))[0])
            near = float(clock.x[np.abs(clock.x - end).argmin()])
            # a break within rounding of the end would leave a piece without a duration
            clock = cut_curve(clock, 0.0, near if abs(near - end) < END_TOLERANCE * end else end)
        c = np.array(clock.c)
        c[-1] += start
        return PiecewisePolynomial(c, clock.x)


def make_override(profile: Mapping[float, float]) -> SpeedOverride:
    """Make a speed override from values by time, checked and sorted.

    Before the first time and after the last the override keeps its value.

    Args:
        profile: Overrides by time [s]; 1 is the planned speed.

    Raises:
        InputError: A time or an override is negative or not finite, or the override is always 0.
    """
    require_type(profile, Mapping, "override profile", "a mapping of times to overrides")
    if not profile:
        raise InputError("an override profile has no values; accepted: {0: 1.0, 2.0: 0.3}")
    overrides = [
        (require_number(time, "time of the profile", "s"), require_number(rate, "override"))
        for time, rate in profile.items()
    ]
    times, rates = np.array(sorted(overrides)).T
    for name, values in (("time", times), ("override", rates)):
        if (values < 0.0).any():
            raise InputError(
                f"override profile: {name} {values.min():g}; accepted: finite numbers >= 0"
            )
    if times[0] > 0.0:
        times, rates = np.append(0.0, times), np.append(rates[0], rates)
    if not rates.any():
        raise InputError("override profile: the override is 0 at all times; the arm would not move")
    return SpeedOverride(times, rates)
