"""Planner `modified-hermite`: the paper's method, and segments whose knots were chosen beforehand.

Between chosen knots the acceleration is linear, so position and velocity at the waypoints and the
accelerations give the curve. Rounding of the numbers is corrected: in each interval the
accelerations at the knots between the waypoints change by the least that meets position and
velocity at its end.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from knotwork.errors import OptionError
from knotwork.interpolation.hermite import ModifiedHermiteSpline, end_accelerations
from knotwork.interpolation.joining import joined
from knotwork.interpolation.options import PlannerOptions
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.from_accelerations import (
    corrected_accelerations,
    cubics_from_accelerations,
)
from knotwork.waypoints import ChosenRun, FloatArray, JointWaypoints

SAME_TIME = 1e-9
"""Times that differ by less than this, relative to the largest, are one."""

STALE = 1e-3
"""A correction greater than this part of the largest acceleration is no rounding."""


def plan(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of degree three through positions and velocities.

    Modified cubic Hermite interpolation on rebuilt knots, Eqs. (30), (31), (34), (39). Waypoints
    whose acceleration is known are met with it, and divide the curve into sections that don't
    depend on one another. Runs whose motion was chosen are sections, too.

    Args:
        waypoints: Positions and velocities, n >= 2, and accelerations where they are known.
        options: Where the knots sit (`knots`), the accelerations at both ends
            (`end_acceleration`), and the runs that were chosen (`chosen`).

    Raises:
        KnotError: Knots given by hand don't suit the waypoints.
        OptionError: End accelerations, or chosen runs, are not as they must be.
    """
    if options.chosen is not None:
        return with_chosen_runs(waypoints, options)
    return ModifiedHermiteSpline(
        waypoints.time,
        waypoints.position,
        waypoints.velocity,
        knots=options.knots,
        end_acceleration=end_accelerations(options.end_acceleration, waypoints.position.shape[1:]),
        acceleration=waypoints.acceleration,
    )


def with_chosen_runs(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make the curve of chosen runs, and modified Hermite splines before, between and after them.

    Args:
        waypoints: Positions and velocities; accelerations where they are known.
        options: With `chosen`; all others are for the rest of the curve.

    Raises:
        OptionError: A run does not begin, end and pass at waypoints, has fewer than two knots
            between two of them, or overlaps another; or its accelerations are for other waypoints.
    """
    known = (
        np.full(waypoints.position.shape, np.nan)
        if waypoints.acceleration is None
        else np.array(waypoints.acceleration)
    )
    spans = [_span(waypoints, run, i) for i, run in enumerate(options.chosen or ())]
    for (first, last), run in zip(spans, options.chosen or (), strict=True):
        for row, own in ((first, run.acceleration[0]), (last, run.acceleration[-1])):
            known[row] = np.where(np.isnan(known[row]), own, known[row])
    parts: list[tuple[FloatArray, FloatArray]] = []
    done = 0
    for i, ((first, last), run) in enumerate(zip(spans, options.chosen or (), strict=True)):
        if first < done:
            raise OptionError("chosen", f"run {i + 1} begins before the one before it ends")
        parts += _between(waypoints, known, done, first, options)
        parts.append(_run(waypoints, known, first, last, run, i))
        done = last
    parts += _between(waypoints, known, done, len(waypoints.time) - 1, options)
    breaks = np.concatenate([waypoints.time[:1], *(x[1:] for x, _ in parts)])
    return joined(waypoints, np.concatenate([c for _, c in parts], axis=1), breaks)


def _span(waypoints: JointWaypoints, run: ChosenRun, i: int) -> tuple[int, int]:
    """The waypoints where a run begins and ends."""
    if run.acceleration.shape[1:] != waypoints.position.shape[1:]:
        raise OptionError("chosen", f"run {i + 1} has accelerations of other joints")
    ends = []
    for time in (run.times[0], run.times[-1]):
        row = int(np.abs(waypoints.time - time).argmin())
        if abs(waypoints.time[row] - time) > _slack(waypoints):
            raise OptionError(
                "chosen",
                f"run {i + 1} begins or ends at {time:.9g} s, where no waypoint is; times that "
                "were chosen belong to its knots: change both, or choose them again",
            )
        ends.append(row)
    return ends[0], ends[1]


def _slack(waypoints: JointWaypoints) -> float:
    return SAME_TIME * max(1.0, float(np.abs(waypoints.time).max()))


def _between(
    waypoints: JointWaypoints, known: FloatArray, first: int, last: int, options: PlannerOptions
) -> list[tuple[FloatArray, FloatArray]]:
    """Knots and coefficients of the curve between runs; none where nothing is between."""
    if first == last:
        return []
    rows = slice(first, last + 1)
    a = known[rows].copy()
    ends = end_accelerations(options.end_acceleration, waypoints.position.shape[1:])
    if ends is not None:
        if first == 0:
            a[0] = np.where(np.isnan(a[0]), ends[0], a[0])
        if last == len(waypoints.time) - 1:
            a[-1] = np.where(np.isnan(a[-1]), ends[1], a[-1])
    spline = ModifiedHermiteSpline(
        waypoints.time[rows],
        waypoints.position[rows],
        waypoints.velocity[rows],
        knots=options.knots,
        acceleration=a,
    )
    return [(spline.x, spline.c)]


def _run(
    waypoints: JointWaypoints, known: FloatArray, first: int, last: int, run: ChosenRun, i: int
) -> tuple[FloatArray, FloatArray]:
    """Knots and coefficients of a chosen run."""
    slack = _slack(waypoints)
    x, a = run.times.copy(), run.acceleration.copy()
    a[0], a[-1] = known[first], known[last]
    rows: list[int] = []
    for k in range(first, last + 1):
        row = int(np.abs(x - waypoints.time[k]).argmin())
        name = waypoints.names[k]
        if abs(x[row] - waypoints.time[k]) > slack:
            raise OptionError(
                "chosen",
                f"run {i + 1} has no knot at {waypoints.time[k]:.9g} s, the time of waypoint "
                f"{name!r}; times that were chosen belong to their knots: change both, or choose "
                "them again",
            )
        if rows and row - rows[-1] < 3:
            raise OptionError(
                "chosen",
                f"run {i + 1} has fewer than two knots between {name!r} and the one before",
            )
        x[row] = waypoints.time[k]
        rows.append(row)
    peak = np.abs(run.acceleration).max(axis=0)
    pieces = []
    for k, (low, high) in zip(range(first, last), pairwise(rows), strict=True):
        part = slice(low, high + 1)
        span, ends = np.diff(x[part])[None], slice(k, k + 2)
        given = waypoints.position[ends], waypoints.velocity[ends]
        found = corrected_accelerations(span, a[part][None], *given)
        most = np.abs(found[0] - a[part]).max(axis=0)
        beyond = np.flatnonzero(most > STALE * np.maximum(peak, 1e-9))
        if beyond.size:
            raise OptionError(
                "chosen",
                f"run {i + 1} is for other waypoints than {waypoints.names[k]!r} and "
                f"{waypoints.names[k + 1]!r} are now: the acceleration of joint "
                f"{waypoints.joint_names[int(beyond[0])]!r} would have to change by "
                f"{most[beyond[0]]:.3g}; choose the times again",
            )
        pieces.append(cubics_from_accelerations(span, found, *given))
    return x, np.concatenate(pieces, axis=1)
