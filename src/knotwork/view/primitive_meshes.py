"""Primitive shapes of scenes, as meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.robot.joint_tree import frame_along
from knotwork.view.mesh import Mesh, from_triangles, merge_meshes, normalise_rows


def solid(kind: str, size: Sequence[float], colour: Sequence[float], sides: int = 32) -> Mesh:
    """Make a shape about the origin, along z.

    Args:
        kind: `"box"`, `"sphere"`, `"capsule"`, `"cylinder"` or `"cone"`.
        size: The three sides of a box; else the radius and, except for a sphere, the length [m],
            for a capsule without its ends.
        colour: Red, green, blue and opacity.
        sides: Number of sides around the axis.
    """
    from trimesh import creation

    # of radius 1, since trimesh leaves out triangles with sides below 10 nm
    radius, length = size[0], size[-1] / size[0]
    if kind == "box":
        return from_triangles(creation.box(extents=size).triangles, colour)
    if kind == "sphere":
        shape = creation.uv_sphere(radius=1.0, count=[sides // 2, sides // 2])
    elif kind == "capsule":
        shape = creation.capsule(radius=1.0, height=length, count=[sides, sides // 2])
    elif kind == "cylinder":
        shape = creation.cylinder(radius=1.0, height=length, sections=sides)
    else:
        shape = creation.cone(radius=1.0, height=length, sections=sides)
        shape.apply_translation([0.0, 0.0, -length / 2])
    return from_triangles(radius * shape.triangles, colour)


def sphere(radius: float, colour: Sequence[float], sides: int = 24) -> Mesh:
    """Make a sphere about the origin; radius [m]."""
    return solid("sphere", [radius], colour, sides)


def rod(start: ArrayLike, end: ArrayLike, radius: float, colour: Sequence[float]) -> Mesh:
    """Make a rod between two points; all in m."""
    return _revolve_along(start, end, [[0, 0], [radius, 0], [radius, 1], [0, 1]], colour)


def arrow(start: ArrayLike, end: ArrayLike, radius: float, colour: Sequence[float]) -> Mesh:
    """Make an arrow from one point to another; all in m. Its head is at most half of its length."""
    length = float(np.linalg.norm(np.asarray(end, dtype=float) - np.asarray(start, dtype=float)))
    neck = max(0.5, 1.0 - 6 * radius / length)
    profile = [[0.0, 0.0], [radius, 0.0], [radius, neck], [2.6 * radius, neck], [0.0, 1.0]]
    return _revolve_along(start, end, profile, colour)


def _revolve_along(
    start: ArrayLike, end: ArrayLike, profile: Sequence[Sequence[float]], colour: Sequence[float]
) -> Mesh:
    """Revolve a profile about a line; its points are radius [m] and fraction of the length."""
    from trimesh import creation

    foot = np.asarray(start, dtype=float)
    axis = np.asarray(end, dtype=float) - foot
    length = float(np.linalg.norm(axis))
    heights = [[radius, along * length] for radius, along in profile]
    shape = from_triangles(creation.revolve(heights, sections=12).triangles, colour)
    return shape.move(frame_along(axis / length), foot)


def triad(length: float, radius: float) -> Mesh:
    """Make the axes of a frame: x red, y green, z blue; length and radius [m]."""
    colours = ((0.85, 0.15, 0.15), (0.1, 0.62, 0.2), (0.12, 0.35, 0.9))
    axes = [rod(np.zeros(3), length * np.eye(3)[i], radius, (*colours[i], 1.0)) for i in range(3)]
    return merge_meshes(axes)


def tube(points: FloatArray, colours: FloatArray, radius: float, sides: int = 8) -> Mesh:
    """Sweep a circle along a line.

    Args:
        points: Points [m], shape (n, 3), n >= 2; consecutive ones differ.
        colours: Colour of each point, shape (n, 3).
        radius: Radius [m].
        sides: Number of sides around.
    """
    step = normalise_rows(np.diff(points, axis=0))
    along = normalise_rows(np.concatenate([step[:1], step[1:] + step[:-1], step[-1:]]))
    across = np.empty_like(points)
    across[0] = frame_along(along[0])[:, 0]
    for i in range(1, len(points)):  # transported without twist about the line
        carried = across[i - 1] - along[i] * (across[i - 1] @ along[i])
        length = float(np.linalg.norm(carried))
        across[i] = carried / length if length > 1e-6 else frame_along(along[i])[:, 0]
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)[:, np.newaxis, np.newaxis]
    around = np.cos(angle) * across + np.sin(angle) * np.cross(along, across)
    normals = around.swapaxes(0, 1).reshape(-1, 3)
    ring = np.arange(len(normals)).reshape(-1, sides)
    next_ring = np.roll(ring, -1, axis=1)
    quads = np.stack([ring[:-1], next_ring[:-1], next_ring[1:], ring[1:]], axis=-1).reshape(-1, 4)
    return Mesh(
        np.repeat(points, sides, axis=0) + radius * normals,
        normals,
        np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]),
        np.repeat(colours, sides, axis=0),
    )
