"""TOPP-RA, a peer of several benchmarks: how long it takes along a path."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray


def toppra_duration(
    s: FloatArray,
    q: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    *,
    ends: str = "not-a-knot",
    grid: int | None = None,
) -> float:
    """Duration along a cubic spline, at rest at both ends [s]; NaN where it finds none.

    Args:
        s: Path parameter, shape (n,).
        q: Joint positions there [rad or m], shape (n, d).
        velocity: Limits [rad/s or m/s], shape (d,).
        acceleration: Limits [rad/s² or m/s²], shape (d,).
        ends: How the spline ends, as for SciPy's `CubicSpline`.
        grid: Number of grid points; by default TOPP-RA chooses them.
    """
    ta: Any = importlib.import_module("toppra")
    constraint: Any = importlib.import_module("toppra.constraint")
    algorithm: Any = importlib.import_module("toppra.algorithm")
    ta.setup_logging("ERROR")
    limits = [
        constraint.JointVelocityConstraint(np.stack((-velocity, velocity), axis=1)),
        constraint.JointAccelerationConstraint(np.stack((-acceleration, acceleration), axis=1)),
    ]
    found = algorithm.TOPPRA(
        limits,
        ta.SplineInterpolator(s, q, bc_type=ends),
        gridpoints=None if grid is None else np.linspace(s[0], s[-1], grid),
        parametrizer="ParametrizeConstAccel",
    ).compute_trajectory(0.0, 0.0)
    return float(found.duration) if found is not None else np.nan
