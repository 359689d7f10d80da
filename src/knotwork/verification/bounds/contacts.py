"""Intervals in which two bodies are nearer than their required clearance."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.robot.joint_tree import place_joints
from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.distances import are_nearer_than

CONTACT_STEPS = 200
"""Number of intervals at whose ends a colliding pair is tested for contacts."""
CONTACT_PRECISION = 1e-4
"""Precision of the ends of a contact [s]."""


def contact_intervals(
    model: CollisionModel, curve: PiecewisePolynomial, k: int, low: float, high: float, time: float
) -> tuple[tuple[float, float], ...]:
    """Find the intervals in which two bodies are nearer than their required clearance [s].

    Contacts shorter than a time step may be missed, except the one at `time`.

    Args:
        model: Bodies and pairs.
        curve: Joint positions, trailing shape (d,).
        k: Index of the pair.
        low: Start of the time in which both bodies exist [s].
        high: End of that time [s].
        time: A time of contact [s].
    """
    steps = np.linspace(low, high, CONTACT_STEPS + 1)
    i = int(np.searchsorted(steps, time))
    steps = np.insert(steps, i, time)
    contact = _is_too_near(model, curve, k, steps)
    contact[i] = True
    edges = [low] if contact[0] else []
    for before in np.flatnonzero(np.diff(contact)).tolist():
        apart, touching = (before + 1, before) if contact[before] else (before, before + 1)
        edges.append(_contact_end(model, curve, k, steps[apart], steps[touching]))
    edges += [high] if contact[-1] else []
    return tuple(zip(edges[::2], edges[1::2], strict=True))


def _contact_end(
    model: CollisionModel, curve: PiecewisePolynomial, k: int, apart: float, touching: float
) -> float:
    """Find the last contact-free time [s] on the way from such a time to one of contact."""
    while abs(touching - apart) > max(CONTACT_PRECISION, 4.0 * np.spacing(max(apart, touching))):
        middle = (apart + touching) / 2
        if _is_too_near(model, curve, k, np.array([middle]))[0]:
            touching = middle
        else:
            apart = middle
    return float(apart)


def _is_too_near(
    model: CollisionModel, curve: PiecewisePolynomial, k: int, times: FloatArray
) -> list[bool]:
    """Whether two bodies are nearer than their required clearance, at each time."""
    pair = model.pairs[k]
    bodies = model.bodies[pair.first], model.bodies[pair.second]
    placed = zip(*place_joints(model.tree, curve(times)), strict=True)
    return [are_nearer_than(*bodies, *joints, pair.required_clearance) for joints in placed]
