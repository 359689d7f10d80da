"""Convex hulls for Coal, in which a corner has at most 255 neighbours.

A hull whose corners have more is replaced by a hull around it with fewer corners: Qhull leaves out
points that are outside by less than a width, and the result is enlarged until it contains all.
"""

from __future__ import annotations

from typing import Any

import coal
import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError

MAX_COAL_POINTS = 1000
"""Maximum number of points of a hull by Coal, which takes minutes for 20,000 points."""
MAX_NEIGHBOURS = 250
"""Maximum number of neighbours of a corner."""
WIDTHS = np.geomspace(1e-6, 1e-3, 16)
"""Widths by which points may be outside before the hull is enlarged, relative to its size."""
FACET_BLOCK = 16
"""Number of facets whose distances from all points are computed at once."""
SHEET_RATIO = 1e-6
"""Ratio of thickness and length below which points count as a sheet."""
SHEET_THICKNESS = 1e-4
"""Thickness added to a sheet on both sides [m]."""


def make_convex_hull(points: FloatArray) -> Any:
    """Convex hull of points [m], shape (n, 3), for Coal; larger by about 0.05 % at most.

    It is exact if each corner has at most `MAX_NEIGHBOURS` neighbours. Flat bodies are thickened by
    `SHEET_THICKNESS` on both sides, because a hull needs an inside.

    Raises:
        InputError: The points have no hull.
    """
    points = points[np.lexsort(points.T)]
    points = points[np.append(True, np.any(points[1:] != points[:-1], axis=1))]
    points = _thicken_sheet(points)
    if len(points) <= MAX_COAL_POINTS:
        try:
            return coal.ConvexBase.convexHull(_to_coal_vectors(points), True, "Qt")
        except Exception:  # Boost.Python forwards any exception of Coal
            pass  # a corner has too many neighbours
    from scipy.spatial import ConvexHull, QhullError

    axes = np.linalg.eigh(np.cov(points.T, bias=True))[1]
    size = np.ptp(points @ axes, axis=0)
    # as wide as long, so that plates are not enlarged more
    corners = scaled = points @ axes / size
    try:
        for width in WIDTHS.tolist():
            hull = ConvexHull(corners, qhull_options=f"Qt W{width:.3g}")
            if np.bincount(hull.simplices.ravel()).max() <= MAX_NEIGHBOURS:
                enlarged = _enlarge_hull(hull, scaled) * size @ axes.T
                return coal.Convex(_to_coal_vectors(enlarged), _to_coal_triangles(hull))
            corners = corners[hull.vertices]
    except (QhullError, RuntimeError) as error:
        raise InputError(f"the convex hull of {len(points)} points can't be made") from error
    raise InputError(f"the convex hull of {len(points)} points has too many neighbours at a corner")


def _thicken_sheet(points: FloatArray) -> FloatArray:
    """Add points on both sides of a sheet or a wire; other points are unchanged."""
    spread, axes = np.linalg.eigh(np.cov(points.T, bias=True))
    for axis in axes.T[spread <= (SHEET_RATIO**2) * max(spread[-1], SHEET_THICKNESS**2)]:
        points = np.concatenate([points - SHEET_THICKNESS * axis, points + SHEET_THICKNESS * axis])
    return points


def _enlarge_hull(hull: Any, points: FloatArray) -> FloatArray:
    """Scale the corners of a hull about its largest ball until all points are inside, shape (m, 3).

    With the ball's radius r, scaling by 1 + e/r moves each facet outwards by e at least.
    """
    from scipy.optimize import linprog

    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    homogeneous = np.vstack((points.T, np.ones(len(points))))
    blocks = np.array_split(hull.equations, 1 + len(offsets) // FACET_BLOCK)
    outside = max(0.0, *(float((block @ homogeneous).max()) for block in blocks))
    rows = np.column_stack((normals, np.ones(len(normals))))
    *middle, radius = linprog([0, 0, 0, -1], rows, -offsets, bounds=[(None, None)] * 4).x
    return np.asarray(middle + (hull.points[hull.vertices] - middle) * (1.0 + outside / radius))


def _to_coal_triangles(hull: Any) -> Any:
    """Convert the hull's triangles to Coal's type, counter-clockwise seen from outside."""
    a, b, c = hull.points[hull.simplices.T]
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    corner_of = np.zeros(len(hull.points), dtype=int)
    corner_of[hull.vertices] = np.arange(len(hull.vertices))
    corners = corner_of[hull.simplices]
    corners[turned] = corners[turned][:, ::-1]
    triangles = coal.StdVec_Triangle()
    triangles.extend([coal.Triangle(*triangle) for triangle in corners.tolist()])
    return triangles


def _to_coal_vectors(points: FloatArray) -> Any:
    """Convert points to Coal's type."""
    vectors = coal.StdVec_Vec3s()
    vectors.extend(list(points))
    return vectors
