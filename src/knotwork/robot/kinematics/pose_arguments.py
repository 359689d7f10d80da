"""Checks of the arguments of pose solvers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import ArrayError
from knotwork.errors.arguments import require_number

POSE_ROTATION_TOLERANCE = 1e-6
"""Tolerance of RᵀR = I for rotation matrices."""
FINEST_TOLERANCE = 1e-12
"""Finest tolerance of a pose, because of rounding [m, rad]."""
MAX_COORDINATE = 1e150
"""Squares of larger numbers overflow [m]."""


def check_pose(pose: Any, name: str = "pose") -> None:
    """Check a pose.

    Raises:
        ArrayError: The pose is not a `pin.SE3`, is not finite, is so far away that its
            distance overflows, or its matrix is not a rotation.
    """
    if not isinstance(pose, pin.SE3) or not np.isfinite(pose.homogeneous).all():
        raise ArrayError(f"{name} must be a finite pin.SE3, not {pose!r}", value=pose)
    R = pose.rotation
    error, determinant = float(np.abs(R.T @ R - np.eye(3)).max()), float(np.linalg.det(R))
    if error > POSE_ROTATION_TOLERANCE or determinant < 0.0:
        raise ArrayError(
            f"the matrix of {name} is not a rotation: for {R.tolist()} the product RᵀR differs "
            f"from I by {error:.3g}, and the determinant is {determinant:.6g}; accepted: a "
            f"difference up to {POSE_ROTATION_TOLERANCE:g} and a determinant above 0",
            value=pose,
        )
    if np.abs(pose.translation).max() > MAX_COORDINATE:
        position = f"{name} is at {pose.translation.tolist()} m"
        raise ArrayError(f"{position}; up to {MAX_COORDINATE:g} m is accepted", value=pose)


def check_request(pose: Any, position_tolerance: Any, orientation_tolerance: Any) -> None:
    """Check a pose and its tolerances.

    Raises:
        ArrayError: As `check_pose`; or a tolerance is too fine.
        InputError: A tolerance is not a positive, finite number.
    """
    check_pose(pose)
    for name, value, unit in (
        ("position_tolerance", position_tolerance, "m"),
        ("orientation_tolerance", orientation_tolerance, "rad"),
    ):
        if require_number(value, name, unit, positive=True) < FINEST_TOLERANCE:
            message = f"{name} {value:g} is finer than rounding; {FINEST_TOLERANCE:g} or more is"
            raise ArrayError(f"{message} accepted", value=value)
