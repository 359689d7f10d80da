"""Active limits: the fraction of each interval in which a joint is at a limit."""

from __future__ import annotations

import numpy as np

from knotwork.planning.timing.timed_motion import Binding
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray

BINDING_SAMPLES = 100
"""Samples in each interval."""

ACTIVE_LIMIT_DISTANCE = 1e-3
"""Relative distance within which a joint is at a limit."""

MIN_ACTIVE_SHARE = 0.02
"""Minimum fraction of an interval for which an active limit is reported, if there are others."""

TOUCH_DISTANCE = 0.02
"""Relative distance within which a limit counts as touched."""


def binding_limits(
    problem: TimingProblem, time: FloatArray, curve: PiecewisePolynomial
) -> tuple[Binding, ...]:
    """Find the active limits of each interval, those that are active longest first.

    Args:
        problem: The waypoints and the limits.
        time: Times of the waypoints [s], shape (n,).
        curve: Joint positions.
    """
    places = (np.arange(BINDING_SAMPLES) + 0.5) / BINDING_SAMPLES
    times = time[:-1, None] + places * np.diff(time)[:, None]
    limits = problem.limits
    active: list[Binding] = []
    uses = {
        name: np.abs(curve(times, order)) / getattr(limits, name)
        for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk"))
    }
    q = curve(times)
    if problem.dynamics is not None and np.isfinite(limits.effort).any():
        efforts = problem.dynamics.effort(q, curve(times, 1), curve(times, 2))
        uses["effort"] = np.abs(efforts) / limits.effort
    if problem.dynamics is not None and np.isfinite(limits.tool_speed):
        speed = problem.dynamics.tool_speed(q, curve(times, 1)) / limits.tool_speed
        uses["tool speed"] = speed[:, :, None]
    peaks = {name: use.max(axis=1) for name, use in uses.items()}
    shares = {
        name: np.mean(use >= 1.0 - ACTIVE_LIMIT_DISTANCE, axis=1) for name, use in uses.items()
    }
    width = ACTIVE_LIMIT_DISTANCE * np.where(
        np.isfinite(limits.upper - limits.lower), limits.upper - limits.lower, 0
    )
    shares["position"] = np.mean((q <= limits.lower + width) | (q >= limits.upper - width), axis=1)
    for i in range(len(problem.position) - 1):
        at_limit = [
            (float(share[i, k]), name, int(k))
            for name, share in shares.items()
            for k in np.flatnonzero(share[i] >= MIN_ACTIVE_SHARE)
        ]
        at_limit.sort(key=lambda entry: -entry[0])
        if not at_limit and (problem.free[i] or problem.total is not None):
            name = max(peaks, key=lambda name: float(peaks[name][i].max()))
            k = int(peaks[name][i].argmax())
            if peaks[name][i, k] >= 1.0 - TOUCH_DISTANCE:
                at_limit = [(float(shares[name][i, k]), name, k)]
        for part, name, k in at_limit:
            joint = "" if name == "tool speed" else problem.joint_names[k]
            ends = problem.names[i], problem.names[i + 1]
            active.append(Binding(*ends, joint, name, round(part, 2)))
    return tuple(active)
