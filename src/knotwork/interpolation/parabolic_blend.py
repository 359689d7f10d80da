"""Planner `parabolic-blend`: straight lines with parabolic transitions at the waypoints.

Lines through neighbouring waypoints, with slopes m, are joined by transitions of constant
acceleration, which last T_k and are centred on the waypoints' times:

    acceleration at waypoint k:  (m_k - m_{k-1}) / T_k,      missed by:  (m_k - m_{k-1}) T_k / 8.

The first transition starts with the motion, at its position and velocity, and the last one ends
with it. The outer lines are therefore steeper: the first one passes through waypoint 1 and leaves
the first transition with

    m_0 = (y_1 - y_0 - v_0 T_0/2) / (h_0 - T_0/2),

and the last is its mirror image. An inner transition takes T_k/2 of each neighbour, one at
an end all of its T_k. In an interval of length h the two parts, p and q, must fit: p + q <= h.

Source: J. J. Craig, Introduction to Robotics, chapter 7, "linear function with parabolic blends
for a path with via points", which starts and stops at rest; here with velocities at the ends.
"""

from __future__ import annotations

import numpy as np

from knotwork.errors import InputError
from knotwork.interpolation.blend_times import slopes, transition_times
from knotwork.interpolation.joining import joined
from knotwork.interpolation.option_limits import ROUNDING, interval_name, refuse_unresolved, snapped
from knotwork.interpolation.options import PlannerOptions
from knotwork.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray, JointWaypoints


def plan(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C1 smooth curve of degree two: straight lines, rounded off at the waypoints.

    Positions and velocities at both ends are met. It can't meet inner waypoints: it cuts their
    corners by an eighth of the change of velocity times the transition time, and passes with the
    mean of the slopes on both sides. Acceleration jumps.

    All joints share the transition times: those given; else the shortest that keep every joint's
    limit of acceleration; else, where no joint that changes its velocity has a limit, a third of
    the shortest adjoining interval. Given times are not checked against the limits.

    Args:
        waypoints: Positions, and velocities at the ends, n >= 2; inner velocities are not used.
        options: `transition_time` or `acceleration_limit`.

    Raises:
        InputError: An interval is too short for the transitions or the limits: which, and by how
            much.
    """
    duration = transition_times(waypoints, options)
    # a transition lies half in each neighbouring interval, at the ends wholly in the one
    share = np.full(duration.size, 0.5)
    share[[0, -1]] = 1.0
    _check_intervals(waypoints, share * duration)
    rounded = snapped(waypoints.time, share * duration) / share
    refuse_unresolved(waypoints.time, (duration > 0.0) & (rounded == 0.0), "transition")
    duration = rounded
    c, breaks = _pieces(waypoints, duration, slopes(waypoints, duration))
    return joined(waypoints, c, breaks)


def _check_intervals(waypoints: JointWaypoints, part: FloatArray) -> None:
    """Refuse intervals that are too short for their parts of the transitions."""
    h = np.diff(waypoints.time)
    over = part[:-1] + part[1:] - h
    wrong = np.flatnonzero(over > ROUNDING * h)
    if wrong.size:
        i = int(wrong[0])
        raise InputError(
            f"{interval_name(waypoints, i)}, is {over[i]:.6g} s too short for "
            f"its transitions, which take {part[i]:.6g} s and {part[i + 1]:.6g} s of it; give it "
            "more time, or allow shorter transitions or more acceleration"
        )


def _pieces(
    waypoints: JointWaypoints, duration: FloatArray, slope: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coefficients of transition, line, transition, … and their breaks, shape (2n,)."""
    t, y = waypoints.time, waypoints.position
    start, end = t - 0.5 * duration, t + 0.5 * duration
    start[0], end[0] = t[0], t[0] + duration[0]
    start[-1], end[-1] = t[-1] - duration[-1], t[-1]
    # slopes before and after each transition
    before = np.concatenate((waypoints.velocity[:1], slope))
    after = np.concatenate((slope, waypoints.velocity[-1:]))
    span = np.where(duration > 0.0, duration, 1.0)[:, None]
    c = np.zeros((3, t.size, 2, y.shape[1]))
    c[0, :, 0] = 0.5 * (after - before) / span
    c[1, :, 0], c[1, :, 1] = before, after
    # a transition starts on the line before it; the last one is found from its end
    half = 0.5 * duration[:, None]
    c[2, :, 0] = y - before * half
    c[2, :, 1] = y + after * half
    c[2, 0, 0] = y[0]
    c[2, 0, 1] = y[0] + (before[0] + after[0]) * half[0]
    c[2, -1, 0] = y[-1] - (before[-1] + after[-1]) * half[-1]
    breaks = np.maximum.accumulate(np.stack((start, end), axis=1).ravel())
    return c.reshape(3, -1, y.shape[1])[:, :-1], np.minimum(breaks, t[-1])
