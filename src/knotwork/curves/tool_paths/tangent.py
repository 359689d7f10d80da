"""`tangent_orientation`: a tool with a constant direction relative to its curve."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths.arc import Arc
from knotwork.curves.tool_paths.curve import Curve, geometry_error
from knotwork.curves.tool_paths.orientation import OrientationCurve
from knotwork.curves.tool_paths.polynomial_curve import PolynomialCurve
from knotwork.curves.tool_paths.rotations import checked_rotations, rotation_matrices

DIRECTION_TOLERANCE = 1e-6
"""Tolerance of the curve's direction in tool axes [rad]."""

MAX_TURN = 0.1
"""Maximum turn in one part [rad]."""

PART_SAMPLES = (0.2, 0.35, 0.5, 0.65, 0.8)
"""Fractions of each part at which the direction is compared with the curve's."""

MAX_CURVE_PARTS = 1 << 16
"""Maximum number of parts of a curve."""


def tangent_orientation(curve: Curve, rotation: ArrayLike) -> OrientationCurve:
    """Turn a tool with the direction of a curve, and not about it.

    The tool rotates with the angular velocity T × T' per unit length, T the direction of the curve
    (a rotation-minimising frame). On an arc this is a uniform rotation about its normal, and on a
    line there is no rotation. On other curves the direction in tool axes is constant within 1e-6
    rad.

    Args:
        curve: The curve.
        rotation: Rotation matrix of the tool at the start, in base axes.

    Raises:
        PathError: The matrix is not a rotation, or the curve turns too sharply.

    >>> tp = kw.tool_paths
    >>> blend = tp.Blend([0, 0, 0], [1, 0, 0], [1, 1, 0], 0.1)
    >>> tp.tangent_orientation(blend, np.eye(3)).rotations[-1].round(9) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    R0 = checked_rotations(rotation, (3, 3), "rotation")
    if isinstance(curve, Arc):
        return OrientationCurve.turning(R0, curve.normal, curve.angle, curve.length)
    if not isinstance(curve, PolynomialCurve):
        return OrientationCurve.constant(R0, curve.length)
    seen = R0.T @ curve.position([0.0], 1)[0]  # the direction in the axes of the tool
    s = curve.piece_ends
    while len(s) <= MAX_CURVE_PARTS:
        middle = 0.5 * (s[1:] + s[:-1])
        coarse = _turn_angles(curve, s) > MAX_TURN
        if not coarse.any():
            orientation = _integrate(curve, R0, s)
            for share in PART_SAMPLES:
                at = s[:-1] + share * np.diff(s)
                off = orientation.rotation(at) @ seen - curve.position(at, 1)
                coarse |= np.linalg.norm(off, axis=1) > DIRECTION_TOLERANCE
            if not coarse.any():
                return orientation
        s = np.sort(np.concatenate((s, middle[coarse])))
    raise geometry_error(
        "the curve, {length} long, turns too sharply for a tool that turns with it",
        length=curve.length,
    )


def _turn_angles(curve: Curve, s: FloatArray) -> FloatArray:
    """Angles between the directions at neighbouring arc lengths."""
    T = curve.position(s, 1)
    return np.asarray(np.arccos(np.clip(np.einsum("ki,ki->k", T[1:], T[:-1]), -1.0, 1.0)))


def _integrate(curve: Curve, R0: FloatArray, s: FloatArray) -> OrientationCurve:
    """Orientation integrated along a curve in steps, by Magnus' method of fourth order.

    Each step corrects the remaining error of the direction.
    """
    h = np.diff(s)
    gauss = [s[:-1] + (0.5 + sign * math.sqrt(3.0) / 6.0) * h for sign in (-1.0, 1.0)]
    first, second = (np.cross(curve.position(at, 1), curve.position(at, 2)) for at in gauss)
    vectors = 0.5 * h[:, None] * (first + second)
    vectors -= math.sqrt(3.0) / 12.0 * (h**2)[:, None] * np.cross(first, second)
    T = curve.position(s, 1)
    rotations = [R0]
    for i, step in enumerate(rotation_matrices(vectors)):
        R = step @ rotations[-1]
        correction = np.cross(step @ T[i], T[i + 1])
        rotations.append(rotation_matrices(correction[None])[0] @ R)
    # The third derivative of a spline jumps at its points: the mean of both sides is used.
    inside = 1e-9 * np.concatenate((h[:1], h, h[-1:]))
    third = 0.5 * (curve.position(s - inside[:-1], 3) + curve.position(s + inside[1:], 3))
    rates, changes = np.cross(T, curve.position(s, 2)), np.cross(T, third)
    return OrientationCurve(s, np.array(rotations), rates, changes, s[[0, -1]])
