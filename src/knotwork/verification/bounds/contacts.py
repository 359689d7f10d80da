"""From when to when two bodies that collide are too near one another, each time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TypeAlias

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot.joint_tree import place_joints
from knotwork.scene.distances import nearer_than
from knotwork.scene.model import CollisionModel
from knotwork.waypoints import FloatArray

Placed: TypeAlias = tuple[FloatArray, FloatArray]
"""Rotations and origins of all joints at some times."""

LOOKS = 200
"""Number of steps at which a pair that collides is searched for contacts."""

EDGE = 1e-4
"""The ends of a contact are found to this [s]."""


class ContactTimes:
    """Looks for the contacts of pairs of bodies over a motion."""

    def __init__(self, model: CollisionModel, curve: PiecewisePolynomial) -> None:
        self.model, self.curve = model, curve
        self._looks = cache(self._looks_between)

    def _looks_between(self, low: float, high: float) -> tuple[FloatArray, Placed]:
        """Times to look at between two, and where all joints are then."""
        times = np.linspace(low, high, LOOKS + 1)
        return times, place_joints(self.model.joints, self.curve(times))

    def of(self, k: int, low: float, high: float, time: float) -> tuple[tuple[float, float], ...]:
        """From when to when the bodies of a pair are too near, each time.

        A contact that is shorter than the steps between the looks may be missed next to that one
        whose time is known.

        Args:
            k: Which pair.
            low: When both are there first [s].
            high: When both are there last [s].
            time: When they are too near [s].
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
        """When the bodies come too near, or cease to be, between two times [s]."""
        (before,) = self._near(k, [low])
        while high - low > max(EDGE, 4.0 * np.spacing(high)):
            middle = (low + high) / 2
            if self._near(k, [middle]) == [before]:
                low = middle
            else:
                high = middle
        return low if not before else high

    def _near(self, k: int, times: Sequence[float]) -> list[bool]:
        """Whether a pair of bodies is too near at some times."""
        return self._near_where(k, place_joints(self.model.joints, self.curve(np.array(times))))

    def _near_where(self, k: int, placed: Placed) -> list[bool]:
        """Whether a pair of bodies is too near where joints are placed."""
        pair, meter = self.model.pairs[k], self.model.meter
        bodies = self.model.bodies[pair.first], self.model.bodies[pair.second]
        return [
            nearer_than(meter, *bodies, turn, shift, pair.margin)
            for turn, shift in zip(*placed, strict=True)
        ]
