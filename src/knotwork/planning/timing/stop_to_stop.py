"""Motions that come to rest in each interval, in closed form: not time-optimal, no solver."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from knotwork.planning.timing.exact_curve import (
    MotionKnots,
    concatenate_knots,
    correct_accelerations,
    divide_pieces,
)
from knotwork.planning.timing.spline import pieces_each
from knotwork.planning.timing.timing_problem import Objective, TimingLimits, TimingProblem, part_of
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class _Phases:
    """Part of a motion.

    Attributes:
        span: Durations of its phases [s], shape (k,).
        acceleration: Accelerations at their ends, shape (k + 1, d).
        move: Displacement of the joints, shape (d,).
    """

    span: FloatArray
    acceleration: FloatArray
    move: FloatArray


MIN_PHASE_SHARE = 1e-3
"""Minimum duration of a phase of a first motion, relative to the whole."""


SLOWDOWN_FACTORS = (1.0, 1.01, 1.1, 1.3, 1.6, 2.0, 3.0, 4.0, 6.0, 9.0)
"""Candidate factors by which a motion is slowed down for efforts and tool speed, in order."""


def resting_knots(
    problem: TimingProblem, slower: float, braking: float = 1.0
) -> MotionKnots | None:
    """A motion with a stop at every waypoint, or if it moves there, after it and before the next.

    Between rests all joints move proportionally.

    Args:
        problem: The problem; the caller checks the limits.
        slower: Factor on the minimum durations between rests, if they are unknown.
        braking: Factor on the durations to rest and from rest.

    Returns:
        The motion, or `None` if a given duration is too short, jerk is not limited, or nothing
        moves.
    """
    if np.isinf(problem.limits.jerk).any():
        return None
    v = np.where(problem.velocity_known[:, None], problem.velocity, 0.0)
    a = np.where(problem.acceleration_known[:, None], problem.acceleration, 0.0)
    parts = []
    for i in range(len(problem.position) - 1):
        ends = slice(i, i + 2)
        alone = replace(
            part_of(problem, i, i + 1), velocity=v[ends], acceleration=a[ends], total=None
        )
        part = _with_rest(alone, slower, braking)
        if part is None:
            return None
        parts.append(part)
    knots = concatenate_knots(parts)
    excess = 0.0 if problem.total is None else problem.total - float(knots.time[-1])
    if problem.total is None or abs(excess) <= 1e-12 * problem.total:
        return knots
    free, durations = problem.free, np.diff(knots.time)
    if excess < 0.0 or not free.any():
        return None
    durations[free] *= 1.0 + excess / durations[free].sum()
    return resting_knots(replace(problem, duration=durations, total=None), slower, braking)


def with_longer(problem: TimingProblem) -> TimingProblem:
    """The minimum-time problem, with given durations as lower bounds."""
    return replace(
        problem,
        duration=np.full(problem.duration.shape, np.nan),
        at_least=np.where(problem.free, problem.at_least, problem.duration),
        total=None,
        objective=Objective(),
    )


def _with_rest(problem: TimingProblem, slower: float, braking: float) -> MotionKnots | None:
    """The motion over one interval with known ends."""
    q, v, a = problem.position, problem.velocity, problem.acceleration
    before = _to_rest(v[0], a[0], problem.limits, braking)
    after = _to_rest(-v[1], a[1], problem.limits, braking)  # backwards in time
    rests = replace(
        problem,
        position=np.stack((q[0] + before.move, q[1] + after.move)),
        velocity=np.zeros_like(v),
        acceleration=np.zeros_like(a),
    )
    ends = float(before.span.sum() + after.span.sum())
    middle = _between_rests(rests, ends, slower)
    if middle is None:
        return None
    span = np.concatenate((before.span, middle.span, after.span[::-1]))
    rows = (before.acceleration[:-1], middle.acceleration[:-1], after.acceleration[::-1])
    total = float(span.sum())
    return MotionKnots(np.array([0.0, total]), span[None] / total, q, v, np.concatenate(rows)[None])


def _between_rests(problem: TimingProblem, ends: float, slower: float) -> _Phases | None:
    """The motion from rest to rest, between phases whose total duration is `ends` [s]."""
    asked, at_least = (float(h[0]) - ends for h in (problem.duration, problem.at_least))
    move = np.diff(problem.position, axis=0)[0]
    moving = _fastest_between_rests(problem, move) if move.any() else None
    least = 0.0 if moving is None else float(moving.time[-1])
    span = max(slower * least, at_least) if np.isnan(asked) else asked
    if moving is not None and span > 0.0:
        # the phases before and after must not change with the rounding of this one
        slowed = correct_accelerations(moving).acceleration[0] * (least / span) ** 2
        return _Phases(span * moving.share[0], slowed, move)
    if moving is not None or span < 0.0 or not span + ends:
        return None
    stands = np.array([span] if span else [])
    return _Phases(stands, np.zeros((len(stands) + 1, len(move))), move)


def _fastest_between_rests(problem: TimingProblem, move: FloatArray) -> MotionKnots:
    """The minimum-time proportional motion, with a ramp up to a velocity and one down from it.

    In each ramp the acceleration increases, stays at its limit if it reaches it, and decreases.
    """
    moves = move != 0.0
    limits = problem.limits
    V, A, J = (
        float((limit[moves] / np.abs(move[moves])).min())
        for limit in (limits.velocity, limits.acceleration, limits.jerk)
    )
    # at this velocity the ramps alone cover the whole move
    peak = float(np.cbrt(0.25 * J))
    if peak > A * A / J:
        peak = 0.5 * (np.sqrt((A * A / J) ** 2 + 4.0 * A) - A * A / J)
    v = min(V, peak)
    rise = min(A / J, np.sqrt(v / J))
    hold = max(v / (J * rise) - rise, 0.0)
    cruise = max(1.0 / v - 2.0 * rise - hold, 0.0)
    span = np.array([rise, hold, rise, cruise, rise, hold, rise])
    span = np.maximum(span, MIN_PHASE_SHARE * span.sum())
    a = J * rise * np.array([0.0, 1, 1, 0, 0, -1, -1, 0])
    knots = MotionKnots(
        np.array([0.0, span.sum()]),
        span[None] / span.sum(),
        problem.position,
        np.zeros_like(problem.velocity),
        (a[:, None] * move)[None],
    )
    return divide_pieces(knots, pieces_each(1))  # corrections are smaller over more pieces


def _to_rest(v: FloatArray, a: FloatArray, limits: TimingLimits, slower: float) -> _Phases:
    """Motion to zero acceleration, and then motion of all joints to rest in a common time.

    Args:
        v: Initial velocities, shape (d,).
        a: Initial accelerations, shape (d,).
        limits: Limits of the joints.
        slower: Factor on the minimum time of the second phase.
    """
    still = np.zeros_like(v)
    first = float(np.max(np.abs(a) / limits.jerk))
    if first:
        first = max(first, MIN_PHASE_SHARE * _braking_time(v, limits))
    excess = v + 0.5 * first * a
    second = slower * _braking_time(excess, limits)
    if second:
        second = max(second, MIN_PHASE_SHARE * first)
        span = np.array([first, 0.5 * second, 0.5 * second])
        rows = np.stack((a, still, -2.0 * excess / second, still))
    else:
        span, rows = np.array([first]), np.stack((a, still))
    if not first:
        span, rows = span[1:], rows[1:]
    gain = 0.5 * span[:, None] * (rows[:-1] + rows[1:])
    begun = v + np.cumsum(gain, axis=0) - gain
    moved = span[:, None] * begun + span[:, None] ** 2 * (2.0 * rows[:-1] + rows[1:]) / 6.0
    return _Phases(span, rows, moved.sum(axis=0))


def _braking_time(v: FloatArray, limits: TimingLimits) -> float:
    """Minimum time in which all joints come to rest, with a rise and a fall of the acceleration."""
    speed = np.abs(v)
    with_acceleration, with_jerk = speed / limits.acceleration, np.sqrt(speed / limits.jerk)
    return 2.0 * float(np.maximum(with_acceleration, with_jerk).max())
