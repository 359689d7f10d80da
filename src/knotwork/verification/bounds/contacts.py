"""Intervals in which two colliding bodies violate their margin."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TypeAlias

import numpy as np

from knotwork.robot.joint_tree import place_joints
from knotwork.scene.collision_model import CollisionModel
from knotwork.scene.distances import nearer_than
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray

Placed: TypeAlias = tuple[FloatArray, FloatArray]
"""Rotations and origins of all joints at some times."""

LOOKS = 200
"""Number of time steps at which a colliding pair is tested for contacts."""

EDGE = 1e-4
"""Precision of the ends of a contact [s]."""


class ContactTimes:
    """Search for the contacts of pairs of bodies over a motion."""

    def __init__(self, model: CollisionModel, curve: PiecewisePolynomial) -> None:
        self.model, self.curve = model, curve
        self._looks = cache(self._looks_between)

    def _looks_between(self, low: float, high: float) -> tuple[FloatArray, Placed]:
        """Test times between two times, and the placements of all joints."""
        times = np.linspace(low, high, LOOKS + 1)
        return times, place_joints(self.model.joints, self.curve(times))

    def of(self, k: int, low: float, high: float, time: float) -> tuple[tuple[float, float], ...]:
        """Contact intervals of a pair of bodies [s].

        Additional contacts shorter than the time steps may be missed.

        Args:
            k: Index of the pair.
            low: First time at which both exist [s].
            high: Last time at which both exist [s].
            time: A time of contact [s].
        """
        looks, placed = self._looks(low, high)
        i = int(np.searchsorted(looks, time))
        times = np.insert(looks, i, time)
        near = np.insert(self._near_where(k, placed), i, True)
        change = np.flatnonzero(np.diff(near))
        edges = [self._edge(k, *times[i : i + 2].tolist()) for i in change.tolist()]
        edges = [*([low] if near[0] else []), *edges, *([high] if near[-1] else [])]
        return tuple(zip(edges[::2], edges[1::2], strict=True))

    def _edge(self, k: int, low: float, high: float) -> float:
        """Time between two times at which a contact begins or ends [s]."""
        (before,) = self._near(k, [low])
        while high - low > max(EDGE, 4.0 * np.spacing(high)):
            middle = (low + high) / 2
            if self._near(k, [middle]) == [before]:
                low = middle
            else:
                high = middle
        return low if not before else high

    def _near(self, k: int, times: Sequence[float]) -> list[bool]:
        """Whether a pair of bodies violates its margin at some times."""
        return self._near_where(k, place_joints(self.model.joints, self.curve(np.array(times))))

    def _near_where(self, k: int, placed: Placed) -> list[bool]:
        """Whether a pair of bodies violates its margin at joint placements."""
        pair, meter = self.model.pairs[k], self.model.meter
        bodies = self.model.bodies[pair.first], self.model.bodies[pair.second]
        return [
            nearer_than(meter, *bodies, turn, shift, pair.margin)
            for turn, shift in zip(*placed, strict=True)
        ]
