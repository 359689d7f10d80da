"""Cubic pieces from positions and velocities."""

from __future__ import annotations

import numpy as np

from knotwork.waypoints import FloatArray


def hermite_coefficients(t: FloatArray, r: FloatArray, v: FloatArray) -> FloatArray:
    """Coefficients of the cubics that join positions and velocities: Eqs. (5), (6), (18).

    Args:
        t: Times, shape (m,).
        r: Positions, shape (m, d).
        v: Velocities, shape (m, d).

    Returns:
        Coefficients in the local time of each piece, shape (4, m-1, d), highest power first.
    """
    h = np.diff(t)[:, None]
    slope = np.diff(r, axis=0) / h
    # how far the mean velocity is from the one at each end, over h: units of acceleration
    early, late = (slope - v[:-1]) / h, (v[1:] - slope) / h
    return np.stack(((late - early) / h, 2.0 * early - late, v[:-1], r[:-1]))
