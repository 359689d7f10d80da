"""C2 cubics from accelerations at their breaks, exact to rounding at given positions.

With the durations τ of the pieces of an interval, velocity and position at its end are linear in
the accelerations a at the breaks,

    Δv = Σ τ (a + a')/2        Δq - v h = Σ τ² (2 a + a')/6 + τ R (a + a')/2,

with R the time from the end of a piece to that of the interval. Thus the minimum-norm change of the
inner accelerations that meets both is the solution of two equations per component.
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray


def correct_accelerations(
    span: FloatArray, a: FloatArray, position: FloatArray, velocity: FloatArray
) -> FloatArray:
    """Change inner accelerations, in minimum norm, so that each interval ends at its waypoint.

    Args:
        span: Durations of the pieces [s], shape (n - 1, pieces).
        a: Accelerations at the ends of the pieces, shape (n - 1, pieces + 1, d).
        position: Positions at the ends of the intervals, shape (n, d).
        velocity: Velocities at the ends of the intervals, shape (n, d).

    Returns:
        Accelerations, of the shape of `a`.
    """
    h = span.sum(axis=1)
    u = span / h[:, None]  # as fractions of the interval
    remaining = 1.0 - np.cumsum(u, axis=1)
    # weights of the accelerations in velocity and position at the end, over h and h²
    weights = np.zeros((*u.shape[:1], 2, u.shape[1] + 1))
    weights[:, 0, :-1] += 0.5 * u
    weights[:, 0, 1:] += 0.5 * u
    weights[:, 1, :-1] += u * u / 3.0 + 0.5 * remaining * u
    weights[:, 1, 1:] += u * u / 6.0 + 0.5 * remaining * u
    v0, v1 = velocity[:-1], velocity[1:]
    mean = np.diff(position, axis=0) / h[:, None]
    wanted = np.stack((v1 - v0, mean - v0), axis=1) / h[:, None, None]
    a, inner = np.array(a), weights[:, :, 1:-1]
    normal = inner @ inner.transpose(0, 2, 1)
    for _ in range(2):  # the second iteration removes the rounding errors of the first
        missing = wanted - weights @ a
        a[:, 1:-1] += inner.transpose(0, 2, 1) @ np.linalg.solve(normal, missing)
    return a


def cubics_from_accelerations(
    span: FloatArray, a: FloatArray, position: FloatArray, velocity: FloatArray
) -> FloatArray:
    """Compute the coefficients of the cubics, shape (4, (n - 1) pieces, d), highest power first.

    The arguments are those of `correct_accelerations`. Only positions and velocities at interval
    starts are used.
    """
    left, right, s = a[:, :-1], a[:, 1:], span[:, :, None]
    gain = 0.5 * s * (left + right)
    v = velocity[:-1, None] + np.cumsum(gain, axis=1) - gain
    move = s * v + s * s * (2.0 * left + right) / 6.0
    q = position[:-1, None] + (np.cumsum(move, axis=1) - move)
    c = np.stack(((right - left) / (6.0 * s), 0.5 * left, v, q))
    return c.reshape(4, span.size, -1)
