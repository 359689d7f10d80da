"""A part of a mesh: triangles of one material."""

from __future__ import annotations

from pathlib import Path
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
        uv: Image coordinates of each corner, from the lower left, shape (m, 3, 2), or `None`.
        colour: Red, green, blue and opacity in 0 … 1, or `None`.
        image: File of its image, or `None`.
        fault: Reason why the image of the file is not used, or empty.
    """

    points: FloatArray
    triangles: IndexArray
    uv: FloatArray | None = None
    colour: Colour | None = None
    image: Path | None = None
    fault: str = ""
