"""Speed overrides: the motion of a plan at another speed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.retiming import (
    Profile,
    checked_profile,
    composed,
    cubic_through,
    inverse_time,
    keeps_limits,
    slower_ramps,
)
from knotwork.trajectory import JointTrajectory
from knotwork.verification import Finding
from knotwork.waypoints import FloatArray

TOLERANCE = 1e-6
"""Largest deviation of a joint from the planned path [rad or m]."""

NEAR = 1e-9
"""Times nearer to one another than this [s] are the same."""

SHARES = (0.999, 0.99, 0.95)
"""Shares of the limits permitted at samples of an override, until all times keep the limits."""


def run_by(
    profile: Mapping[float, float],
    trajectory: JointTrajectory,
    times: FloatArray,
    limits: tuple[FloatArray, FloatArray],
) -> tuple[PiecewisePolynomial, PiecewisePolynomial, list[Finding]]:
    """A motion at another speed, within limits if the override is at most 1.

    Args:
        profile: Speed override by time [s].
        trajectory: The motion.
        times: Waypoint times [s].
        limits: Limits of acceleration and jerk, shape (d,) each; infinite without one.

    Returns:
        The motion, its clock, and a finding if another override than requested is executed.

    Raises:
        InputError: The profile is invalid.
    """
    curve, asked = trajectory.polynomial, checked_profile(profile)

    def run(profile: Profile) -> tuple[PiecewisePolynomial, PiecewisePolynomial]:
        clock = profile.clock(trajectory.start_time, trajectory.duration)
        through = inverse_time(clock, passed_times(times, clock)).tolist()
        return cubic_through(composed(curve, clock), TOLERANCE, through)[0], clock

    motion, clock = run(asked)
    if asked.rates.max() > 1.0 or keeps_limits(motion, curve, *limits):
        return motion, clock, []
    for share in SHARES:
        for found in slower_ramps(asked, curve, share * limits[0], share * limits[1]):
            other, slower = run(found)
            if keeps_limits(other, curve, *limits):
                return other, slower, [_told(asked, found, float(slower.x[-1]))]
    return motion, clock, []


def passed_times(times: FloatArray, clock: PiecewisePolynomial) -> FloatArray:
    """Waypoint times that the retimed motion reaches."""
    first, last = clock(clock.x[[0, -1]])
    passed: FloatArray = times[(times >= first - NEAR) & (times <= last + NEAR)]
    return passed


def _told(asked: Profile, found: Profile, end: float) -> Finding:
    """Finding on the override executed until a time, in place of the requested one."""

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
        f"allow; executed instead: {{{said(found)}}}",
    )
