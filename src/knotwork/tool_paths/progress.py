"""How far along a path a moving point gets, on one branch of the path."""

from __future__ import annotations

import numpy as np

from knotwork.tool_paths.path import ToolPath
from knotwork.waypoints import FloatArray

JUMP = 3.0
"""A step along the path this many times as long as that in space may lead to another branch."""

SAME = 1e-9
"""Arc lengths that differ by no more are the same, relative to the path's."""


def progress(
    path: ToolPath, places: FloatArray, guess: FloatArray, within: tuple[float, float]
) -> FloatArray:
    """Arc lengths of the points of a path that are nearest to a moving point, turns counted.

    The first is searched for from its guess. Where the following ones, from theirs, jump along the
    path, each is searched for from the one before instead: where a path closes, crosses itself or
    comes near itself, the guess may be on another branch than the point.

    Args:
        path: The path.
        places: Where the point is, in order of time [m], shape (k, 3).
        guess: Arc lengths from which to search [m], shape (k,).
        within: From where to where the arc lengths may be [m].

    Returns:
        Arc lengths [m], shape (k,).

    >>> from knotwork.tool_paths.progress import progress
    >>> tp = kw.tool_paths
    >>> circle = tp.Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 2 * np.pi)
    >>> still = tp.OrientationCurve.constant(np.eye(3), circle.length)
    >>> path = tp.ToolPath([circle], still)
    >>> s = np.linspace(0, 2 * np.pi, 9)
    >>> half_and_back = path.position(np.minimum(s, 2 * np.pi - s))
    >>> progress(path, half_and_back, s, (0, path.length)).round(2)
    array([0.  , 0.79, 1.57, 2.36, 3.14, 2.36, 1.57, 0.79, 0.  ])
    """
    s: FloatArray = np.clip(path.nearest(places, guess), *within)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    jumps = np.flatnonzero(np.abs(np.diff(s)) > JUMP * steps + SAME * path.length) + 1
    k = int(jumps[0]) if jumps.size else len(s)
    while k < len(s):
        own = np.clip(path.nearest(places[k : k + 1], s[k - 1 : k]), *within)[0]
        if abs(own - s[k]) <= SAME * path.length:  # the guess is on the branch of the point again
            later = jumps[jumps > k]
            k = int(later[0]) if later.size else len(s)
        else:
            s[k] = own
            k += 1
    return s
