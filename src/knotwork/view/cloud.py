"""The cells of a point cloud as a mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.errors import InputError
from knotwork.scenario import Shape
from knotwork.scene.cells import read_cells
from knotwork.view.mesh import Mesh, from_triangles

MOST_DRAWN = 10_000
"""Cells that are drawn; of more, larger ones that hold them."""


def cloud_mesh(shape: Shape, colour: Sequence[float]) -> Mesh:
    """Draw the sides of a cloud's cells that no other cell covers, in its own axes.

    Raises:
        InputError: The file can't be read.
    """
    if shape.path is None:
        raise InputError("a point cloud needs a file")
    changed = shape.path.stat().st_mtime_ns
    cells = read_cells(shape.path, changed, shape.scale[0], shape.resolution)
    while len(cells.index) > MOST_DRAWN:
        cells = cells.coarser()
    taken = set(map(tuple, cells.index.tolist()))
    quads = []
    for axis in range(3):
        across, up = np.eye(3)[axis - 2], np.eye(3)[axis - 1]
        for side in (0, 1):
            step = np.eye(3, dtype=np.int64)[axis] * (2 * side - 1)
            beside = map(tuple, (cells.index + step).tolist())
            bare = np.array([one not in taken for one in beside])
            corner = cells.index[bare] + side * np.eye(3)[axis]
            ring = [corner, corner + across, corner + across + up, corner + up]
            quads.append(np.stack(ring if side else ring[::-1], axis=1))
    corners = np.concatenate(quads) * cells.edge
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return from_triangles(triangles, colour)
