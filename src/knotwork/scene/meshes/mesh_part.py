"""A part of a mesh: triangles of one material."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.waypoints import FloatArray

IndexArray = NDArray[np.int64]
Colour = tuple[float, float, float, float]


class MeshPart(NamedTuple):
    """Triangles of one material.

    Attributes:
        points: [m], shape (n, 3).
        triangles: Indices of points, counter-clockwise seen from outside, shape (m, 3).
        colour: Red, green, blue and opacity in 0 … 1, or `None`.
    """

    points: FloatArray
    triangles: IndexArray
    colour: Colour | None = None
