"""The active limits of a motion, by interval."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.timing.state_limits import LimitedQuantity, problem_state_limits
from knotwork.planning.timing.timing_problem import TimingProblem

SAMPLES_PER_INTERVAL = 100
"""Number of samples in each interval."""
ACTIVE_LIMIT_DISTANCE = 1e-3
"""Relative distance from a limit within which it is active."""
MIN_ACTIVE_SHARE = 0.02
"""Minimum fraction of an interval in which a limit is active to be reported, if there are other
ones.
"""
PEAK_DISTANCE = 0.02
"""Relative distance from a limit of the peak for which it is reported, if no limit is active."""


@dataclass(frozen=True)
class ActiveLimit:
    """An active limit of an interval.

    Attributes:
        start, end: Names of the waypoints at the ends of the interval.
        subject: Name of the joint or link; empty for the tool and for other bounds.
        quantity: `"velocity"`, `"acceleration"`, `"jerk"`, `"position"`, `"effort"` or
            `"tool_speed"`; for a speed along a path also `"at_most"`, `"path acceleration"`,
            `"path tolerance"` or `"adjacent motion"`.
        share: Fraction of the interval's duration in which the limit is active. It is 0 if a peak
            is only near the limit, and `None` for a bound on a constant speed along a path.
    """

    start: str
    end: str
    subject: str
    quantity: str
    share: float | None


def find_active_limits(
    problem: TimingProblem, time: FloatArray, curve: PiecewisePolynomial
) -> tuple[ActiveLimit, ...]:
    """Find the active limits of each interval, those that are active longest first.

    Args:
        problem: The waypoints and the limits.
        time: Times of the waypoints [s], shape (n,).
        curve: Joint positions.
    """
    fractions = (np.arange(SAMPLES_PER_INTERVAL) + 0.5) / SAMPLES_PER_INTERVAL
    times = time[:-1, None] + fractions * np.diff(time)[:, None]
    limits = problem.limits
    q = curve(times)
    width = limits.upper - limits.lower
    slack = np.where(np.isfinite(width), ACTIVE_LIMIT_DISTANCE * width, 0.0)
    at_end = (q <= limits.lower + slack) | (q >= limits.upper - slack)
    of_states = problem_state_limits(problem)
    utilisation = of_states.utilisation(curve, times)
    utilisation = np.concatenate((utilisation, at_end), axis=-1)
    quantities = of_states.quantities
    quantities += [LimitedQuantity(joint, "position") for joint in problem.joint_names]
    peaks = utilisation.max(axis=1)
    shares = np.mean(utilisation >= 1.0 - ACTIVE_LIMIT_DISTANCE, axis=1)
    active: list[ActiveLimit] = []
    for i, (start, end) in enumerate(pairwise(problem.names)):
        longest_first = np.argsort(-shares[i], kind="stable")
        at_limit = longest_first[shares[i, longest_first] >= MIN_ACTIVE_SHARE]
        if not at_limit.size and (problem.duration_is_unknown[i] or problem.total is not None):
            at_limit = peaks[i].argmax(keepdims=True)
            at_limit = at_limit[peaks[i, at_limit] >= 1.0 - PEAK_DISTANCE]
        for k in at_limit.tolist():
            share = round(float(shares[i, k]), 2)
            limited = quantities[k]
            active.append(ActiveLimit(start, end, limited.subject, limited.quantity, share))
    return tuple(active)
