"""Proofs that a motion or a polyline is collision-free along its whole length."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.scene.collision_model import CollisionModel
from knotwork.verification.bounds.clearance import Clearance, clearances


def unproved_pairs(
    model: CollisionModel, curve: PiecewisePolynomial, resolution: float
) -> list[Clearance]:
    """Pairs that collide over a motion, or are not proved to keep their margin.

    A clearance within the resolution [m] of its margin may count as a violation.
    """
    results = clearances(model, curve, resolution, precision=np.inf)
    return [clearance for clearance in results if clearance.verdict != "clear"]


def polyline_curve(line: FloatArray) -> PiecewisePolynomial:
    """A polyline over its length [rad or m]; corners of shape (n, d)."""
    length = np.linalg.norm(np.diff(line, axis=0), axis=1)
    slope = np.diff(line, axis=0) / length[:, None]
    zero = np.zeros_like(slope)
    along = np.concatenate(([0.0], np.cumsum(length)))
    return PiecewisePolynomial(np.stack((zero, zero, slope, line[:-1])), along)
