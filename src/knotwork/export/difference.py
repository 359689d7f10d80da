"""Distance of the curve through points from a motion, by polynomials and not by samples."""

from __future__ import annotations

import numpy as np

from knotwork.interpolation.pieces import raised
from knotwork.polynomial.critical_points import differentiate
from knotwork.polynomial.extrema import candidates
from knotwork.polynomial.refined import refined
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray


def largest_difference(
    trajectory: JointTrajectory, times: FloatArray, joined: FloatArray, order: int = 0
) -> FloatArray:
    """Largest absolute difference of a derivative on each piece, shape (pieces, d).

    Args:
        trajectory: The motion; its breaks are among the times.
        times: Ends of the pieces [s], shape (pieces + 1,).
        joined: Polynomials of the pieces, highest power first, shape (k + 1, pieces, d).
        order: Order of the derivative: 0 for the position.
    """
    own = refined(trajectory.polynomial, times).c
    degree = max(len(own), len(joined)) - 1
    difference = raised(own, degree) - raised(joined, degree)
    for _ in range(order):
        difference = differentiate(difference)
    return np.asarray(np.abs(candidates(times, difference)[0]).max(axis=0))
