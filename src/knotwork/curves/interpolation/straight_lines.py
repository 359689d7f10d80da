"""Planners `parabolic-blend` and `trapezoidal`: straight lines joined by constant accelerations.

Changes of speed last a third of an interval, the same for all joints. Both are C1 smooth, of degree
two.

Source: J. J. Craig, Introduction to Robotics, chapter 7, "linear function with parabolic blends
for a path with via points", which starts and stops at rest. Here the ends have velocities.
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation.joining import join_pieces
from knotwork.curves.interpolation.options import PlannerOptions
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import InputError
from knotwork.waypoints import JointWaypoints

RAMP_FRACTION = 1.0 / 3.0
"""Duration of a change of speed, relative to its interval or the shorter of both next to it."""


def plan_blends(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C1 smooth curve of degree two: straight lines, rounded off at the waypoints.

    Transitions of constant acceleration last T_k and are centred on the waypoints' times. With the
    slopes m of the lines,

        acceleration at waypoint k:  (m_k - m_{k-1}) / T_k,    missed by:  (m_k - m_{k-1}) T_k / 8.

    The first transition starts with the motion, at its position and velocity, and the last
    transition ends with it. Thus the outer lines are steeper:

        m_0 = (y_1 - y_0 - v_0 T_0/2) / (h_0 - T_0/2),

    and the last is its mirror image. Positions and velocities at both ends are met; inner waypoints
    are not.

    Args:
        waypoints: Positions, and velocities at the ends, n >= 2; inner velocities are not used.
        options: Not used.

    Raises:
        InputError: An interval is too short for the resolution of its times.
    """
    t, y = waypoints.time, waypoints.position
    h = np.diff(t)
    # fraction of a transition in a neighbouring interval: the whole one at the ends of the motion
    fraction = np.full(t.size, 0.5)
    fraction[[0, -1]] = 1.0
    shorter = np.minimum(np.append(h[:1], h), np.append(h, h[-1:]))
    duration = _round_down(t, fraction * RAMP_FRACTION * shorter) / fraction
    change = np.diff(y, axis=0)
    for end in (0, -1):
        change[end] -= 0.5 * duration[end] * waypoints.velocity[end]
        h[end] -= 0.5 * duration[end]
    slope = change / h[:, None]
    start, end = t - 0.5 * duration, t + 0.5 * duration
    start[0], end[0] = t[0], t[0] + duration[0]
    start[-1], end[-1] = t[-1] - duration[-1], t[-1]
    before = np.concatenate((waypoints.velocity[:1], slope))
    after = np.concatenate((slope, waypoints.velocity[-1:]))
    c = np.zeros((3, t.size, 2, y.shape[1]))
    c[0, :, 0] = 0.5 * (after - before) / duration[:, None]
    c[1, :, 0], c[1, :, 1] = before, after
    # a transition starts on the line before it; the last one follows from its end
    half = 0.5 * duration[:, None]
    c[2, :, 0], c[2, :, 1] = y - before * half, y + after * half
    c[2, 0, 0], c[2, 0, 1] = y[0], y[0] + (before[0] + after[0]) * half[0]
    c[2, -1, 0] = y[-1] - (before[-1] + after[-1]) * half[-1]
    breaks = np.maximum.accumulate(np.stack((start, end), axis=1).ravel())
    return join_pieces(waypoints, c.reshape(3, -1, y.shape[1])[:, :-1], np.minimum(breaks, t[-1]))


def plan_trapezoids(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C1 smooth curve of degree two that stops at each waypoint.

    In an interval of length h joint j moves by D_j. All joints accelerate evenly for the time τ,
    keep their speed, and decelerate evenly for τ. This is in phase, as in point-to-point commands
    of controllers:

        speed V_j = D_j / (h - τ),    acceleration A_j = D_j / (τ (h - τ)).

    Positions are met, velocities are not. The motion is a straight line in joint space.

    Args:
        waypoints: Positions, n >= 2; velocities are not used.
        options: Not used.

    Raises:
        InputError: An interval is too short for the resolution of its times.
    """
    t, y = waypoints.time, waypoints.position
    h = np.diff(t)
    ramp = _round_down(np.maximum(np.abs(t[:-1]), np.abs(t[1:])), RAMP_FRACTION * h)
    # the speed is constant from t + τ to τ before the next waypoint
    inner = np.stack((t[:-1], t[:-1] + ramp, t[1:] - ramp), axis=1)
    breaks = np.append(np.maximum.accumulate(inner.ravel()), t[-1])
    speed = np.diff(y, axis=0) / (h - ramp)[:, None]
    half, run_up = 0.5 * speed / ramp[:, None], 0.5 * speed * ramp[:, None]
    c = np.zeros((3, h.size, 3, y.shape[1]))
    c[0, :, 0], c[0, :, 2] = half, -half
    c[1, :, 1], c[1, :, 2] = speed, speed
    c[2, :, 0], c[2, :, 1], c[2, :, 2] = y[:-1], y[:-1] + run_up, y[1:] - run_up
    return join_pieces(waypoints, c.reshape(3, -1, y.shape[1]), breaks)


def _round_down(time: FloatArray, span: FloatArray) -> FloatArray:
    """Round durations down to the resolution of the times at which they start or end.

    Then a break has the same time in both polynomials that meet there, even for large times.

    Raises:
        InputError: A duration rounds to zero.
    """
    size = np.abs(time)
    rounded = (size + span) - size
    rounded = np.where(rounded > span, rounded - np.spacing(size + span), rounded)
    if (rounded <= 0.0).any():
        at = float(size[np.argmin(rounded)])
        raise InputError(
            f"the change of speed at {at:.17g} s is too short for the resolution of times there, "
            f"{np.spacing(at):.3g} s; give the interval more time"
        )
    return rounded
