"""Joining of orientations along consecutive stretches: equal rates at their junctions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from knotwork.curves.tool_paths.rotations import rotation_vector
from knotwork.errors import PathError
from knotwork.waypoints import FloatArray

TRANSITION_SHARE = 0.25
"""Length of a transition, relative to the shorter of the two stretches."""
RATE_TOLERANCE = 1e-12
"""Relative difference below which rotation vectors and rates are equal."""
EQUAL_RATES = 1e-9
"""Relative difference of the rates of two stretches below which no transition is needed."""
JUNCTION_ANGLE = 1e-6
"""Tolerance of the difference of rotations at a junction [rad]."""


def join_arrays(stretches: Sequence[Any], stops: Collection[int]) -> list[FloatArray]:
    """Join the arrays of several orientation curves, for `OrientationCurve.joined`."""
    parts = [OrientationStretch(stretch) for stretch in stretches]
    for i, (before, after) in enumerate(itertools.pairwise(parts)):
        check_junction(i, before, after)
        if i not in stops:
            match_rates(before, after)
    start = 0.0
    arrays: list[list[FloatArray]] = [[], [], [], [], []]
    for i, part in enumerate(parts):
        last = i + 1 == len(parts)
        ends = (part.rates[-1, 0], part.changes[-1, 0])
        if not last:  # a junction belongs to the stretch that begins there
            parts[i + 1].rates[0, 0], parts[i + 1].changes[0, 0] = ends
        breaks = start + np.sort(part.breaks)
        values = (start + part.s, part.rotations, part.rates, part.changes, breaks)
        for array, value in zip(arrays, values, strict=True):
            array.append(value if last else value[:-1])
        start += float(part.s[-1])
    return [np.concatenate(array) for array in arrays]


class OrientationStretch:
    """Arrays of an `OrientationCurve`, to be modified at its two ends."""

    def __init__(self, curve: Any) -> None:
        self.curve = curve
        self.s = np.array(curve.s)
        self.rotations = np.array(curve.rotations)
        self.rates, self.changes = np.array(curve.rates), np.array(curve.changes)
        self.breaks = np.array(curve.breaks)

    def divide(self, at_end: bool, length: float) -> float:
        """Insert a break at the end of the transition to a junction, if its piece turns uniformly.

        Args:
            at_end: Whether the junction is at the end.
            length: Length of the transition [m].

        Returns:
            Actual length of the transition: that of the whole piece if it was not divided [m].
        """
        curve, piece = self.curve, -1 if at_end else 0
        v, step = curve._v[piece], float(curve._steps[piece])
        if (
            np.abs(np.diff(v, axis=0)).max() > RATE_TOLERANCE * max(1.0, np.abs(v).max())
            or step <= length
        ):
            return step
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


def match_rates(before: OrientationStretch, after: OrientationStretch) -> None:
    """Give two stretches the same rate and derivative at their junction."""
    scale = max(np.abs(part.curve.rates).max() for part in (before, after))
    a, b = before.rates[-1, 0], after.rates[0, 1]
    weight = 0.5
    if np.abs(a - b).max() > EQUAL_RATES * scale:
        shorter = TRANSITION_SHARE * min(before.curve.length, after.curve.length)
        length_before, length_after = before.divide(True, shorter), after.divide(False, shorter)
        # weights are the transition lengths, so that both sides deviate by the same angle
        weight = length_after / (length_before + length_after)
    before.rates[-1, :] = after.rates[0, :] = (1.0 - weight) * a + weight * b
    if not np.array_equal(before.changes[-1, 0], after.changes[0, 1]):
        before.changes[-1, :] = after.changes[0, :] = 0.0


def check_junction(i: int, before: OrientationStretch, after: OrientationStretch) -> None:
    """Check that stretch i ends with the first rotation of the next one.

    Raises:
        PathError: The rotations differ.
    """
    angle = float(np.linalg.norm(rotation_vector(before.rotations[-1].T @ after.rotations[0])))
    if angle > JUNCTION_ANGLE:
        raise PathError(
            f"the tool is turned by {math.degrees(angle):.6g} deg between the end of "
            f"stretch {i + 1} and the start of stretch {i + 2}; both must be the same"
        )
