"""Durations of the transitions of `parabolic-blend`, and the slopes between them."""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.option_limits import (
    DEFAULT_FRACTION,
    ROUNDING,
    limit_rows,
    refuse_first,
)
from knotwork.interpolation.options import PlannerOptions, option_array
from knotwork.waypoints import FloatArray, JointWaypoints

NOISE = 64 * np.finfo(float).eps
"""Changes of velocity below this, relative to what they are computed from, are rounding."""


def slopes(waypoints: JointWaypoints, duration: FloatArray) -> FloatArray:
    """Velocities of the straight lines, shape (n-1, d)."""
    change, h = np.diff(waypoints.position, axis=0), np.diff(waypoints.time)
    for end in (0, -1):
        change[end] -= 0.5 * duration[end] * waypoints.velocity[end]
        h[end] -= 0.5 * duration[end]
    return change / h[:, None]


def transition_times(waypoints: JointWaypoints, options: PlannerOptions) -> FloatArray:
    """Times of the transitions, shape (n,); zero where no joint changes its velocity.

    Given ones are taken. Otherwise they are the shortest that keep all limits of acceleration, or
    the default where there is no limit.

    Raises:
        OptionError: Given times have another shape.
        InputError: At an end, no time keeps the limits.
    """
    n, joints = waypoints.position.shape
    if options.transition_time is not None:
        given = np.asarray(options.transition_time)
        accepted = f"give one time, or one for each of {n} waypoints, the start included"
        shape = (n,) if given.ndim else ()
        return np.array(
            np.broadcast_to(option_array("transition_time", given, shape, 0.0, accepted), n)
        )
    limit = limit_rows("acceleration_limit", options.acceleration_limit, joints)
    h = np.diff(waypoints.time)
    shortest = np.minimum(np.append(h[:1], h), np.append(h, h[-1:]))
    duration = np.zeros(n)
    off = _off_at_ends(waypoints)
    if n == 2:
        duration[:] = _of_single_interval(waypoints, limit, off)
    else:
        for end in (0, -1):
            duration[end] = _of_end(waypoints, limit, off[end], end)
    changes = np.asarray(off.any(axis=1))
    for end in (0, -1):
        if duration[end] == 0.0 and (changes.any() if n == 2 else changes[end]):
            duration[end] = DEFAULT_FRACTION * h[end]
    if n > 2:
        m = slopes(waypoints, duration)
        # a slope carries the rounding of its positions
        reach = np.abs(waypoints.position)
        size = np.abs(m) + (reach[:-1] + reach[1:]) / h[:, None]
        turn = np.abs(np.diff(m, axis=0))
        turn[turn <= NOISE * (size[:-1] + size[1:])] = 0.0
        needed = (turn / limit).max(axis=1)
        usual = np.where(turn.any(axis=1), DEFAULT_FRACTION * shortest[1:-1], 0.0)
        duration[1:-1] = np.where(needed > 0.0, needed, usual)
    return duration


def _off_at_ends(waypoints: JointWaypoints) -> FloatArray:
    """Distance by which the end velocities alone miss the next waypoint, shape (2, d).

    It is Δ - v h, or zero if that is rounding. The transition at the end makes up for it.
    """
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    rows = []
    for end, (a, b) in ((0, (0, 1)), (-1, (-2, -1))):
        run = v[end] * (t[b] - t[a])
        off = y[b] - y[a] - run
        noise = NOISE * (np.abs(y[a]) + np.abs(y[b]) + np.abs(run))
        rows.append(np.where(np.abs(off) <= noise, 0.0, off))
    return np.stack(rows)


def _of_end(waypoints: JointWaypoints, limit: FloatArray, off: FloatArray, end: int) -> float:
    """Shortest transition at an end, n >= 3: the smaller root of T (h - T/2) = |off| / limit."""
    h = float(np.diff(waypoints.time)[end])
    room = h * h - 2.0 * np.abs(off) / limit
    wrong = np.zeros((waypoints.time.size - 1, off.size), dtype=bool)
    wrong[end] = room < -ROUNDING * h * h
    refuse_first(
        wrong,
        waypoints,
        lambda _, j: (
            f"acceleration_limit {limit[j]:.6g} is below the {2.0 * abs(off[j]) / h**2:.6g} that "
            f"the transition at the {'start' if end == 0 else 'end'} takes at least"
        ),
    )
    root = np.sqrt(np.maximum(room, 0.0))
    return float((2.0 * np.abs(off) / limit / (h + root)).max())


def _of_single_interval(waypoints: JointWaypoints, limit: FloatArray, off: FloatArray) -> float:
    """Shortest T for the two transitions of a single interval.

    The line between has m - v0 = (D0 + E T)/(h - T) and m - v1 = (D1 - E T)/(h - T), with
    E = (v0 - v1)/2. A change of ± (D + E T) keeps the limit A where
    T² - (h ∓ E/A) T ± D/A <= 0: between the roots.
    """
    h = float(waypoints.time[1] - waypoints.time[0])
    drift = np.where(off.any(axis=0), 0.5 * (waypoints.velocity[0] - waypoints.velocity[1]), 0.0)
    terms = [
        (sign * d, sign * e)
        for d, e in zip(off, (drift, -drift), strict=True)
        for sign in (1.0, -1.0)
    ]
    low, high = np.zeros(limit.size), np.full(limit.size, 0.5 * h)
    for d, e in terms:
        b, q = h - e / limit, d / limit
        room = b * b - 4.0 * q
        root = np.sqrt(np.maximum(room, 0.0))
        far = 0.5 * (b + np.where(b > 0.0, root, -root))
        near = np.divide(q, far, out=np.zeros_like(q), where=far != 0.0)
        low = np.maximum(low, np.minimum(near, far))
        high = np.where(room < -ROUNDING * h * h, -h, np.minimum(high, np.maximum(near, far)))
    least, most = float(low.max()), float(high.min())
    enough = np.max([np.abs(d + 0.5 * h * e) for d, e in terms], axis=0) * 4.0 / h**2
    refuse_first(
        np.array([limit < enough]) & np.array(least > most + ROUNDING * h),
        waypoints,
        lambda _, j: (
            f"acceleration_limit {limit[j]:.6g} is too low, with the limits of the other joints; "
            f"{enough[j]:.6g} is sufficient"
        ),
    )
    return min(least, 0.5 * h)
