"""The first view of a scene: from above and from beside the task, with all of it in view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from knotwork.view.mesh import box_corners
from knotwork.waypoints import FloatArray

# Above the horizon, and of scenes lower than FLAT, relative to their width.
ELEVATION, STEEP, FLAT = np.radians(24.0), np.radians(52.0), 0.3
# From the direction of the task, so that the arm is not before it.
ASIDE = np.radians(10.0)
# So far around from other robots, where that can be, so that they are not before it either; where
# they are nearer to the task than this, in parts of the whole, they are no direction.
CLEAR, NEAR = np.radians(75.0), 0.15
# Around a task that is looked at alone, in parts of its size.
AROUND = 0.35


def views(
    points: FloatArray,
    task: FloatArray,
    others: FloatArray,
    towards: Sequence[float] | None = None,
) -> dict[str, Any]:
    """Choose the views of the whole, and of the task alone.

    Args:
        points: Of the arm and the task, which must be in view [m], z up, shape (n, 3).
        task: Of the tool's path and the waypoints [m], shape (m, 3), m >= 0.
        others: Of other robots [m], shape (k, 3), k >= 0.
        towards: Unit vector from the scene towards the camera, if that is known.

    Returns:
        `view`, of all: its direction `from` and its `points`; and `work`, the same of the task
        alone, or `None`.
    """
    size = np.ptp(points, axis=0)
    if towards is None:
        x, y, _ = (task if len(task) else points).mean(axis=0)
        around = (np.arctan2(y, x) if np.hypot(x, y) > 1e-3 else 0.0) + ASIDE
        apart = others[:, :2] - [x, y]
        around += _turn(apart[np.hypot(*apart.T) > NEAR * size.max()], around)
        up = STEEP if size[2] < FLAT * size[:2].max() else ELEVATION
        level = np.cos(up)
        towards = [float(level * np.cos(around)), float(level * np.sin(around)), float(np.sin(up))]
    view = {"from": towards, "points": points.tolist()}
    extent = float(np.ptp(task, axis=0).max()) if len(task) else 0.0
    if extent < 1e-3 * size.max():
        return {"view": view, "work": None}
    margin = AROUND * extent
    corners = box_corners(np.array([task.min(axis=0) - margin, task.max(axis=0) + margin]))
    return {"view": view, "work": {**view, "points": corners.tolist()}}


def _turn(apart: FloatArray, around: float) -> float:
    """How far a direction is to be turned to be away from others (k, 2), as little as can be."""
    if not len(apart):
        return 0.0
    turns = np.radians(np.arange(-165, 181, 15))
    turns = turns[np.argsort(np.abs(turns), kind="stable")]
    off = around + turns[:, None] - np.arctan2(apart[:, 1], apart[:, 0])
    clear = np.arccos(np.clip(np.cos(off), -1.0, 1.0)).min(axis=1)
    return float(turns[np.argmax(np.minimum(clear, CLEAR))])
