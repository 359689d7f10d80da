"""The way out of a collision: to which side a body would have to go, and how far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.scene.bodies import Body
from knotwork.scene.distances import nearer_than
from knotwork.scene.model import CollisionModel
from knotwork.waypoints import FloatArray

DIRECTIONS = 8
"""Directions square to the motion that are tried, beside that of the deepest point."""

FARTHEST = 2.0
"""No way out is farther than this [m]."""

STEPS = 20
"""Halvings of the way out: it is found to a few micrometres."""


@dataclass(frozen=True, eq=False)
class WayOut:
    """A shift that takes a body out of a collision.

    Attributes:
        direction: Unit vector in the axes of the URDF's root, shape (3,).
        distance: How far at least [m].
    """

    direction: FloatArray
    distance: float


def way_out(
    model: CollisionModel,
    body: Body,
    around: Body,
    margin: float,
    rotation: FloatArray,
    origin: FloatArray,
    along: FloatArray,
) -> WayOut | None:
    """Find the shortest shift, square to a motion, that takes a body out of a collision.

    It is a side where the body is clear of everything else that stands around as well.

    Args:
        model: Bodies and pairs.
        body: The one that moves.
        around: The one that stands around.
        margin: Clearance to keep [m].
        rotation: Of all joints, shape (n + 1, 3, 3).
        origin: Of all joints [m], shape (n + 1, 3).
        along: Direction in which the body moves, shape (3,); zero if it stands still.
    """
    others = [one for one in model.bodies if one.kind == "object" and one is not around]

    def clear(shift: FloatArray, obstacle: Body) -> bool:
        moved = origin.copy()
        moved[body.joint] += shift
        return not nearer_than(model.meter, body, obstacle, rotation, moved, margin)

    best: WayOut | None = None
    others = [one for one in others if clear(np.zeros(3), one)]
    for direction in _directions(along):
        far = best.distance if best is not None else FARTHEST
        if not clear(far * direction, around):
            continue
        near = 0.0
        for _ in range(STEPS):
            middle = (near + far) / 2
            if clear(middle * direction, around):
                far = middle
            else:
                near = middle
        if all(clear(far * direction, one) for one in others):
            best = WayOut(direction, far)
    return best


def _directions(along: FloatArray) -> list[FloatArray]:
    """Directions square to another, upwards the first; if there is none, along the axes."""
    up = np.array([0.0, 0.0, 1.0])
    size = float(np.linalg.norm(along))
    if size < 1e-9:
        return [up, *(sign * axis for axis in np.eye(3) for sign in (1.0, -1.0))]
    ahead = along / size
    first = up - (up @ ahead) * ahead
    if np.linalg.norm(first) < 1e-3:
        first = np.cross(ahead, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    other = np.cross(ahead, first)
    turns = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return [np.cos(turn) * first + np.sin(turn) * other for turn in turns]
