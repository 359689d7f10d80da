"""Joint efforts and motions of frames in many joint states, by Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray


def joint_efforts(model: Any, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Joint efforts by inverse dynamics (`pin.rnea`) [N m or N].

    Args:
        model: Pinocchio model.
        q: Joint positions, shape (..., d).
        v: Joint velocities.
        a: Joint accelerations.

    Returns:
        The efforts, shape (..., d).
    """
    data, efforts = model.createData(), np.empty_like(q)
    for index in np.ndindex(q.shape[:-1]):
        efforts[index] = pin.rnea(model, data, q[index], v[index], a[index])
    return efforts


def frame_rates(
    model: Any, frames: Sequence[tuple[int, int]], q: FloatArray, v: FloatArray, a: FloatArray
) -> FloatArray:
    """Velocities [m/s] (order 1) or accelerations [m/s²] (order 2) of the origins of frames.

    Args:
        model: Pinocchio model.
        frames: Index of each frame in the model, and the order of its rate.
        q: Joint positions, shape (n, d).
        v: Joint velocities.
        a: Joint accelerations.

    Returns:
        Vectors in the axes of the root of the model, shape (n, len(frames), 3).
    """
    readers = {1: pin.getFrameVelocity, 2: pin.getFrameClassicalAcceleration}
    data, vectors = model.createData(), np.empty((len(q), len(frames), 3))
    for row, state in zip(vectors, zip(q, v, a, strict=True), strict=True):
        pin.forwardKinematics(model, data, *state)
        for vector, (frame, order) in zip(row, frames, strict=True):
            vector[:] = readers[order](model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
    return vectors
