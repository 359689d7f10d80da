"""Motions that come to rest in each interval, in closed form: not time-optimal, no solver."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.from_accelerations import cubics_from_accelerations
from knotwork.curves.retiming.stops import stop_joints
from knotwork.joint_quantities import JointLimits
from knotwork.planning.timing.motion_curves import concatenate, reverse, slow_down
from knotwork.planning.timing.tightening import keeps_limits
from knotwork.planning.timing.timed_motion import Status, TimedCurve
from knotwork.planning.timing.timing_problem import Objective, TimingProblem

MIN_RAMP_SHARE = 1e-3
"""Minimum duration of a change of the acceleration between rests, relative to a lower bound on the
whole duration.
"""

MIN_PHASE_SHARE = 1e-12
"""Duration relative to the whole below which phases are left out."""

STOP_MARGIN = 1e-5
"""Relative margin of jerk in stops, for the rounding of their times: phases may be very short."""

STILL_PIECES = 3
"""Number of pieces of an interval in which no joint moves."""

SLOWDOWN_FACTORS = (1.0, 1.01, 1.1, 1.3, 1.6, 2.0, 3.0, 4.0, 6.0, 9.0)
"""Candidate factors by which a motion is slowed down for efforts and tool speed, in order."""


def resting_motion(problem: TimingProblem, status: Status) -> TimedCurve | None:
    """A motion that rests in every interval and keeps every limit, or `None`.

    It is slowed down by the first of `SLOWDOWN_FACTORS` that is sufficient; a smaller factor
    between two of them may suffice, too.
    """
    moving = bool(problem.velocity[problem.velocity_known].any())
    for slower in SLOWDOWN_FACTORS:
        # a moving arm may have to brake at once, and can move slowly after that
        for braking in sorted({1.0, slower} if moving else {slower}):
            intervals = _resting_intervals(problem, slower, braking)
            if intervals is None:
                return None
            curve = concatenate(*intervals)
            if keeps_limits(problem, curve):
                time = np.cumsum([0.0, *(interval.x[-1] for interval in intervals)])
                return TimedCurve(time, curve, status)
    return None


def _resting_intervals(
    problem: TimingProblem, slower: float, braking: float = 1.0
) -> list[PiecewisePolynomial] | None:
    """A motion that stops at every waypoint, or before and after one that is passed at speed.

    Between rests all joints move proportionally. Stops are those of independent joints.

    Args:
        problem: The problem; the caller checks the limits.
        slower: Factor on the minimum durations between rests, if they are unknown.
        braking: Divisor of the limits of acceleration and jerk in stops from given velocities.

    Returns:
        The motions of the intervals, each from time 0 on. `None` if a given duration is too short,
        jerk is not limited, or nothing moves.
    """
    if np.isinf(problem.limits.jerk).any():
        return None
    stops = [_next_to(problem, i, braking) for i in range(len(problem.position))]
    intervals = []
    for i, ((_, before), (after, _)) in enumerate(pairwise(stops)):
        start = problem.position[i] if before is None else before(before.x[-1])
        goal = problem.position[i + 1] if after is None else after(0.0)
        used = sum(float(part.x[-1]) for part in (before, after) if part is not None)
        moves = bool((start != goal).any())
        straight = _straight_motion(start, goal, problem.limits) if moves else _still(start)
        shortest = float(straight.x[-1]) if moves else 0.0
        span = float(problem.duration[i]) - used
        if np.isnan(span):
            span = max(slower * shortest, float(problem.min_duration[i]) - used)
        if span < shortest:
            return None
        between = slow_down(straight, span / float(straight.x[-1])) if span > 0.0 else None
        if before is between is after:
            return None
        intervals.append(concatenate(before, between, after))
    if problem.total is None:
        return intervals
    durations = np.array([interval.x[-1] for interval in intervals])
    is_unknown = problem.duration_is_unknown
    excess = problem.total - durations.sum()
    if abs(excess) <= 1e-12 * problem.total:
        return intervals
    if excess < 0.0 or not is_unknown.any():
        return None
    durations[is_unknown] *= 1.0 + excess / durations[is_unknown].sum()
    return _resting_intervals(replace(problem, duration=durations, total=None), slower, braking)


def with_longer(problem: TimingProblem) -> TimingProblem:
    """The minimum-time problem, with given durations as lower bounds."""
    return replace(
        problem,
        duration=np.full(problem.duration.shape, np.nan),
        min_duration=np.where(problem.duration_is_unknown, problem.min_duration, problem.duration),
        total=None,
        objective=Objective(),
    )


def _next_to(
    problem: TimingProblem, i: int, braking: float
) -> tuple[PiecewisePolynomial | None, PiecewisePolynomial | None]:
    """Motions from rest to a waypoint and from there to rest, if the arm moves there."""
    q, limits = problem.position[i], problem.limits
    v = problem.velocity[i] if problem.velocity_known[i] else np.zeros_like(q)
    a = problem.acceleration[i] if problem.acceleration_known[i] else np.zeros_like(q)
    if not v.any() and not a.any():
        return None, None
    gentle = limits.scaled(1.0 / braking)
    gentle = replace(gentle, jerk=(1.0 - STOP_MARGIN) * gentle.jerk)
    before, after = stop_joints(q, -v, a, gentle), stop_joints(q, v, a, gentle)
    return None if before is None else reverse(before), after


def _still(q: FloatArray) -> PiecewisePolynomial:
    """A motion of 1 s at rest."""
    c = np.zeros((4, STILL_PIECES, len(q)))
    c[-1] = q
    return PiecewisePolynomial(c, np.linspace(0.0, 1.0, STILL_PIECES + 1))


def _straight_motion(
    start: FloatArray, goal: FloatArray, limits: JointLimits
) -> PiecewisePolynomial:
    """The minimum-time proportional motion, with a ramp up to a velocity and one down from it.

    In each ramp the acceleration increases, stays at its limit if it reaches it, and decreases.
    """
    move = goal - start
    moves = move != 0.0
    V, A, J = (
        float((limit[moves] / np.abs(move[moves])).min())
        for limit in (limits.velocity, limits.acceleration, limits.jerk)
    )
    least_rise = MIN_RAMP_SHARE * max(1.0 / V, 2.0 / np.sqrt(A))
    if least_rise:
        J = min(J, A / least_rise, V / least_rise**2)
    # at this velocity the ramps alone cover the whole move
    peak = float(np.cbrt(0.25 * J))
    if peak > A * A / J:
        peak = 0.5 * (np.sqrt((A * A / J) ** 2 + 4.0 * A) - A * A / J)
    v = min(V, peak)
    rise = min(A / J, np.sqrt(v / J))
    hold = max(v / (J * rise) - rise, 0.0)
    cruise = max(1.0 / v - 2.0 * rise - hold, 0.0)
    span = np.array([rise, hold, rise, cruise, rise, hold, rise])
    present = span > MIN_PHASE_SHARE * span.sum()
    span = span[present]
    a = J * rise * np.append(0.0, np.array([1.0, 1, 0, 0, -1, -1, 0])[present])
    rest = np.zeros((2, 1))
    c = cubics_from_accelerations(span[None], a[None, :, None], rest, rest)
    along = PiecewisePolynomial(c, np.append(0.0, np.cumsum(span)))
    c = c * (move / along(along.x[-1]))
    c[-1] += start
    return PiecewisePolynomial(c, along.x)
