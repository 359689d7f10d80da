"""Least durations in closed form, under limits of velocity, acceleration and the tool's speed.

A joint that moves by D with velocity v0 at the start and v1 at the end, |v| <= V and |a| <= A, is
fastest if it first accelerates to a peak velocity and then decelerates, or the reverse, with a
stretch at V between where the peak would be higher. With both velocities in the same direction it
can't wait: durations a little longer than the least may be impossible, until it can stop.

The tool's way from one waypoint to the next is no shorter than a straight line.
"""

from __future__ import annotations

import numpy as np

from knotwork.polynomial.least_durations import feasible_durations
from knotwork.timing.problem import TimingProblem
from knotwork.waypoints import FloatArray


def lower_bound(problem: TimingProblem) -> float:
    """Duration below which no motion keeps the limits of velocity, acceleration and tool speed [s].

    It is the sum over the intervals of the least duration that suits every joint alone, or that the
    tool takes for a straight line at its greatest speed, or what the problem prescribes, whichever
    is most.

    >>> from knotwork.timing import TimingLimits
    >>> limits = TimingLimits(velocity=[1.0], acceleration=[4.0])
    >>> lower_bound(TimingProblem(("a",), [[0], [1]], [[0], [0]], limits))
    1.25
    """
    if problem.total is not None:
        return problem.total
    return float(interval_bounds(problem).sum())


def interval_bounds(problem: TimingProblem) -> FloatArray:
    """Least durations of the intervals [s], shape (n-1,); those given are taken as they are."""
    least = np.maximum(least_durations(problem), problem.at_least)
    return np.where(problem.free, least, problem.duration)


def least_durations(problem: TimingProblem) -> FloatArray:
    """Least durations of the intervals under the limits alone [s], shape (n-1,)."""
    known = problem.velocity_known
    found: FloatArray = _of_joints(problem).max(axis=1)
    for i in np.flatnonzero(known[:-1] & known[1:]):
        found[i] = _together(problem, int(i))
    return np.maximum(found, _straight_lines(problem))


def slowest(problem: TimingProblem, i: int) -> str:
    """What takes the least duration of an interval, in words; the joint's name is quoted."""
    alone, least = _of_joints(problem)[i], least_durations(problem)[i]
    if alone.max() >= least:
        return f"joint {problem.joint_names[int(alone.argmax())]!r}"
    if _straight_lines(problem)[i] >= least:
        return "the tool, on the straight line,"
    return "all joints together"


def _of_joints(problem: TimingProblem) -> FloatArray:
    """Least durations of each joint alone [s], shape (n-1, d)."""
    v, known = problem.velocity, problem.velocity_known
    V, A = problem.limits.velocity, problem.limits.acceleration
    D = np.diff(problem.position, axis=0)
    found = np.abs(D) / V
    for i in np.flatnonzero(known[:-1] | known[1:]):
        if known[i] and known[i + 1]:
            found[i] = feasible_durations(D[i], v[i], v[i + 1], V, A)[0]
        else:
            found[i] = _one_end_free(D[i], v[i] if known[i] else v[i + 1], V, A)
    return found


def _straight_lines(problem: TimingProblem) -> FloatArray:
    """Least durations under the limit of the tool's speed alone [s], shape (n-1,)."""
    most = problem.limits.tool_speed
    if np.isinf(most):
        return np.zeros(len(problem.position) - 1)
    places = [problem.arm.robot.forward(q).translation for q in problem.position]
    return np.asarray(np.linalg.norm(np.diff(places, axis=0), axis=1) / most)


def _together(problem: TimingProblem, i: int) -> float:
    """Least duration of an interval that every joint can take."""
    first, last, next_first = problem.possible_durations(i)
    duration = float(first.max())
    while True:
        blocked = (duration > last) & (duration < next_first)
        if not blocked.any():
            return duration
        duration = float(next_first[blocked].max())


def _one_end_free(move: FloatArray, v: FloatArray, V: FloatArray, A: FloatArray) -> FloatArray:
    """Least duration with the velocity given at one end only, shape (d,)."""
    D, v = np.abs(move), np.where(move < 0.0, -v, v)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        reach = (V * V - v * v) / (2.0 * A)  # how far it comes until it has reached V
        root = np.sqrt(v * v + 2.0 * A * D)
        rising = np.where(v < 0.0, (root - v) / A, 2.0 * D / (v + root))  # without cancellation
        cruising = (V - v) / A + (D - reach) / V
    found = np.where(reach < D, cruising, rising)
    return np.where(D == 0.0, 0.0, np.where(np.isinf(A), D / V, found))
