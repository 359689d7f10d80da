"""Planner `trapezoidal`: a stop at each waypoint, and trapezoidal velocity between.

In an interval of length h in which joint j moves by D_j, all joints accelerate evenly for a time
τ, keep their speed, and decelerate evenly for τ:

    speed V_j = D_j / (h - τ),    acceleration A_j = D_j / (τ (h - τ)),    0 < τ <= h/2.

All joints share τ (synchronous PTP, in phase), so that the motion is a straight line in joint
space. A longer τ takes less acceleration and more speed.

Source: the linear function with parabolic blends of J. J. Craig, Introduction to Robotics,
chapter 7, as controllers' point-to-point commands run it.
"""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.joining import joined
from knotwork.interpolation.option_limits import (
    DEFAULT_FRACTION,
    ROUNDING,
    limit_rows,
    refuse_first,
    refuse_unresolved,
    snapped,
)
from knotwork.interpolation.options import PlannerOptions
from knotwork.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray, JointWaypoints


def plan(waypoints: JointWaypoints, options: PlannerOptions) -> PiecewisePolynomial:
    """Make a C1 smooth curve of degree two that stops at each waypoint.

    It meets positions but not velocities: the velocity is zero at all waypoints, at the ends too.
    Acceleration jumps. A joint that does not move in an interval stands still. The joint nearest
    its limit of acceleration uses it fully. If no joint that moves has such a limit, the joints
    accelerate for a third of the interval and decelerate for a third, or for less where a limit of
    speed requires it.

    Args:
        waypoints: Positions, n >= 2; velocities are not used.
        options: `acceleration_limit` and `velocity_limit`.

    Raises:
        InputError: An interval is too short for a joint's limits: which, which joint, and by how
            much.
    """
    t, y = waypoints.time, waypoints.position
    h = np.diff(t)
    change = np.diff(y, axis=0)
    later = np.maximum(np.abs(t[:-1]), np.abs(t[1:]))
    ramp = snapped(later, _ramps(waypoints, h, change, options))
    # speed is reached at t + τ and left at the next waypoint less τ
    inner = np.stack((t[:-1], t[:-1] + ramp, t[1:] - ramp), axis=1)
    breaks = np.append(np.maximum.accumulate(inner.ravel()), t[-1])
    refuse_unresolved(t[:-1], ramp == 0.0, "acceleration")
    speed = change / (h - ramp)[:, None]
    half = 0.5 * speed / ramp[:, None]
    run_up = 0.5 * speed * ramp[:, None]
    c = np.zeros((3, h.size, 3, y.shape[1]))
    c[0, :, 0], c[0, :, 2] = half, -half
    c[1, :, 1], c[1, :, 2] = speed, speed
    c[2, :, 0], c[2, :, 1], c[2, :, 2] = y[:-1], y[:-1] + run_up, y[1:] - run_up
    return joined(waypoints, c.reshape(3, -1, y.shape[1]), breaks)


def _ramps(
    waypoints: JointWaypoints, h: FloatArray, change: FloatArray, options: PlannerOptions
) -> FloatArray:
    """Times of acceleration τ, shape (n-1,)."""
    joints = len(waypoints.joint_names)
    acceleration = limit_rows("acceleration_limit", options.acceleration_limit, joints)
    speed = limit_rows("velocity_limit", options.velocity_limit, joints)
    distance = np.abs(change)
    # τ (h - τ) >= D/A has solutions up to h/2 if D/A <= h²/4, and h - τ >= D/V if D/V < h
    room = h[:, None] ** 2 - 4.0 * distance / acceleration
    refuse_first(
        room < -ROUNDING * h[:, None] ** 2,
        waypoints,
        lambda i, j: (
            f"acceleration_limit {acceleration[j]:.6g} is below the "
            f"{4.0 * distance[i, j] / h[i] ** 2:.6g} that it takes at least; it needs "
            f"{2.0 * np.sqrt(distance[i, j] / acceleration[j]) - h[i]:.6g} s more"
        ),
    )
    root = np.sqrt(np.maximum(room, 0.0))
    # the smaller root of τ (h - τ) = D/A, without cancellation
    least = 2.0 * (distance / acceleration) / (h[:, None] + root)
    most = h[:, None] - distance / speed
    most = np.where(np.isinf(speed), h[:, None], most)
    shortest = least.max(axis=1)
    refuse_first(
        (most <= 0.0) | (most < shortest[:, None] * (1.0 - ROUNDING)),
        waypoints,
        lambda i, j: (
            f"velocity_limit {speed[j]:.6g} is below the "
            f"{distance[i, j] / (h[i] - shortest[i]):.6g} that it takes"
            + (
                f", with {shortest[i]:.6g} s to accelerate"
                if shortest[i] > 0.0
                else ", even without a time to accelerate"
            )
            + f"; it needs {distance[i, j] / speed[j] + shortest[i] - h[i]:.6g} s more"
        ),
    )
    free = np.minimum(DEFAULT_FRACTION * h, most.min(axis=1))
    return np.asarray(np.where(shortest > 0.0, np.minimum(shortest, 0.5 * h), free))
