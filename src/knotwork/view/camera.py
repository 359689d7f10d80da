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
# Azimuth from other robots, if possible, so that they do not hide the arm. Robots nearer to the
# task than this fraction of the whole scene have no direction.
CLEAR_ANGLE, NEAR_ROBOT = np.radians(75.0), 0.15
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
        apart = other_robots[:, :2] - [x, y]
        around += _turn_away(apart[np.hypot(*apart.T) > NEAR_ROBOT * size.max()], around)
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


def _turn_away(apart: FloatArray, around: float) -> float:
    """Smallest turn of a direction that keeps it away from others (k, 2)."""
    if not len(apart):
        return 0.0
    turns = np.radians(np.arange(-165, 181, 15))
    turns = turns[np.argsort(np.abs(turns), kind="stable")]
    off = around + turns[:, None] - np.arctan2(apart[:, 1], apart[:, 0])
    clear = np.arccos(np.clip(np.cos(off), -1.0, 1.0)).min(axis=1)
    return float(turns[np.argmax(np.minimum(clear, CLEAR_ANGLE))])
