"""Intervals in which two colliding bodies violate their margin."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.robot.joint_tree import place_joints
from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.distances import are_nearer_than
from knotwork.waypoints import FloatArray

CONTACT_STEPS = 200
"""Number of time steps at which a colliding pair is tested for contacts."""
CONTACT_PRECISION = 1e-4
"""Precision of the ends of a contact [s]."""


def contact_intervals(
    model: CollisionModel, curve: PiecewisePolynomial, k: int, low: float, high: float, time: float
) -> tuple[tuple[float, float], ...]:
    """Contact intervals of a pair of bodies [s].

    Additional contacts shorter than the time steps may be missed.

    Args:
        model: Bodies and pairs.
        curve: Joint positions, trailing shape (d,).
        k: Index of the pair.
        low: Start of the time in which both exist [s].
        high: End of the time in which both exist [s].
        time: A time of contact [s].
    """
    pair = model.pairs[k]
    bodies = model.bodies[pair.first], model.bodies[pair.second]

    def violates(times: FloatArray) -> list[bool]:
        placed = zip(*place_joints(model.joints, curve(times)), strict=True)
        return [are_nearer_than(model.meter, *bodies, *joints, pair.margin) for joints in placed]

    def edge(low: float, high: float, *, before: bool) -> float:
        """Time between two times at which a contact begins or ends [s]."""
        while high - low > max(CONTACT_PRECISION, 4.0 * np.spacing(high)):
            middle = (low + high) / 2
            if violates(np.array([middle]))[0] == before:
                low = middle
            else:
                high = middle
        return high if before else low

    steps = np.linspace(low, high, CONTACT_STEPS + 1)
    i = int(np.searchsorted(steps, time))
    times, contact = np.insert(steps, i, time).tolist(), violates(steps)
    contact.insert(i, True)
    edges = [low] if contact[0] else []
    for (start, before), (end, after) in pairwise(zip(times, contact, strict=True)):
        if before != after:
            edges.append(edge(start, end, before=before))
    edges += [high] if contact[-1] else []
    return tuple(zip(edges[::2], edges[1::2], strict=True))
