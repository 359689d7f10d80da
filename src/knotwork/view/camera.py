"""Where to look at a scene from first: so that arm and task are in view, the task in front."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.waypoints import FloatArray

ELEVATION = np.radians(24.0)
STEEP = np.radians(52.0)
ASIDE = np.radians(50.0)
# A scene lower than this, relative to its width, is looked at from above.
FLAT = 0.3


def first_view(points: FloatArray, path: FloatArray) -> dict[str, Any]:
    """Choose the direction to look from, and the points that must be in view.

    Args:
        points: Of the arm and the task [m], z up, shape (n, 3).
        path: Of the tool [m], shape (m, 3), m >= 0.

    Returns:
        `from`, the unit vector from the scene towards the camera, and `points`, which must be in
        view.
    """
    extent = np.ptp(points, axis=0)
    elevation = STEEP if extent[2] < FLAT * max(extent[0], extent[1]) else ELEVATION
    middle = path.mean(axis=0) if len(path) else points.mean(axis=0)
    outwards = float(np.arctan2(middle[1], middle[0])) if np.linalg.norm(middle[:2]) > 1e-3 else 0.0
    sides = [outwards - ASIDE, outwards + ASIDE]
    if len(path) > 2:
        # From the side that sees more of the path's length.
        spread = path[:, :2] - path[:, :2].mean(axis=0)
        along = np.linalg.svd(spread, full_matrices=False)[2][0]
        sides.sort(key=lambda side: abs(float(along @ [np.cos(side), np.sin(side)])))
    azimuth = sides[0]
    level = np.cos(elevation)
    towards = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)]
    return {"from": [float(value) for value in towards], "points": points.tolist()}
