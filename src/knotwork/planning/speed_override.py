"""Speed overrides: the motion of a plan at another speed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.monotone import first_times
from knotwork.curves.retiming import (
    SpeedOverride,
    approximate_by_cubics,
    compose,
    keeps_joint_limits,
    make_override,
)
from knotwork.curves.trajectory import JointTrajectory
from knotwork.curves.trajectory.motion_events import TIME_TOLERANCE
from knotwork.joint_quantities import JointLimits
from knotwork.verification import Finding
from knotwork.verification.finding import Group, Topic

ATTEMPTS = (
    *((1.0, 1.5), (0.97, 1.0), (0.97, 2.5), (0.9, 1.0)),
    *((0.97, 5.0), (0.8, 2.5), (0.8, 10.0), (0.5, 5.0)),
)
"""Candidates where limits are exceeded: maximum overrides, and factors on the durations of changes.

The first ones are nearest to the request.
"""


def change_speed(
    profile: Mapping[float, float],
    trajectory: JointTrajectory,
    times: FloatArray,
    limits: JointLimits,
) -> tuple[PiecewisePolynomial, PiecewisePolynomial, list[Finding]]:
    """A motion at another speed, within limits if the override is at most 1 and one is found.

    Args:
        profile: Speed override by time [s].
        trajectory: The motion.
        times: Waypoint times [s].
        limits: Limits; those of acceleration and jerk are kept.

    Returns:
        The motion, its clock, and a finding if the override exceeds limits.

    Raises:
        InputError: The profile is invalid.
    """
    curve, requested = trajectory.polynomial, make_override(profile)

    def execute(override: SpeedOverride) -> tuple[PiecewisePolynomial, PiecewisePolynomial]:
        clock = override.clock(trajectory.start_time, trajectory.duration)
        first, last = clock(clock.x[[0, -1]])
        passed = times[(times >= first - TIME_TOLERANCE) & (times <= last + TIME_TOLERANCE)]
        reached = first_times(clock, passed).tolist()
        return approximate_by_cubics(compose(curve, clock), through=reached)[0], clock

    motion, clock = execute(requested)
    if requested.rates.max() > 1.0 or keeps_joint_limits(motion, curve, limits):
        return motion, clock, []
    for cap, factor in ATTEMPTS:
        executed = _slow_down(requested, cap, factor)
        slower, slower_clock = execute(executed)
        if keeps_joint_limits(slower, curve, limits):
            end = float(slower_clock.x[-1])
            instead = f"executed instead: {{{_override_text(executed, end)}}}"
            return slower, slower_clock, [_override_finding(requested, end, instead)]
    instead = "no slower one that keeps them was found"
    return motion, clock, [_override_finding(requested, float(clock.x[-1]), instead)]


def _slow_down(requested: SpeedOverride, cap: float, factor: float) -> SpeedOverride:
    """An override that never exceeds a cap, with changes that take longer."""
    times, rates = [0.0], [min(float(requested.rates[0]), cap)]
    for begin, end, rate in zip(
        requested.times, requested.times[1:], requested.rates[1:], strict=False
    ):
        if min(rate, cap) == rates[-1]:
            continue
        if begin - times[-1] > TIME_TOLERANCE:
            times.append(float(begin))
            rates.append(rates[-1])
        times.append(times[-1] + factor * float(end - begin))
        rates.append(min(float(rate), cap))
    return SpeedOverride(np.array(times), np.array(rates))


def _override_finding(requested: SpeedOverride, end: float, instead: str) -> Finding:
    """Finding on a requested override that exceeds limits, and the one executed until a time."""
    fact = (
        f"the override {{{_override_text(requested, end)}}} changes faster than limits of "
        f"acceleration and jerk allow; {instead}"
    )
    return Topic(Group.WARNINGS).finding("override", fact, "warning")


def _override_text(override: SpeedOverride, end: float) -> str:
    """Values of an override by time, until a time."""
    count = int(np.searchsorted(override.times, end)) + 1  # with the end of its last change
    pairs = zip(override.times[:count], override.rates[:count], strict=True)
    return ", ".join(f"{time:.4g}: {rate:.3g}" for time, rate in pairs)
