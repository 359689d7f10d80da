"""Where which limit binds: for what part of each interval a joint is at it."""

from __future__ import annotations

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.motion import Binding
from knotwork.timing.problem import TimingProblem
from knotwork.waypoints import FloatArray

PLACES = 100
"""Times looked at in each interval."""

NEAR = 1e-3
"""A joint is at a limit if it is within this part of it."""

WORTH_SAYING = 0.02
"""A limit that binds for a smaller part of an interval is not told."""


def binding_limits(
    problem: TimingProblem, time: FloatArray, curve: PiecewisePolynomial
) -> tuple[Binding, ...]:
    """Find the limits that are met, interval by interval, those that bind longest first.

    Args:
        problem: The waypoints and the limits.
        time: Of the waypoints [s], shape (n,).
        curve: Joint positions.
    """
    places = (np.arange(PLACES) + 0.5) / PLACES
    times = time[:-1, None] + places * np.diff(time)[:, None]
    limits = problem.limits
    found: list[Binding] = []
    shares = {
        name: _share(np.abs(curve(times, order)), getattr(limits, name))
        for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk"))
    }
    q = curve(times)
    width = NEAR * np.where(
        np.isfinite(limits.upper - limits.lower), limits.upper - limits.lower, 0
    )
    shares["position"] = np.mean((q <= limits.lower + width) | (q >= limits.upper - width), axis=1)
    if problem.dynamics is not None and np.isfinite(limits.effort).any():
        efforts = problem.dynamics.effort(q, curve(times, 1), curve(times, 2))
        shares["effort"] = _share(np.abs(efforts), limits.effort)
    tool = np.zeros(len(q))
    if problem.dynamics is not None and np.isfinite(limits.tool_speed):
        speed = problem.dynamics.tool_speed(q, curve(times, 1))
        tool = np.mean(speed >= (1.0 - NEAR) * limits.tool_speed, axis=1)
    for i in range(len(problem.position) - 1):
        ends = problem.names[i], problem.names[i + 1]
        here = [
            Binding(*ends, joint, name, round(float(share[i, k]), 2))
            for name, share in shares.items()
            for k, joint in enumerate(problem.joint_names)
            if share[i, k] >= WORTH_SAYING
        ]
        if tool[i] >= WORTH_SAYING:
            here.append(Binding(*ends, "", "tool speed", round(float(tool[i]), 2)))
        found += sorted(here, key=lambda one: -one.share)
    return tuple(found)


def _share(size: FloatArray, limit: FloatArray) -> FloatArray:
    """Part of each interval in which a size is at its limit, shape (n-1, d)."""
    return np.asarray(np.mean(size >= (1.0 - NEAR) * limit, axis=1))
