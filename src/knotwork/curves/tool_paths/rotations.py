"""Rotation matrices of many rotation vectors, and the rotation vector of one matrix."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.errors import PathError

HALF_TURN_DIFFERENCE = np.sqrt(8.0)
"""Frobenius norm of the difference of two rotations half a turn apart."""


def rotation_matrices(vectors: FloatArray) -> FloatArray:
    """Compute the rotation matrices of rotation vectors [rad], shape (k, 3) to (k, 3, 3).

    R = I + sin(θ)/θ K + 2 sin²(θ/2)/θ² K², with K the vector's cross product (Rodrigues).
    """
    x, y, z = vectors.T
    squared = x * x + y * y + z * z
    angle = np.sqrt(squared)
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    R = second[:, None, None] * vectors[:, :, None] * vectors[:, None, :]
    diagonal = 1.0 - second * squared
    for i in range(3):
        R[:, i, i] += diagonal
    for i, j, component in ((2, 1, x), (0, 2, y), (1, 0, z)):
        R[:, i, j] += first * component
        R[:, j, i] -= first * component
    return np.asarray(R)


def multiply(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply matrices, shape (n, 3, 3), by vectors, shape (n, 3)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def rotation_vector(R: FloatArray) -> FloatArray:
    """Rotation vector of a rotation matrix [rad], shape (3,)."""
    return np.asarray(pin.log3(np.ascontiguousarray(R)), dtype=float)


def transport_axes(start: FloatArray, axes: FloatArray) -> FloatArray:
    """Turn a rotation along given z axes, each time by the shortest rotation.

    Args:
        start: Rotation before the first of them, shape (3, 3).
        axes: Unit vectors, shape (k, 3).

    Returns:
        Shape (k, 3, 3).

    Raises:
        PathError: An axis is opposite to the previous one.
    """
    result, R = np.empty((len(axes), 3, 3)), start
    for i, axis in enumerate(axes):
        z = R[:, 2]
        across, along = np.cross(z, axis), float(z @ axis)
        if along < -0.999:
            raise PathError(f"at point {i + 1} the normal is opposite to the previous one")
        K = np.array([[0, -across[2], across[1]], [across[2], 0, -across[0]], [0, 0, 0]])
        K[2] = -across[1], across[0], 0.0
        result[i] = R = R + K @ R + K @ (K @ R) / (1.0 + along)
    return result


def rotation_difference(angle: float) -> float:
    """Frobenius norm of the difference of two rotations at an angle [rad]: √8 sin(φ/2).

    The norm increases up to half a turn and is constant beyond.
    """
    return float(HALF_TURN_DIFFERENCE * np.sin(0.5 * min(angle, np.pi)))


def rotation_angle(difference: ArrayLike) -> FloatArray:
    """Angle between two rotations [rad], from the Frobenius norm of their difference."""
    return np.asarray(
        2.0 * np.arcsin(np.minimum(np.asarray(difference) / HALF_TURN_DIFFERENCE, 1.0))
    )


def checked_rotations(rotations: ArrayLike, shape: tuple[int, ...], name: str) -> FloatArray:
    """Copy rotation matrices into a read-only array, shape (..., 3, 3).

    Raises:
        ArrayError: The values are not finite or have a wrong shape.
        PathError: A matrix is not a rotation.
    """
    array = checked_array(rotations, shape, name)
    error = np.abs(np.swapaxes(array, -1, -2) @ array - np.eye(3)).max(axis=(-1, -2))
    wrong = np.argwhere(np.atleast_1d((error > 1e-9) | (np.linalg.det(array) < 0.0)))
    if wrong.size:
        index = [int(wrong[0][0])] if array.ndim == 3 else ""
        raise PathError(
            f"{name}{index} is not a rotation matrix: R'R differs from I by {np.max(error):.3g}; "
            "at most 1e-9 and a positive determinant are accepted"
        )
    return array
