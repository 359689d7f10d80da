"""Planners that complete derivatives at the waypoints; one polynomial per interval joins them.

With k derivatives at both ends of an interval, position included, there is exactly one polynomial
of degree 2k - 1: Eqs. (5) to (8) of the paper, and the higher degrees that its section 1 names.
Neighbours share the values at their waypoint, so the curve is C^(k-1) smooth. The planners differ
in where the values come from:

| planner | velocities | accelerations | jerk, snap |
|---|---|---|---|
| cubic, bspline-velocity | waypoints | | |
| quintic, septic, nonic | waypoints | options: zero, estimated, given | zero |
| 3-5-3 | waypoints | of the outer cubics, else options | |
| bspline | ends; inner ones make accelerations continuous | | |
| 4-3-4 | as bspline | ends; inner ones of that curve | |

If preset values do not suit the positions and velocities, the velocity oscillates between the
waypoints. Higher degrees have higher peaks: from rest to rest, with zeros preset, the peak velocity
is 3/2 times the mean one for the cubic, then 15/8, 35/16 and 315/128 times.

A B-spline is the same curve in another basis. At a knot of multiplicity r a cubic B-spline is
C^(3-r) smooth. Single knots at the waypoints give the complete cubic spline, and double knots give
the cubic Hermite spline. So `bspline-velocity` is made by `cubic`.

Sources: the paper, which takes 3-5-3 from Xiangrong Xu and 4-3-4 from Saeed B. Niku, Introduction
to Robotics; C. de Boor, A Practical Guide to Splines, chapters IV and IX.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation.joining import join_pieces
from knotwork.curves.interpolation.modified_hermite_spline import end_accelerations
from knotwork.curves.interpolation.options import ACCELERATION_RULES, PlannerOptions
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.errors import InputError, OptionError
from knotwork.waypoints import JointWaypoints


def plan_cubic(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C1 smooth curve of degree three: positions and velocities are met."""
    derivatives = waypoints.position, waypoints.velocity
    return join_pieces(waypoints, two_point_coefficients(waypoints.time, derivatives))


def _with_presets(
    waypoints: JointWaypoints, options: PlannerOptions, zeros: int
) -> PiecewisePolynomial:
    """Make a curve that also meets accelerations, and zero for the next `zeros` derivatives."""
    presets = preset_accelerations(waypoints, options)
    derivatives = waypoints.position, waypoints.velocity, presets, *[0.0 * presets] * zeros
    return join_pieces(waypoints, two_point_coefficients(waypoints.time, derivatives))


plan_quintic = partial(_with_presets, zeros=0)
plan_septic = partial(_with_presets, zeros=1)
plan_nonic = partial(_with_presets, zeros=2)


