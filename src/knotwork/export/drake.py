"""Drake: a `pydrake.trajectories.PiecewisePolynomial`."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.errors import ExportError
from knotwork.export.lossless import motion_points
from knotwork.export.packages import needed
from knotwork.trajectory import JointTrajectory


def to_drake(trajectory: JointTrajectory) -> Any:
    """Give the motion as Drake's `PiecewisePolynomial`, d rows and one column (needs `pydrake`).

    A curve of cubics is made by `PiecewisePolynomial.CubicHermite` from its knots, any other from
    its coefficients, exactly.

    Raises:
        InputError: Drake can't be imported.
    """
    how = "install it with pip install drake"
    curves = needed("pydrake.trajectories", "a Drake trajectory", how)
    polynomials = needed("pydrake.polynomial", "a Drake trajectory", how)
    try:
        knots = motion_points(trajectory).trajectory.knots
    except ExportError:
        return _from_coefficients(trajectory, curves, polynomials)
    return curves.PiecewisePolynomial.CubicHermite(
        knots.time.tolist(), knots.position.T, knots.velocity.T
    )


def _from_coefficients(trajectory: JointTrajectory, curves: Any, polynomials: Any) -> Any:
    c = trajectory.polynomial.c[::-1]  # Drake has the lowest power first
    pieces = []
    for piece in range(c.shape[1]):
        rows = np.empty((c.shape[2], 1), dtype=object)
        for joint in range(c.shape[2]):
            rows[joint, 0] = polynomials.Polynomial(np.array(c[:, piece, joint]))
        pieces.append(rows)
    return curves.PiecewisePolynomial(pieces, trajectory.breaks.tolist())
