"""Where two stretches of an orientation meet: both pass to the same rate there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.errors import PathError
from knotwork.tool_paths.rotations import logarithm
from knotwork.waypoints import FloatArray, read_only

TRANSITION = 0.25
"""Part of the shorter of two stretches in which both rates pass to that at the junction."""

SAME = 1e-12
"""Rotation vectors and rates that differ by less, relative to their size, are the same."""

EQUAL = 1e-9
"""Rates of two stretches that differ by less, relative to their size, need no transition."""

APART = 1e-6
"""Rotations of two stretches that meet may differ by this [rad]."""


class Stretch:
    """Arrays of an `OrientationCurve`, to be changed at its two ends."""

    def __init__(self, curve: Any) -> None:
        self.curve = curve
        self.s = np.array(curve.s)
        self.rotations = np.array(curve.rotations)
        self.rates, self.changes = np.array(curve.rates), np.array(curve.changes)
        self.breaks = np.array(curve.breaks)

    def divide(self, at_end: bool, length: float) -> float:
        """Insert a break where the transition to a junction ends, if its piece turns evenly.

        Args:
            at_end: Whether the junction is at the end.
            length: Of the transition [m].

        Returns:
            Length of the transition as it is: that of the whole piece if it was not divided [m].
        """
        curve, piece = self.curve, -1 if at_end else 0
        v, whole = curve._v[piece], float(curve._steps[piece])
        if np.abs(np.diff(v, axis=0)).max() > SAME * max(1.0, np.abs(v).max()) or whole <= length:
            return whole
        s = curve.length - length if at_end else length
        index = len(self.s) - 1 if at_end else 1
        at = np.array([s])
        self.s = np.insert(self.s, index, s)
        self.breaks = np.append(self.breaks, s)
        self.rotations = np.insert(self.rotations, index, curve.rotation(at), axis=0)
        for name, order in (("rates", 0), ("changes", 1)):
            value = np.repeat(curve.rate(at, order)[:, None], 2, axis=1)
            setattr(self, name, np.insert(getattr(self, name), index, value, axis=0))
        return length


def meet(before: Stretch, after: Stretch) -> None:
    """Give two stretches the same rate where they meet, and the same change of it."""
    scale = max(np.abs(part.curve.rates).max() for part in (before, after))
    a, b = before.rates[-1, 0], after.rates[0, 1]
    weight = 0.5
    if np.abs(a - b).max() > EQUAL * scale:
        shorter = TRANSITION * min(before.curve.length, after.curve.length)
        one, other = before.divide(True, shorter), after.divide(False, shorter)
        # a rate is left the less, the longer it takes: so the tool is turned off by as much
        weight = other / (one + other)
    before.rates[-1, :] = after.rates[0, :] = (1.0 - weight) * a + weight * b
    if not np.array_equal(before.changes[-1, 0], after.changes[0, 1]):
        before.changes[-1, :] = after.changes[0, :] = 0.0


def check_junction(i: int, before: Stretch, after: Stretch) -> None:
    """Check that stretch i ends with the rotation that the next one begins with.

    Raises:
        PathError: It doesn't.
    """
    angle = float(np.linalg.norm(logarithm(before.rotations[-1].T @ after.rotations[0])))
    if angle > APART:
        raise PathError(
            f"the tool is turned by {math.degrees(angle):.6g} deg between the end of "
            f"stretch {i} and the start of stretch {i + 1}; they must meet"
        )


def two_sided(values: ArrayLike, count: int, what: str) -> FloatArray:
    """Copy values before and after each break into shape (m, 2, 3)."""
    array = np.asarray(values, dtype=float)
    if array.ndim == 3:
        return read_only(array, (count, 2, 3), what)
    array = read_only(array, (count, 3), what)
    return np.repeat(array[:, None], 2, axis=1)
