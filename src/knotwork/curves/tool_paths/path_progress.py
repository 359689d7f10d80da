"""Arc lengths of a moving point along a path, on one branch of the path."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths.tool_path import ToolPath

BRANCH_JUMP_RATIO = 3.0
"""Ratio of a step along the path to the step in space above which the branch may have changed."""

ARC_LENGTH_TOLERANCE = 1e-9
"""Relative difference below which arc lengths are equal."""


def track_arc_length(
    path: ToolPath, positions: FloatArray, guess: FloatArray, within: tuple[float, float]
) -> FloatArray:
    """Track the arc length of the point of a path that is nearest to a moving point.

    Each search starts from its guess. If the result jumps along the path, the search starts from
    the previous point instead. Where a path closes, crosses itself or comes near itself, the guess
    may be on another branch than the point.

    Args:
        path: The path.
        positions: Positions of the point in order of time [m], shape (k, 3).
        guess: Arc lengths from which to search [m], shape (k,).
        within: Interval of the arc lengths [m].

    Returns:
        Arc lengths [m], shape (k,).

    >>> from knotwork.curves.tool_paths.path_progress import track_arc_length
    >>> tp = kw.tool_paths
    >>> circle = tp.Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 2 * np.pi)
    >>> still = tp.OrientationCurve.constant(np.eye(3), circle.length)
    >>> path = tp.ToolPath([circle], still)
    >>> s = np.linspace(0, 2 * np.pi, 9)
    >>> half_and_back = path.position(np.minimum(s, 2 * np.pi - s))
    >>> track_arc_length(path, half_and_back, s, (0, path.length)).round(2)
    array([0.  , 0.79, 1.57, 2.36, 3.14, 2.36, 1.57, 0.79, 0.  ])
    """
    s: FloatArray = np.clip(path.nearest(positions, guess), *within)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    tolerance = ARC_LENGTH_TOLERANCE * path.length
    jumps = 1 + np.flatnonzero(np.abs(np.diff(s)) > BRANCH_JUMP_RATIO * steps + tolerance)
    k = int(jumps[0]) if jumps.size else len(s)
    while k < len(s):
        nearest = np.clip(path.nearest(positions[k : k + 1], s[k - 1 : k]), *within)[0]
        if abs(nearest - s[k]) <= tolerance:  # the guess is again on the branch of the point
            later = jumps[jumps > k]
            k = int(later[0]) if later.size else len(s)
        else:
            s[k] = nearest
            k += 1
    return s
