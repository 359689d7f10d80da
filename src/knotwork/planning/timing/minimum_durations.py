"""Minimum durations in closed form, under limits of velocity, acceleration and tool speed.

The minimum-time motion of a joint by D with velocities v0 and v1 at its ends, |v| <= V and |a| <=
A, accelerates to a peak velocity and then decelerates, or the reverse. If the peak would exceed V,
there is a phase at V. If both velocities have the same direction, durations slightly above the
minimum may be infeasible, up to the duration in which the joint can stop.

The path of the tool between two waypoints is at least as long as a straight line.
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.units import rounded_up

DURATION_RESERVE = 1e-4
"""Relative margin of a reported duration over a sufficient one."""


def lower_bound(problem: TimingProblem) -> float:
    """Lower bound on the duration under limits of velocity, acceleration and tool speed [s].

    It is a sum over the intervals. Each term is the maximum of three durations: the minimum
    duration that is feasible for every joint independently, the duration of a straight line of the
    tool at its maximum speed, and the lower bound given in the problem.

    >>> from knotwork.joint_quantities import JointLimits
    >>> limits = JointLimits(velocity=[1.0], acceleration=[4.0])
    >>> lower_bound(TimingProblem(("a",), [[0], [1]], [[0], [0]], limits))
    1.25
    """
    if problem.total is not None:
        return problem.total
    return float(interval_bounds(problem).sum())


def interval_bounds(problem: TimingProblem) -> FloatArray:
    """Given durations of the intervals, or else lower bounds on them [s], shape (n-1,)."""
    bounds = np.maximum(min_durations(problem), problem.min_duration)
    return np.where(problem.duration_is_unknown, bounds, problem.duration)


def min_durations(problem: TimingProblem) -> FloatArray:
    """Lower bounds on the durations from the limits alone [s], shape (n-1,)."""
    known = problem.velocity_known
    durations: FloatArray = _of_joints(problem).max(axis=1)
    for i in np.flatnonzero(known[:-1] & known[1:]):
        durations[i] = _common_duration(problem, int(i))
    return np.maximum(durations, _straight_lines(problem))


def slowest_text(problem: TimingProblem, i: int) -> str:
    """Text that names what determines the lower bound of an interval: a joint, the tool or all."""
    alone, bound = _of_joints(problem)[i], min_durations(problem)[i]
    if alone.max() >= bound:
        return f"joint {problem.joint_names[int(alone.argmax())]!r}"
    if _straight_lines(problem)[i] >= bound:
        return "the tool, on the straight line,"
    return "all joints together"


def _of_joints(problem: TimingProblem) -> FloatArray:
    """Minimum durations of each joint independently [s], shape (n-1, d)."""
    v, known = problem.velocity, problem.velocity_known
    V, A = problem.limits.velocity, problem.limits.acceleration
    D = np.diff(problem.position, axis=0)
    durations = np.abs(D) / V
    for i in np.flatnonzero(known[:-1] | known[1:]):
        if known[i] and known[i + 1]:
            durations[i] = problem.feasible_durations(int(i)).minimum
        else:
            durations[i] = _one_end_unknown(D[i], v[i] if known[i] else v[i + 1], V, A)
    return durations


def _straight_lines(problem: TimingProblem) -> FloatArray:
    """Minimum durations under the limit of tool speed alone [s], shape (n-1,)."""
    limit = problem.tool_speed
    if np.isinf(limit):
        return np.zeros(len(problem.position) - 1)
    positions = [problem.required_dynamics.robot.forward(q).translation for q in problem.position]
    return np.asarray(np.linalg.norm(np.diff(positions, axis=0), axis=1) / limit)


def _common_duration(problem: TimingProblem, i: int) -> float:
    """Minimum duration of an interval that is feasible for every joint."""
    feasible = problem.feasible_durations(i)
    duration = float(feasible.minimum.max())
    while (in_between := (duration > feasible.early_end) & (duration < feasible.late_start)).any():
        duration = float(feasible.late_start[in_between].max())
    return duration


def _one_end_unknown(move: FloatArray, v: FloatArray, V: FloatArray, A: FloatArray) -> FloatArray:
    """Minimum duration with the velocity given at one end only, shape (d,)."""
    D, v = np.abs(move), np.where(move < 0.0, -v, v)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        reach = (V * V - v * v) / (2.0 * A)  # distance until V is reached
        root = np.sqrt(v * v + 2.0 * A * D)
        rising = np.where(v < 0.0, (root - v) / A, 2.0 * D / (v + root))  # without cancellation
        cruising = (V - v) / A + (D - reach) / V
    durations = np.where(reach < D, cruising, rising)
    return np.where(D == 0.0, 0.0, np.where(np.isinf(A), D / V, durations))


def sufficient_duration(value: float) -> float:
    """A duration slightly above a feasible one, with few digits.

    >>> sufficient_duration(1.3833333)
    1.384
    """
    return rounded_up(value * (1.0 + DURATION_RESERVE), 4)
