"""From when to when two bodies that collide are too near one another, each time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.distinct import distinct
from knotwork.polynomial import PiecewisePolynomial
from knotwork.scene.distances import nearer_than
from knotwork.scene.model import CollisionModel
from knotwork.scene.placements import place_joints

LOOKS = 200
"""Contacts of a pair that collides are looked for at so many steps of the time it is there."""

EDGE = 1e-4
"""The ends of a contact are found to this [s]."""


class ContactTimes:
    """Looks for the contacts of pairs of bodies over a motion."""

    def __init__(self, model: CollisionModel, curve: PiecewisePolynomial) -> None:
        self.model, self.curve = model, curve

    def of(self, k: int, low: float, high: float, time: float) -> tuple[tuple[float, float], ...]:
        """From when to when the bodies of a pair are too near, each time.

        A contact that is shorter than the steps between the looks may be missed beside that one
        whose time is known.

        Args:
            k: Which pair.
            low: When both are there first [s].
            high: When both are there last [s].
            time: When they are too near [s].
        """
        times = distinct(np.linspace(low, high, LOOKS + 1), [time])
        near = self._near(k, times.tolist())
        change = np.flatnonzero(np.diff(near))
        edges = [self._edge(k, *times[i : i + 2].tolist()) for i in change.tolist()]
        edges = [*([low] if near[0] else []), *edges, *([high] if near[-1] else [])]
        return tuple(zip(edges[::2], edges[1::2], strict=True))

    def _edge(self, k: int, low: float, high: float) -> float:
        """When the bodies come too near, or cease to be, between two times [s]."""
        (before,) = self._near(k, [low])
        while high - low > EDGE:
            middle = (low + high) / 2
            if self._near(k, [middle]) == [before]:
                low = middle
            else:
                high = middle
        return low if not before else high

    def _near(self, k: int, times: Sequence[float]) -> list[bool]:
        """Whether a pair of bodies is too near at some times."""
        pair, meter = self.model.pairs[k], self.model.meter
        bodies = self.model.bodies[pair.first], self.model.bodies[pair.second]
        placed = place_joints(self.model.joints, self.curve(np.array(times)))
        return [
            nearer_than(meter, *bodies, turn, shift, pair.margin)
            for turn, shift in zip(*placed, strict=True)
        ]
