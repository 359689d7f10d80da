"""Planner `modified-hermite`: the paper's method, and sections with chosen knots.

Between chosen knots the acceleration is linear, so position and velocity at the waypoints and the
accelerations give the curve. Stored accelerations are rounded, so the curve would slightly miss
the next waypoint. The smallest change of the accelerations between two waypoints (least squares)
removes this error.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.curves.interpolation.joining import join_pieces
from knotwork.curves.interpolation.modified_hermite_spline import (
    ModifiedHermiteSpline,
    end_accelerations,
)
from knotwork.curves.interpolation.options import PlannerOptions
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.from_accelerations import (
    correct_accelerations,
    cubics_from_accelerations,
)
from knotwork.errors import OptionError
from knotwork.errors.plain_text import waypoint_text
from knotwork.waypoints import ChosenSection, JointWaypoints

KNOT_TIME_TOLERANCE = 1e-9
"""Tolerance of the times of knots at waypoints, relative to the largest waypoint time."""

ROUNDING_CORRECTION = 1e-3
"""Largest change of accelerations, relative to their peak, that their rounding may need."""


def plan_modified_hermite(
    waypoints: JointWaypoints, options: PlannerOptions
) -> PiecewisePolynomial:
    """Make a C2 smooth curve of degree three through positions and velocities.

    Modified cubic Hermite interpolation on rebuilt knots, Eqs. (30), (31), (34), (39). Waypoints
    with a known acceleration divide the curve into sections that are independent of each other.

    Args:
        waypoints: Positions and velocities, n >= 2, and accelerations where they are known.
        options: Knot placement (`knots`), accelerations at both ends (`end_acceleration`), and
            chosen sections (`chosen`).

    Raises:
        KnotError: Given knots do not suit the waypoints.
        OptionError: End accelerations are wrong. A chosen section does not begin, end and pass at
            waypoints, has fewer than two knots between two of them, overlaps another, or has
            accelerations for other waypoints.
    """
    sections = options.chosen or ()
    numbered = enumerate(sections, 1)
    located = [_locate_section(waypoints, number, section) for number, section in numbered]
    accelerations = np.full(waypoints.position.shape, np.nan)
    if waypoints.acceleration is not None:
        accelerations[:] = waypoints.acceleration
    for (rows, _), section in zip(located, sections, strict=True):
        _fill(accelerations, rows[[0, -1]], section.acceleration[[0, -1]])
    ends = end_accelerations(options.end_acceleration, waypoints.position.shape[1:])
    if ends is not None:
        _fill(accelerations, [0, -1], np.array(ends))
    parts: list[tuple[FloatArray, FloatArray]] = []
    next_row = 0
    for number, ((rows, knots), section) in enumerate(zip(located, sections, strict=True), 1):
        if rows[0] < next_row:
            raise OptionError(
                "chosen", f"section {number} begins before the end of the previous section"
            )
        parts += _pieces_between(waypoints, accelerations, next_row, rows[0], options)
        parts.append(_section_pieces(waypoints, accelerations, rows, knots, section, number))
        next_row = rows[-1]
    parts += _pieces_between(waypoints, accelerations, next_row, len(waypoints.time) - 1, options)
    breaks = np.concatenate([waypoints.time[:1], *(x[1:] for x, _ in parts)])
    return join_pieces(waypoints, np.concatenate([c for _, c in parts], axis=1), breaks)


def _fill(accelerations: FloatArray, rows: IndexArray | list[int], values: FloatArray) -> None:
    """Fill in unknown accelerations of some rows."""
    accelerations[rows] = np.where(np.isnan(accelerations[rows]), values, accelerations[rows])


def _locate_section(
    waypoints: JointWaypoints, number: int, section: ChosenSection
) -> tuple[IndexArray, IndexArray]:
    """Find the waypoints of a chosen section, counted from 1, and the index of the knot at each."""
    t, x = waypoints.time, section.times
    if section.acceleration.shape[1:] != waypoints.position.shape[1:]:
        raise OptionError("chosen", f"section {number} has accelerations of other joints")
    remedy = "its knots belong to the times chosen with them: change both, or choose times again"
    tolerance = KNOT_TIME_TOLERANCE * max(1.0, float(np.abs(t).max()))
    for end in (x[0], x[-1]):
        if np.abs(t - end).min() > tolerance:
            where = f"section {number} begins or ends at {end:.9g} s, where no waypoint is"
            raise OptionError("chosen", f"{where}; {remedy}")
    rows = np.flatnonzero((t >= x[0] - tolerance) & (t <= x[-1] + tolerance))
    knots = np.abs(x[:, None] - t[rows]).argmin(axis=0)
    missing = np.abs(x[knots] - t[rows]) > tolerance
    if missing.any():
        row = rows[missing][0]
        at = f"{t[row]:.9g} s, the time of {waypoint_text(waypoints.names[row])}"
        where = f"section {number} has no knot at {at}"
        raise OptionError("chosen", f"{where}; {remedy}")
    is_sparse = np.diff(knots) < 3
    if is_sparse.any():
        name = waypoint_text(waypoints.names[rows[1:][is_sparse][0]])
        message = f"section {number} has fewer than two knots between {name} and the one before"
        raise OptionError("chosen", message)
    return rows, knots


def _pieces_between(
    waypoints: JointWaypoints,
    accelerations: FloatArray,
    first: int,
    last: int,
    options: PlannerOptions,
) -> list[tuple[FloatArray, FloatArray]]:
    """Make the knots and coefficients of the curve between chosen sections, unless they meet."""
    if first == last:
        return []
    rows = slice(first, last + 1)
    spline = ModifiedHermiteSpline(
        waypoints.time[rows],
        waypoints.position[rows],
        waypoints.velocity[rows],
        knots=options.knots,
        acceleration=accelerations[rows],
    )
    return [(spline.x, spline.c)]


def _section_pieces(
    waypoints: JointWaypoints,
    accelerations: FloatArray,
    rows: IndexArray,
    knots: IndexArray,
    section: ChosenSection,
    number: int,
) -> tuple[FloatArray, FloatArray]:
    """Make the knots and coefficients of a chosen section, counted from 1."""
    x, a = section.times.copy(), section.acceleration.copy()
    x[knots] = waypoints.time[rows]
    a[[0, -1]] = accelerations[rows[[0, -1]]]
    peak = np.abs(section.acceleration).max(axis=0)
    pieces = []
    for k, (low, high) in zip(rows, pairwise(knots), strict=False):
        interval = slice(low, high + 1)
        span, ends = np.diff(x[interval])[None], slice(k, k + 2)
        states = waypoints.position[ends], waypoints.velocity[ends]
        corrected = correct_accelerations(span, a[interval][None], *states)
        change = np.abs(corrected[0] - a[interval]).max(axis=0)
        beyond = np.flatnonzero(change > ROUNDING_CORRECTION * np.maximum(peak, 1e-9))
        if beyond.size:
            names = " and ".join(map(waypoint_text, waypoints.names[ends]))
            raise OptionError(
                "chosen",
                f"section {number} is for other waypoints than {names} are now: the acceleration "
                f"of joint {waypoints.joint_names[int(beyond[0])]!r} would have to change by "
                f"{change[beyond[0]]:.3g}; choose the times again",
            )
        pieces.append(cubics_from_accelerations(span, corrected, *states))
    return x, np.concatenate(pieces, axis=1)