def plan_353(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of cubic, quintics and cubic: positions and velocities are met.

    The cubics of the first and the last interval determine the accelerations at the second and the
    last but one waypoint. With four waypoints these are all. With more, the waypoints in
    the middle need accelerations, and with unsuitable ones the velocity oscillates. Two waypoints
    give one cubic. Three waypoints are refused, because two cubics are the planner `cubic`, whose
    acceleration jumps in the middle.

    Args:
        waypoints: Positions and velocities, n = 2 or n >= 4.
        options: `accelerations` of the waypoints 2 … n-3: estimated by default (see
            `estimated_accelerations`), or `"zero"`.

    Raises:
        InputError: There are three waypoints, or the accelerations are an array.
    """
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    if t.size == 3:
        raise InputError(
            "three waypoints are not supported: the first and the last cubic, which meet all "
            "velocities, have different accelerations where they join; add a waypoint or use "
            "planner 'modified-hermite'"
        )
    rule = options.accelerations
    if rule not in (None, *ACCELERATION_RULES):
        raise OptionError(
            "accelerations", "has values for each waypoint; accepted: zero, estimated"
        )
    a = 0.0 * y if rule == "zero" else estimated_accelerations(waypoints)
    a = keep_known(a, waypoints)
    start, end = cubic_accelerations(waypoints)
    a[0], a[-1] = start[0], end[-1]
    if t.size > 2:
        a[1], a[-2] = end[0], start[-1]
    c = two_point_coefficients(t, (y, v, a))
    c[:2, [0, -1]] = 0.0  # removes rounding errors
    return join_pieces(waypoints, c[2:] if t.size == 2 else c)


def plan_bspline(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of degree three through the positions, as a cubic B-spline.

    This is the complete (clamped) cubic spline. It meets positions at all waypoints and velocities
    at both ends; inner velocities are not used. Among all curves through these positions with these
    end velocities, it has the minimum integral of squared acceleration.
    """
    velocity, _ = _smooth_velocities(waypoints)
    derivatives = waypoints.position, velocity
    return join_pieces(waypoints, two_point_coefficients(waypoints.time, derivatives))


def plan_434(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of quartic, cubics and quartic through the positions.

    It meets positions at all waypoints, and velocities and accelerations at both ends; inner
    velocities are not used. With two waypoints one quintic meets the same conditions.

    Raises:
        OptionError: The option `end_acceleration`, zero by default, has the wrong shape.
    """
    ends = end_accelerations(options.end_acceleration, waypoints.position.shape[1:])
    first, last = ends if ends is not None else np.zeros_like(waypoints.position[:2])
    velocity, inner = _smooth_velocities(waypoints, (first, last))
    a = np.concatenate((first[None], inner, last[None]))
    c = two_point_coefficients(waypoints.time, (waypoints.position, velocity, a))
    if len(a) > 2:
        c = c[1:]  # the first coefficients are only rounding errors
        c[0, 1:-1] = 0.0
    return join_pieces(waypoints, c)


def _smooth_velocities(
    waypoints: JointWaypoints, ends: tuple[FloatArray, FloatArray] | None = None
) -> tuple[FloatArray, FloatArray]:
    """Find the inner velocities that make the acceleration of cubics continuous.

    An interval has the length h, the mean velocity s and the velocities v0 and v1 at its ends. The
    acceleration of its cubic is (6 s - 4 v0 - 2 v1)/h at its start and (2 v0 + 4 v1 - 6 s)/h at its
    end. With `ends` the outer pieces are quartics with the acceleration a0 at the start or a1 at
    the end: theirs at the inner waypoint are a0 + (6 v0 + 6 v1 - 12 s)/h and
    a1 + (12 s - 6 v0 - 6 v1)/h.

    Args:
        waypoints: Positions, and velocities at the ends.
        ends: Accelerations at the ends, shape (d,) each.

    Returns:
        Velocities, shape (n, d), and accelerations at the inner waypoints, shape (n-2, d).
    """
    from scipy.linalg import solve_banded

    y, v = waypoints.position, np.array(waypoints.velocity)
    h = np.diff(waypoints.time)[:, None]
    if len(h) == 1:
        return v, y[:0]
    slope = np.diff(y, axis=0) / h
    near, far, mean = 4.0 / h, 2.0 / h, 6.0 / h
    end_terms = np.zeros_like(slope)
    if ends is not None:
        outer = [0, -1]
        near[outer] = far[outer] = 6.0 / h[outer]
        mean[outer] = 12.0 / h[outer]
        end_terms[0], end_terms[-1] = ends
    rhs = (mean * slope)[:-1] + (mean * slope)[1:]
    rhs[0] -= far[0] * v[0] + end_terms[0]
    rhs[-1] -= far[-1] * v[-1] - end_terms[-1]
    # the tridiagonal matrix by its diagonals: above, on and below the main one
    bands = np.stack((far[:-1, 0], (near[:-1] + near[1:])[:, 0], far[1:, 0]))
    v[1:-1] = solve_banded((1, 1), bands, rhs, check_finite=False)
    accelerations = near * v[1:] + far * v[:-1] - mean * slope
    accelerations[0] += end_terms[0]
    return v, accelerations[:-1]


def estimated_accelerations(waypoints: JointWaypoints) -> FloatArray:
    """Estimate accelerations from the cubic Hermite pieces that adjoin each waypoint.

    Where pieces of lengths h₋ and h₊ meet with the accelerations a₋ and a₊, the estimate is a = (h₋
    a₋ + h₊ a₊) / (h₋ + h₊). At the ends it is the acceleration of the only piece. Among all curves
    with its end positions and velocities the cubic has the minimum integral of squared
    acceleration. A quintic whose acceleration at one end differs from the cubic's by e exceeds it
    by a multiple of h e². Thus the estimate minimises the sum over both neighbouring quintics, if
    their accelerations at the far ends are those of the cubics. It is exact for quadratic and cubic
    motions, local, and for equal intervals the mean of both.

    Returns:
        Accelerations, shape (n, d) [rad/s² or m/s²].
    """
    h = np.diff(waypoints.time)[:, None]
    start, end = cubic_accelerations(waypoints)
    inner = (h[:-1] * end[:-1] + h[1:] * start[1:]) / (h[:-1] + h[1:])
    return np.concatenate((start[:1], inner, end[-1:]))


def cubic_accelerations(waypoints: JointWaypoints) -> tuple[FloatArray, FloatArray]:
    """Accelerations of the cubic Hermite pieces at their starts and ends, shape (n-1, d) each."""
    h = np.diff(waypoints.time)[:, None]
    v, slope = waypoints.velocity, np.diff(waypoints.position, axis=0) / h
    start = (6.0 * slope - 4.0 * v[:-1] - 2.0 * v[1:]) / h
    return start, (4.0 * v[1:] + 2.0 * v[:-1] - 6.0 * slope) / h


def preset_accelerations(waypoints: JointWaypoints, options: PlannerOptions) -> FloatArray:
    """Accelerations at the waypoints given by the options, zeros by default, shape (n, d).

    Accelerations that the waypoints have take priority over the options.

    Raises:
        OptionError: An array has another shape, or end accelerations are given together with one.
    """
    requested = "zero" if options.accelerations is None else options.accelerations
    ends = end_accelerations(options.end_acceleration, (len(waypoints.joint_names),))
    if not isinstance(requested, str):
        if ends is not None:
            raise OptionError(
                "end_acceleration",
                "gives the accelerations at the ends, and so do the first and last row of option "
                "accelerations; give one of the two",
            )
        return keep_known(preset_rows(requested, waypoints), waypoints)
    if requested == "zero":
        accelerations = np.zeros(waypoints.position.shape)
    else:
        accelerations = estimated_accelerations(waypoints)
    if ends is not None:
        accelerations[0], accelerations[-1] = ends
    return keep_known(accelerations, waypoints)


def keep_known(accelerations: FloatArray, waypoints: JointWaypoints) -> FloatArray:
    """Replace the accelerations of an option by those that the waypoints have."""
    given = waypoints.acceleration
    return accelerations if given is None else np.where(np.isnan(given), accelerations, given)


def preset_rows(rows: Any, waypoints: JointWaypoints) -> FloatArray:
    """Accelerations given at the waypoints, shape (n, d).

    Args:
        rows: Value of the option `accelerations`.
        waypoints: The waypoints.

    Raises:
        OptionError: The shape is wrong.
    """
    array, shape = np.asarray(rows, dtype=float), waypoints.position.shape
    if array.shape != shape:
        count = len(array) if array.ndim else "no"
        raise OptionError(
            "accelerations",
            f"has {count} rows (shape {array.shape}); {shape[0]} waypoints of {shape[1]} joints "
            f"take {shape[0]} (shape {shape}), one for each waypoint, the start included",
        )
    return array
