"""Cells of a point cloud: the grid cubes that hold its points, as solids."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import coal
import numpy as np
from numpy.typing import NDArray

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.units import Units

MAX_CLOUD_CELLS = 100_000
"""Maximum number of cells; a distance to them takes about 10 ms."""

FARTHEST_CELL = 2**15
"""Distance from the origin, in edges of a cell, from which Coal silently drops cells."""

CUBE_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])


@dataclass(frozen=True, eq=False)
class Cells:
    """Cubes of a grid with a corner at the origin.

    Attributes:
        index: Grid indices of the cubes, unique, shape (n, 3).
        edge: Edge length of a cube [m].
    """

    index: NDArray[np.int64]
    edge: float

    @property
    def centres(self) -> FloatArray:
        """Centres of the cubes [m], shape (n, 3)."""
        return np.asarray((self.index + 0.5) * self.edge)

    def coarser(self) -> Cells:
        """Cubes of twice the size that contain these."""
        return Cells(np.unique(self.index // 2, axis=0), 2 * self.edge)

    def octree(self) -> Any:
        """The cubes as a Coal octree; rounding in Coal keeps their centres inside."""
        return coal.makeOctree(self.centres, self.edge)

    @cached_property
    def outermost(self) -> FloatArray:
        """Corners whose convex hull is that of all cubes [m], shape (m, 3)."""
        extreme = self.index
        for axis in range(3):  # a cube between two others of a row is not a corner of the hull
            order = np.lexsort((extreme[:, axis], extreme[:, axis - 1], extreme[:, axis - 2]))
            extreme = extreme[order]
            row = np.delete(extreme, axis, axis=1)
            first = np.append(True, (row[1:] != row[:-1]).any(axis=1))
            extreme = extreme[first | np.append(first[1:], True)]
        corners = np.unique((extreme[:, None] + CUBE_CORNERS).reshape(-1, 3), axis=0)
        return np.asarray(corners * self.edge)

    @cached_property
    def point_of_each_part(self) -> FloatArray:
        """A point of each connected part [m], shape (m, 3); a common corner connects cubes."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import KDTree

        n = len(self.index)
        near = KDTree(self.index).query_pairs(1.5, p=np.inf, output_type="ndarray")
        joined = coo_array((np.ones(len(near)), near.T), shape=(n, n))
        part = connected_components(joined, directed=False)[1]
        return self.centres[np.unique(part, return_index=True)[1]]


@lru_cache(maxsize=32)
def read_cells(path: Path, changed: int, scale: float, edge: float, units: Units) -> Cells:
    """Read a point cloud, and collect the cells that hold its points.

    Args:
        path: The file.
        changed: Time of its last change, the key of the cache.
        scale: Scale factor from the file's numbers to m.
        edge: Edge length of a cell [m].
        units: Units of messages.

    Raises:
        InputError: The file can't be read; there are too many cells or one too far from the origin,
            or all points are within less than a cell.
    """
    from knotwork.scene.meshes.cloud_file import read_cloud

    points = scale * read_cloud(path)
    extent, cell = float(np.ptp(points, axis=0).max()), units.text(edge, "m", ".3g")
    if len(points) > 1 and extent < edge:
        raise InputError(
            f"point cloud {path} is {units.text(extent, 'm', '.3g')} across, less than a cell of "
            f"{cell}; give a smaller resolution, or a larger scale if it is in another unit"
        )
    larger = "give a larger resolution, or a smaller scale if it is in another unit"
    farthest = float(np.abs(points).max()) / edge
    if farthest >= FARTHEST_CELL - 1:
        raise InputError(
            f"point cloud {path} has a point {units.text(farthest * edge, 'm')} from its origin, "
            f"which is {farthest:.4g} cells of {cell}, and at most {FARTHEST_CELL - 1} are "
            f"accepted; move the points to their origin, {larger}"
        )
    index = np.unique(np.floor(points / edge).astype(np.int64), axis=0)
    if len(index) > MAX_CLOUD_CELLS:
        raise InputError(
            f"point cloud {path} fills {len(index)} cells of {cell}, and at most "
            f"{MAX_CLOUD_CELLS} are accepted; {larger}"
        )
    return Cells(index, edge)
