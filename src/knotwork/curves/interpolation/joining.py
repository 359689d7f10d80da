"""Joining of polynomials to a curve through waypoints."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import InputError
from knotwork.waypoints import JointWaypoints


def join_pieces(
    waypoints: JointWaypoints, c: FloatArray, breaks: FloatArray | None = None
) -> PiecewisePolynomial:
    """Join polynomials to a curve, without pieces of zero duration.

    Args:
        waypoints: The waypoints of the curve.
        c: Coefficients, shape (k+1, m, d), highest power first.
        breaks: Ends of the polynomials [s], shape (m+1,), never decreasing; by default the
            waypoint times.

    Raises:
        InputError: The coefficients exceed the range of floats.
    """
    if breaks is None:
        breaks = waypoints.time
    else:
        lasting = np.diff(breaks) > 0.0
        c, breaks = c[:, lasting], np.append(breaks[:-1][lasting], breaks[-1])
    if not np.isfinite(c).all():
        _, piece, joint = (int(i) for i in np.argwhere(~np.isfinite(c))[0])
        raise InputError(
            f"the motion of joint {waypoints.joint_names[joint]!r} from "
            f"{breaks[piece]:.17g} s to {breaks[piece + 1]:.17g} s exceeds the range of "
            "floating-point numbers; the times are too close for the values given"
        )
    return PiecewisePolynomial(c, breaks)
