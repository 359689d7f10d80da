"""The first view of a scene: from above and from the side of the task, with all parts in view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from knotwork.view.mesh import box_corners
from knotwork.waypoints import FloatArray

# Elevation, and of scenes lower than FLAT_SCENE, relative to their width.
ELEVATION, STEEP, FLAT_SCENE = np.radians(24.0), np.radians(52.0), 0.3
# Azimuth relative to the direction of the task, so that the arm does not hide it.
ASIDE_ANGLE = np.radians(10.0)
# Turn of the azimuth away from other robots, so that they do not hide the arm.
CLEAR_ANGLE = np.radians(75.0)
# Margin around a view of the task alone, as a fraction of its size.
VIEW_MARGIN = 0.35


def views(
    points: FloatArray,
    task: FloatArray,
    other_robots: FloatArray,
    towards: Sequence[float] | None = None,
) -> dict[str, Any]:
    """Choose the views of the whole, and of the task alone.

    Args:
        points: Points of the arm and the task, all in view [m], z up, shape (n, 3).
        task: Points of the tool's path and the waypoints [m], shape (m, 3), m >= 0.
        other_robots: Points of other robots [m], shape (k, 3), k >= 0.
        towards: Unit vector from the scene towards the camera, if known.

    Returns:
        `view` has the direction `from` and the `points` of the view of all. `work` has those of the
        task alone, or is `None`.
    """
    size = np.ptp(points, axis=0)
    if towards is None:
        x, y, _ = (task if len(task) else points).mean(axis=0)
        around = (np.arctan2(y, x) if np.hypot(x, y) > 1e-3 else 0.0) + ASIDE_ANGLE
        if len(other_robots):
            apart_x, apart_y = (other_robots[:, :2] - [x, y]).mean(axis=0)
            around -= np.copysign(CLEAR_ANGLE, np.sin(np.arctan2(apart_y, apart_x) - around))
        up = STEEP if size[2] < FLAT_SCENE * size[:2].max() else ELEVATION
        level = np.cos(up)
        towards = [float(level * np.cos(around)), float(level * np.sin(around)), float(np.sin(up))]
    view = {"from": towards, "points": points.tolist()}
    extent = float(np.ptp(task, axis=0).max()) if len(task) else 0.0
    if extent < 1e-3 * size.max():
        return {"view": view, "work": None}
    margin = VIEW_MARGIN * extent
    corners = box_corners(np.array([task.min(axis=0) - margin, task.max(axis=0) + margin]))
    return {"view": view, "work": {**view, "points": corners.tolist()}}
