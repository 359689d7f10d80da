"""The plain shapes that scenes are drawn with, as meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from knotwork.view.mesh import Mesh, from_triangles, merged, normalised
from knotwork.waypoints import FloatArray


def box(size: Sequence[float], colour: Sequence[float]) -> Mesh:
    """Make a box about the origin; size along x, y and z [m]."""
    unit = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = np.array(
        [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    )
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return from_triangles((unit * np.asarray(size, dtype=float))[triangles], colour)


def turned(profile: ArrayLike, colour: Sequence[float], sides: int = 32) -> Mesh:
    """Turn a profile about the z axis.

    Args:
        profile: Radius and height [m] from one end of the axis to the other, upwards, shape
            (k, 2).
        colour: Red, green, blue and opacity.
        sides: Number of sides around.
    """
    ring = np.asarray(profile, dtype=float)
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate(
        [
            ring[:, np.newaxis, :1] * around[np.newaxis],
            np.broadcast_to(ring[:, np.newaxis, 1:], (len(ring), sides, 1)),
        ],
        axis=2,
    )
    low, high = points[:-1], points[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    first = np.stack([low, low_next, high_next], axis=2).reshape(-1, 3, 3)
    second = np.stack([low, high_next, high], axis=2).reshape(-1, 3, 3)
    return from_triangles(np.concatenate([first, second]), colour)


def cylinder(radius: float, length: float, colour: Sequence[float]) -> Mesh:
    """Make a cylinder along z about the origin; radius and length [m]."""
    half = length / 2
    return turned([[0, -half], [radius, -half], [radius, half], [0, half]], colour)


def sphere(radius: float, colour: Sequence[float], sides: int = 24) -> Mesh:
    """Make a sphere about the origin; radius [m]."""
    return capsule(radius, 0.0, colour, sides)


def capsule(radius: float, length: float, colour: Sequence[float], sides: int = 32) -> Mesh:
    """Make a cylinder along z with half spheres at both ends; its radius and length [m]."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 2 * (sides // 4) + 2)
    profile = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    profile[[0, -1], 0] = 0.0
    profile[:, 1] += np.where(angle < 0, -length / 2, length / 2)
    return turned(profile, colour, sides)


def solid(kind: str, size: Sequence[float], colour: Sequence[float]) -> Mesh:
    """Make a `"box"`, `"sphere"`, `"capsule"` or `"cylinder"` of the size [m] that each takes."""
    if kind == "box":
        return box(size, colour)
    if kind == "sphere":
        return sphere(size[0], colour)
    make = capsule if kind == "capsule" else cylinder
    return make(size[0], size[1], colour)


def rod(start: ArrayLike, end: ArrayLike, radius: float, colour: Sequence[float]) -> Mesh:
    """Make a rod between two points; all in m."""
    return _along(start, end, [[0, 0], [radius, 0], [radius, 1], [0, 1]], colour)


def arrow(start: ArrayLike, end: ArrayLike, radius: float, colour: Sequence[float]) -> Mesh:
    """Make an arrow from one point to another; all in m. Its head is no longer than half of it."""
    length = float(np.linalg.norm(np.asarray(end, dtype=float) - np.asarray(start, dtype=float)))
    neck = max(0.5, 1.0 - 6 * radius / length)
    profile = [[0.0, 0.0], [radius, 0.0], [radius, neck], [2.6 * radius, neck], [0.0, 1.0]]
    return _along(start, end, profile, colour)


def _along(
    start: ArrayLike, end: ArrayLike, profile: Sequence[Sequence[float]], colour: Sequence[float]
) -> Mesh:
    foot = np.asarray(start, dtype=float)
    axis = np.asarray(end, dtype=float) - foot
    length = float(np.linalg.norm(axis))
    heights = [[radius, along * length] for radius, along in profile]
    return turned(heights, colour, 12).moved(frame_along(axis / length), foot)


def frame_along(axis: FloatArray) -> FloatArray:
    """Find a rotation matrix, shape (3, 3), whose z axis is a unit vector."""
    other = np.eye(3)[int(np.abs(axis).argmin())]
    x = np.cross(other, axis)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def triad(length: float, radius: float) -> Mesh:
    """Make the axes of a frame: x red, y green, z blue; length and radius [m]."""
    colours = ((0.85, 0.15, 0.15), (0.1, 0.62, 0.2), (0.12, 0.35, 0.9))
    axes = [rod(np.zeros(3), length * np.eye(3)[i], radius, (*colours[i], 1.0)) for i in range(3)]
    return merged(axes)


def tube(points: FloatArray, colours: FloatArray, radius: float, sides: int = 8) -> Mesh:
    """Sweep a circle along a line.

    Args:
        points: [m], shape (n, 3), n >= 2; no two that follow each other are the same.
        colours: Of each point, shape (n, 3).
        radius: [m].
        sides: Number of sides around.
    """
    step = normalised(np.diff(points, axis=0))
    along = normalised(np.concatenate([step[:1], step[1:] + step[:-1], step[-1:]]))
    across = np.empty_like(points)
    across[0] = frame_along(along[0])[:, 0]
    for i in range(1, len(points)):  # carried along without turning about the line
        carried = across[i - 1] - along[i] * (across[i - 1] @ along[i])
        length = float(np.linalg.norm(carried))
        across[i] = carried / length if length > 1e-6 else frame_along(along[i])[:, 0]
    up = np.cross(along, across)
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    normals = (
        np.cos(angle)[np.newaxis, :, np.newaxis] * across[:, np.newaxis]
        + np.sin(angle)[np.newaxis, :, np.newaxis] * up[:, np.newaxis]
    )
    vertices = points[:, np.newaxis] + radius * normals
    row, side = np.meshgrid(np.arange(len(points) - 1), np.arange(sides), indexing="ij")
    low, low_next = row * sides + side, row * sides + (side + 1) % sides
    faces = np.concatenate(
        [
            np.stack([low, low_next, low_next + sides], axis=-1).reshape(-1, 3),
            np.stack([low, low_next + sides, low + sides], axis=-1).reshape(-1, 3),
        ]
    )
    return Mesh(
        vertices.reshape(-1, 3), normals.reshape(-1, 3), faces, np.repeat(colours, sides, axis=0)
    )
