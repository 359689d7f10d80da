"""The motion of a plan at another speed."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.retiming import (
    Profile,
    checked_profile,
    composed,
    cubic_through,
    inverse_time,
    keeps_limits,
)
from knotwork.trajectory import JointTrajectory
from knotwork.verification import Finding
from knotwork.waypoints import FloatArray

TOLERANCE = 1e-6
"""Greatest deviation of a joint from the path that the planned motion takes [rad or m]."""

NEAR = 1e-9
"""Moments that are nearer to one another [s] are one."""

CAPS, STRETCHES = (1.0, 0.97, 0.9, 0.8, 0.65, 0.5), (1.0, 1.5, 2.5, 5.0, 10.0)
"""Greatest overrides, and factors of the durations of changes, tried where limits are exceeded."""


def run_by(
    profile: Mapping[float, float],
    trajectory: JointTrajectory,
    times: FloatArray,
    limits: tuple[FloatArray, FloatArray],
) -> tuple[PiecewisePolynomial, PiecewisePolynomial, list[Finding]]:
    """A motion at another speed, which keeps limits where the override is at most 1.

    Args:
        profile: Speed override by time [s].
        trajectory: The motion.
        times: Those of its waypoints [s].
        limits: Of acceleration and jerk, shape (d,) each; infinite where there is none.

    Returns:
        The motion, its clock, and a finding if another override is run than the one asked for.

    Raises:
        InputError: The profile means nothing.
    """
    curve, asked = trajectory.polynomial, checked_profile(profile)

    def run(profile: Profile) -> tuple[PiecewisePolynomial, PiecewisePolynomial]:
        clock = profile.clock(trajectory.start_time, trajectory.duration)
        through = inverse_time(clock, passed_times(times, clock)).tolist()
        return cubic_through(composed(curve, clock), TOLERANCE, through)[0], clock

    motion, clock = run(asked)
    if asked.rates.max() > 1.0 or keeps_limits(motion, curve, *limits):
        return motion, clock, []
    tried = sorted(product(CAPS, STRETCHES), key=lambda one: 20.0 * (1.0 - one[0]) + one[1])
    for cap, stretch in tried:  # a lower override counts more than a slower change of it
        found = _slower(asked, cap, stretch)
        other, slower = run(found)
        if keeps_limits(other, curve, *limits):
            return other, slower, [_told(asked, found, float(slower.x[-1]))]
    return motion, clock, []


def _slower(asked: Profile, cap: float, stretch: float) -> Profile:
    """An override that is nowhere greater than a cap, and whose changes take longer."""
    times, rates = [0.0], [min(float(asked.rates[0]), cap)]
    for begin, end, rate in zip(asked.times, asked.times[1:], asked.rates[1:], strict=False):
        if min(rate, cap) == rates[-1]:
            continue
        if begin - times[-1] > NEAR:
            times.append(float(begin))
            rates.append(rates[-1])
        times.append(times[-1] + stretch * float(end - begin))
        rates.append(min(float(rate), cap))
    return Profile(np.array(times), np.array(rates))


def passed_times(times: FloatArray, clock: PiecewisePolynomial) -> FloatArray:
    """Those times that a clock shows."""
    first, last = clock(clock.x[[0, -1]])
    passed: FloatArray = times[(times >= first - NEAR) & (times <= last + NEAR)]
    return passed


def _told(asked: Profile, found: Profile, end: float) -> Finding:
    """What override is run, until some time, in place of the one that was asked for."""

    def said(profile: Profile) -> str:
        count = int(np.searchsorted(profile.times, end)) + 1  # with the end of its last change
        pairs = zip(profile.times[:count], profile.rates[:count], strict=True)
        return ", ".join(f"{time:.4g}: {rate:.3g}" for time, rate in pairs)

    return Finding(
        "Warnings",
        "motion",
        "",
        "override",
        "warning",
        f"the override {{{said(asked)}}} changes faster than limits of acceleration and jerk "
        f"allow; run instead: {{{said(found)}}}",
    )
