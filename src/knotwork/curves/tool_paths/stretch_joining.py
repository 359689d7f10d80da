"""Joining of orientations along consecutive stretches: equal rates at their junctions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths.rotations import rotation_vector
from knotwork.errors import PathError

TRANSITION_SHARE = 0.25
"""Length of a transition, relative to the shorter of the two stretches."""
RATE_TOLERANCE = 1e-12
"""Relative difference below which rotation vectors and rates are equal."""
EQUAL_RATES = 1e-9
"""Relative difference of the rates of two stretches below which no transition is needed."""
JUNCTION_ANGLE = 1e-6
"""Tolerance of the difference of rotations at a junction [rad]."""


def join_arrays(stretches: Sequence[Any], stops: Collection[int]) -> tuple[FloatArray, ...]:
    """Join the arrays of several orientation curves, for `OrientationCurve.joined`."""
    curves = list(stretches)
    for i, (before, after) in enumerate(itertools.pairwise(stretches)):
        _check_junction(i, before, after)
        if i not in stops and _rates_differ(before, after):
            length = TRANSITION_SHARE * min(before.length, after.length)
            curves[i] = curves[i].divided(length, at_end=True)
            curves[i + 1] = curves[i + 1].divided(length)
    rates = [np.array(curve.rates) for curve in curves]
    changes = [np.array(curve.changes) for curve in curves]
    for i, (before, after) in enumerate(itertools.pairwise(curves)):
        if i not in stops:
            # weights are the transition lengths, so that both sides deviate by the same angle
            lengths = before.length - before.s[-2], after.s[1]
            weight = lengths[1] / sum(lengths) if _rates_differ(before, after) else 0.5
            mean = (1.0 - weight) * before.rates[-1, 0] + weight * after.rates[0, 1]
            rates[i][-1] = rates[i + 1][0] = mean
            if not np.array_equal(before.changes[-1, 0], after.changes[0, 1]):
                changes[i][-1] = changes[i + 1][0] = 0.0
        # a junction belongs to the stretch that begins there
        rates[i + 1][0, 0] = rates[i][-1, 0]
        changes[i + 1][0, 0] = changes[i][-1, 0]
    starts = np.cumsum([0.0, *(curve.length for curve in curves[:-1])])
    columns = (
        [start + curve.s for start, curve in zip(starts, curves, strict=True)],
        [curve.rotations for curve in curves],
        rates,
        changes,
        [start + curve.breaks for start, curve in zip(starts, curves, strict=True)],
    )
    return tuple(
        np.concatenate([*(array[:-1] for array in arrays[:-1]), arrays[-1]]) for arrays in columns
    )


def _rates_differ(before: Any, after: Any) -> bool:
    """Whether the rates of two stretches differ at their junction."""
    scale = max(np.abs(curve.rates).max() for curve in (before, after))
    return bool(np.abs(before.rates[-1, 0] - after.rates[0, 1]).max() > EQUAL_RATES * scale)


def _check_junction(i: int, before: Any, after: Any) -> None:
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
