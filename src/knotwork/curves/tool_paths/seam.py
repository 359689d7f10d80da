"""Axes of a seam on a surface, and the angles of a torch in them."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.errors import PathError

MIN_NORMAL_ANGLE = 1e-3
"""Minimum angle of a normal to the seam's direction [rad]."""

TOOL_AXES = {"x": 0.0, "y": 0.5 * math.pi, "-x": math.pi, "-y": -0.5 * math.pi}
"""Tool axes that may point along a seam, and their angle about the tool's z axis [rad]."""


def seam_frames(tangents: ArrayLike, normals: ArrayLike) -> FloatArray:
    """Axes of a seam: x along it, y across to the left, z out of the surface; shape (k, 3, 3).

    Args:
        tangents: Directions of the seam, shape (k, 3).
        normals: Directions out of the surface, made perpendicular to it, shape (k, 3) or (3,).

    Raises:
        PathError: A direction is zero, or a normal is along the seam.

    >>> from knotwork.curves.tool_paths.seam import seam_frames
    >>> seam_frames([[2, 0, 0]], [1, 0, 5])[0]
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    T, N = np.broadcast_arrays(np.asarray(tangents, dtype=float), np.asarray(normals, dtype=float))
    sizes = [np.linalg.norm(vectors, axis=1, keepdims=True) for vectors in (T, N)]
    if not all(size.all() for size in sizes):
        raise PathError("the direction of the seam or the normal of the surface is zero")
    T, across = T / sizes[0], np.cross(N / sizes[1], T / sizes[0])
    size = np.linalg.norm(across, axis=1, keepdims=True)
    if size.min() < MIN_NORMAL_ANGLE:
        raise PathError("the normal of the surface is the direction of the seam itself")
    across /= size
    return np.stack((T, across, np.cross(T, across)), axis=2)


def torch_rotation(work: float, travel: float, forward: str = "x") -> FloatArray:
    """Rotation of a tool in the axes of its seam, shape (3, 3).

    At zero angles its z axis points into the surface. The work angle tilts the tool to the left,
    about the seam. Then the travel angle tilts it back in the plane of seam and tool, so that it
    points forward (a push angle; a drag angle is negative).

    Args:
        work: Work angle [rad].
        travel: Travel angle [rad].
        forward: Axis of the tool that points along the seam at zero angles, see `TOOL_AXES`.

    Raises:
        PathError: An angle is a quarter of a turn or more.
    """
    for name, angle in (("work_angle", work), ("travel_angle", travel)):
        if abs(angle) >= 0.5 * math.pi:
            raise PathError(
                f"{name} is {math.degrees(angle):.6g} deg; angles below 90 deg to either side of "
                "the normal are accepted"
            )
    leaning = pin.utils.rotate("x", -work) @ pin.utils.rotate("y", -travel)
    into = np.diag([1.0, -1.0, -1.0]) @ pin.utils.rotate("z", -TOOL_AXES[forward])
    return np.asarray(leaning @ into)
