"""The first view of a scene: arm and task in view, and little of the path hidden."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knotwork.view.primitive_meshes import frame_along
from knotwork.waypoints import FloatArray

ELEVATIONS = np.radians([24.0, 38.0])
STEEP = np.radians(52.0)
# Angles from the direction of the task; the first that is nearly as good as the best is taken.
ASIDE = np.radians([-50.0, 50.0, -25.0, 25.0, -75.0, 75.0, -100.0, 100.0, 0.0])
NEARLY = 0.04
# A scene lower than this, relative to its width, is seen from above.
FLAT = 0.3
# Number of pieces of the path, of one length, that are tested.
LOOKS = 60


# A task smaller than this, in parts of the arm and the task, is shown alone at first, with
# this margin around it, in parts of its size.
SMALL, AROUND = 0.4, 0.35


def views(
    points: FloatArray,
    path: FloatArray,
    asked: FloatArray,
    arms: Sequence[FloatArray] = (),
    towards: Sequence[float] | None = None,
) -> dict[str, Any]:
    """Choose the views of the whole, and of the task alone.

    Args:
        points: Of the arm and the task [m], z up, shape (n, 3).
        path: Of the tool [m], shape (m, 3), m >= 0.
        asked: Where waypoints are [m], shape (k, 3).
        arms: Triangles of the arm, as for `first_view`.
        towards: Direction to look from, if that is known, as in `first_view`.

    Returns:
        `view`, of all; `work`, of the task alone, or `None`; and `near`, whether the task is shown
        first.
    """
    if towards is None:
        view = first_view(points, path, arms)
    else:
        view = {"from": towards, "points": points.tolist()}
    task = np.concatenate([path, asked])
    size, extent = np.ptp(points, axis=0).max(), np.ptp(task, axis=0) if len(task) else np.zeros(3)
    if extent.max() < 1e-3 * size:
        return {"view": view, "work": None, "near": False}
    margin = AROUND * float(extent.max())
    low, high = task.min(axis=0) - margin, task.max(axis=0) + margin
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    near = bool(extent.max() < SMALL * size)
    return {"view": view, "work": {**view, "points": corners.tolist()}, "near": near}


def first_view(
    points: FloatArray, path: FloatArray, arms: Sequence[FloatArray] = ()
) -> dict[str, Any]:
    """Choose the direction to look from, and the points that must be in view.

    Among a few directions, the choice is the one that shows most of the path's length: not behind
    the arm, and not along the line of sight.

    Args:
        points: Of the arm and the task [m], z up, shape (n, 3).
        path: Of the tool [m], shape (m, 3), m >= 0.
        arms: Triangles of the arm where it stands at first, and then at the waypoints [m], each of
            shape (k, 3, 3).

    Returns:
        `from`, the unit vector from the scene towards the camera, and `points`, which must be in
        view.
    """
    extent = np.ptp(points, axis=0)
    flat = extent[2] < FLAT * max(extent[0], extent[1])
    middle = path.mean(axis=0) if len(path) else points.mean(axis=0)
    outwards = float(np.arctan2(middle[1], middle[0])) if np.linalg.norm(middle[:2]) > 1e-3 else 0.0
    choices = [
        np.array(
            [
                np.cos(elevation) * np.cos(outwards + aside),
                np.cos(elevation) * np.sin(outwards + aside),
                np.sin(elevation),
            ]
        )
        for elevation in ([STEEP] if flat else ELEVATIONS)
        for aside in ASIDE
    ]
    seen = np.array([_seen(_evenly(path), arms, towards) for towards in choices])
    towards = choices[int(np.flatnonzero(seen >= seen.max() - NEARLY)[0])]
    return {"from": towards.tolist(), "points": points.tolist()}


def hidden(points: FloatArray, triangles: FloatArray, towards: FloatArray) -> NDArray[np.bool_]:
    """Find the points that lie behind a triangle, seen from far away.

    Args:
        points: [m], shape (n, 3).
        triangles: Corners [m], shape (k, 3, 3).
        towards: Unit vector from the scene towards the camera, shape (3,).

    Returns:
        Shape (n,).
    """
    axes = frame_along(towards)  # the screen's two, and the depth
    seen, corners = points @ axes, triangles @ axes
    low, high = corners.min(axis=1), corners.max(axis=1)
    near = (low[:, :2] <= seen[:, :2].max(axis=0)) & (high[:, :2] >= seen[:, :2].min(axis=0))
    corners = corners[near.all(axis=1) & (high[:, 2] >= seen[:, 2].min())]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    keep = np.abs(area) > 1e-12
    corners, first, second, area = corners[keep], first[keep], second[keep], area[keep]
    # Each point p = corner + u first + v second on the screen, shape (n, k)
    x = seen[:, np.newaxis, 0] - corners[:, 0, 0]
    y = seen[:, np.newaxis, 1] - corners[:, 0, 1]
    u = (x * second[:, 1] - y * second[:, 0]) / area
    v = (y * first[:, 0] - x * first[:, 1]) / area
    depth = corners[:, 0, 2] + u * first[:, 2] + v * second[:, 2]
    covers = (u >= 0) & (v >= 0) & (u + v <= 1) & (depth > seen[:, np.newaxis, 2])
    return np.asarray(covers.any(axis=1))


def _seen(path: FloatArray, arms: Sequence[FloatArray], towards: FloatArray) -> float:
    """Visible part of a path, in 0 … 1; the first pose of the arm counts half."""
    steps = np.diff(path, axis=0)
    length = np.linalg.norm(steps, axis=1)
    if not len(length):
        return 0.0
    across = np.sqrt(np.maximum(length**2 - (steps @ towards) ** 2, 0.0))
    worth = 0.5 * (1.0 + across / length) * length / length.sum()
    middles = path[:-1] + 0.5 * steps
    free = [float(worth[~hidden(middles, arm, towards)].sum()) for arm in arms]
    if not free:
        return float(worth.sum())
    return 0.5 * free[0] + 0.5 * float(np.mean(free[1:] or free))


def _evenly(path: FloatArray) -> FloatArray:
    """Points evenly spaced along a path; none if it has no length."""
    along = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))] if len(path) else [[]]
    )
    if not len(along) or along[-1] < 1e-6:
        return np.zeros((0, 3))
    at = np.linspace(0.0, along[-1], LOOKS + 1)
    return np.stack([np.interp(at, along, path[:, i]) for i in range(3)], axis=1)
