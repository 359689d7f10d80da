"""Checking what the solvers for poses are given."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import WaypointDataError

# A matrix is a rotation if RᵀR differs from I by no more.
ROTATION_TOLERANCE = 1e-6
# Squares of numbers beyond this overflow [m].
FARTHEST = 1e150


def check_pose(pose: Any, name: str = "pose") -> None:
    """Check a pose.

    Raises:
        WaypointDataError: It is no `pin.SE3`, is not finite, is too far away for its distance to
            be calculated, or its matrix is no rotation.
    """
    # X⁻¹X is the identity only if all numbers are finite and the matrix is orthogonal. That takes
    # a microsecond, which is not enough to look through arrays.
    if isinstance(pose, pin.SE3) and pose.actInv(pose).isIdentity(ROTATION_TOLERANCE):
        (a, b, c), (d, e, f), (g, h, i) = pose.rotation.tolist()
        if a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0.0:
            if max(map(abs, pose.translation.tolist())) > FARTHEST:
                place = f"{name} is at {pose.translation.tolist()} m"
                raise WaypointDataError(f"{place}; up to {FARTHEST:g} m is accepted", value=pose)
            return
    elif not isinstance(pose, pin.SE3) or not np.isfinite(pose.homogeneous).all():
        raise WaypointDataError(f"{name} must be a finite pin.SE3, not {pose!r}", value=pose)
    R = pose.rotation
    raise WaypointDataError(
        f"the matrix of {name} is no rotation: of {R.tolist()} the product RᵀR differs from I by "
        f"{np.abs(R.T @ R - np.eye(3)).max():.3g} and the determinant is {np.linalg.det(R):.6g}; "
        f"a difference up to {ROTATION_TOLERANCE:g} is accepted, and a determinant above 0",
        value=pose,
    )


def check_request(pose: Any, position_tolerance: Any, orientation_tolerance: Any) -> None:
    """Check a pose, and the tolerances that it is to be met to.

    Raises:
        WaypointDataError: As `check_pose` and `check_tolerance`.
    """
    check_pose(pose)
    check_tolerance(position_tolerance, "position_tolerance")
    check_tolerance(orientation_tolerance, "orientation_tolerance")


def check_count(value: Any, name: str, least: int = 0) -> None:
    """Check a number of things.

    Raises:
        WaypointDataError: It is no integer, or less than the least.
    """
    if type(value) is int and value >= least:
        return
    if isinstance(value, bool) or not (isinstance(value, Integral) and int(value) >= least):
        raise WaypointDataError(
            f"{name} must be an integer, {least} or more, not {value!r}", value=value
        )


def check_tolerance(value: Any, name: str) -> None:
    """Check a tolerance.

    Raises:
        WaypointDataError: It is no positive, finite number.
    """
    if type(value) is float and 0.0 < value < np.inf:
        return
    number = isinstance(value, Real) and not isinstance(value, bool)
    if not (number and 0.0 < float(value) < np.inf):
        raise WaypointDataError(f"{name} must be positive and finite, not {value!r}", value=value)
