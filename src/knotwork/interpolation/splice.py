"""Planners `3-5-3` and `4-3-4`: polynomials of different degrees joined at the waypoints.

Source: sections 1 and 3 of the paper, which takes 3-5-3 from Xiangrong Xu and 4-3-4 from
Saeed B. Niku, Introduction to Robotics.
"""

from __future__ import annotations

import numpy as np

from knotwork.errors import InputError
from knotwork.interpolation.joining import joined
from knotwork.interpolation.modified_hermite_spline import end_accelerations
from knotwork.interpolation.options import PlannerOptions
from knotwork.interpolation.presets import estimated_accelerations, preset_rows, with_known
from knotwork.interpolation.tridiagonal import cubic_pieces, solve_accelerations
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.two_point import raised, two_point_coefficients
from knotwork.waypoints import FloatArray, JointWaypoints


def plan_353(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of cubic, quintics and cubic: positions and velocities are met.

    The first and the last interval take the cubics of Eqs. (5), (6), and these fix the
    accelerations at the second and the last but one waypoint; the intervals between take
    the quintics of Eqs. (7), (8). With four waypoints no acceleration is left to choose. With more,
    the waypoints in the middle need accelerations, and bad ones make the velocity swing.

    Two waypoints take one cubic. Three are refused: the two cubics would be planner `cubic`,
    whose acceleration jumps in the middle.

    Args:
        waypoints: Positions and velocities, n = 2 or n >= 4.
        options: `accelerations` of the waypoints 2 … n-3: estimated by default (see
            `knotwork.interpolation.presets.estimated_accelerations`), `"zero"`, or an array of
            shape (n-4, d) [rad/s² or m/s²], without rows for the two waypoints at either end,
            where the cubics leave no choice.

    Raises:
        InputError: There are three waypoints, or an option has the wrong shape.
    """
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    if t.size == 3:
        raise InputError(
            "three waypoints can't be done: a first and a last cubic, which must "
            "meet all velocities, don't agree on the acceleration between them; add a waypoint or "
            "use planner 'modified-hermite'"
        )
    a = _accelerations_353(waypoints, options)
    c = two_point_coefficients(t, (y, v, a))
    ends = [0, t.size - 2]
    c[:, ends] = raised(two_point_coefficients(t, (y, v))[:, ends], 5)
    return joined(waypoints, c[2:] if t.size == 2 else c)


def _accelerations_353(waypoints: JointWaypoints, options: PlannerOptions) -> FloatArray:
    """Accelerations at all waypoints; those of the first and the last are not used."""
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    asked = options.accelerations
    a = np.zeros(y.shape)
    middle = slice(2, t.size - 2)
    if not (asked is None or isinstance(asked, str)):
        given = preset_rows(asked, waypoints, skipped=2)
        if t.size > 4:
            a[middle] = given
    elif asked != "zero" and t.size > 4:
        a[middle] = estimated_accelerations(waypoints)[middle]
    a = with_known(a, waypoints)
    first, last = t[1] - t[0], t[-1] - t[-2]
    # far ends of the outer cubics: 2 (2 v1 + v0 - 3 s)/h and its mirror image
    a[1] = 2.0 * (2.0 * v[1] + v[0] - 3.0 * (y[1] - y[0]) / first) / first
    if t.size > 2:
        a[-2] = 2.0 * (3.0 * (y[-1] - y[-2]) / last - 2.0 * v[-2] - v[-1]) / last
    return a


def plan_434(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C2 smooth curve of quartic, cubics and quartic through the positions.

    Positions at all waypoints, velocities and accelerations at both ends are met. It can't meet
    velocities at inner waypoints; they follow from continuous acceleration. With two waypoints
    there are no two quartics: one quintic then meets the same conditions.

    Args:
        waypoints: Positions and velocities, n >= 2; inner velocities are not used.
        options: `end_acceleration`, zero by default.

    Raises:
        OptionError: An option has the wrong shape.
    """
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    joints = y.shape[1]
    ends = end_accelerations(options.end_acceleration, (joints,))
    a_first, a_last = ends if ends is not None else (np.zeros(joints), np.zeros(joints))
    if t.size == 2:
        a = np.stack((a_first, a_last))
        return joined(waypoints, two_point_coefficients(t, (y, v, a)))
    a = _accelerations_434(t, y, v, a_first, a_last)
    c = raised(cubic_pieces(t, y, a), 4)
    h = np.diff(t)[[0, -1], None]
    change = np.diff(y, axis=0)[[0, -1]]
    start = v[0], 2.0 * change[1] / h[1] - v[-1] + h[1] * (a[-1] - a[-2]) / 6.0
    for piece in (0, -1):
        c[:, piece] = _quartic(
            h[piece], change[piece], y[:-1][piece], start[piece], a[:-1][piece], a[1:][piece]
        )
    return joined(waypoints, c)


def _accelerations_434(
    t: FloatArray, y: FloatArray, v: FloatArray, a_first: FloatArray, a_last: FloatArray
) -> FloatArray:
    """Accelerations at all waypoints, shape (n, d), n >= 3."""
    h = np.diff(t)
    slope = np.diff(y, axis=0) / h[:, None]
    # velocities in terms of the accelerations a0, a1 at the ends of an interval:
    #     2 s - v0 - h a0/6 + h a1/6   at the end of the first quartic,
    #     2 s - v1 - h a0/6 + h a1/6   at the start of the last one,
    #     s - h (2 a0 + a1)/6 and s + h (a0 + 2 a1)/6   at the ends of a cubic;
    # they agree where two intervals meet
    before, after = slope[:-1].copy(), slope[1:].copy()
    before[0] = 2.0 * slope[0] - v[0] - h[0] * a_first / 6.0
    after[-1] = 2.0 * slope[-1] - v[-1] + h[-1] * a_last / 6.0
    before_weight, after_weight = h[:-1] / 3.0, h[1:] / 3.0
    before_weight[0], after_weight[-1] = h[0] / 6.0, h[-1] / 6.0
    inner = solve_accelerations(before_weight + after_weight, h[1:-1] / 6.0, after - before)
    return np.concatenate((a_first[None], inner, a_last[None]))


def _quartic(
    h: FloatArray,
    change: FloatArray,
    y0: FloatArray,
    v0: FloatArray,
    a0: FloatArray,
    a1: FloatArray,
) -> FloatArray:
    """Coefficients of a quartic from positions, accelerations and its velocity at the start.

    Returns:
        Shape (5, d), highest power first.
    """
    rest = change - v0 * h - 0.5 * a0 * h**2
    turn = (a1 - a0) * h**2 / 6.0
    return np.stack(((turn - rest) / h**4, (2.0 * rest - turn) / h**3, 0.5 * a0, v0, y0))
