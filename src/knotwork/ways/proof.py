"""Whether a motion or a polyline is proved clear over all its length."""

from __future__ import annotations

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.scene.model import CollisionModel
from knotwork.verification.bounds.clearance import Clearance, clearances
from knotwork.waypoints import FloatArray


def not_clear(
    model: CollisionModel, curve: PiecewisePolynomial, resolution: float
) -> list[Clearance]:
    """Pairs that collide over a motion, or are not proved to keep their margin.

    A clearance nearer than the resolution [m] to its margin may count as not kept.
    """
    found = clearances(model, curve, resolution, precision=np.inf)
    return [one for one in found if one.verdict != "clear"]


def too_near(model: CollisionModel, line: FloatArray, resolution: float) -> list[Clearance]:
    """Pairs that are not proved to keep their margin along a polyline; corners of shape (n, d)."""
    length = np.linalg.norm(np.diff(line, axis=0), axis=1)
    slope = np.diff(line, axis=0) / length[:, None]
    zero = np.zeros_like(slope)
    along = np.concatenate(([0.0], np.cumsum(length)))
    curve = PiecewisePolynomial(np.stack((zero, zero, slope, line[:-1])), along)
    return not_clear(model, curve, resolution)
