"""Limits of efforts and of the tool's speed in a program: their blocks, parameters and bounds.

Each has one block for the breaks and one for the pieces, in the order of `PARTS`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from knotwork.timing.efforts import EFFORT_PARTS, TOOL_PARTS
from knotwork.timing.problem import TimingLimits
from knotwork.timing.spline import Scale
from knotwork.waypoints import FloatArray

PARTS = {"effort": EFFORT_PARTS, "tool_speed": TOOL_PARTS}
"""Where in each piece the limits are held."""


def held_parameters(
    held: Mapping[str, FloatArray], limits: TimingLimits, scale: Scale
) -> Iterator[FloatArray]:
    """Parameters of each block: units of the state, and inverse limits.

    Args:
        held: Part of each limit that is allowed, as of a `Tightening`.
        limits: The limits.
        scale: Units of the program.
    """
    units = np.concatenate([scale.unit(order) for order in range(3)])[:, None]
    for name in PARTS:
        if name in held:
            inverse = 1.0 / (held[name] * getattr(limits, name)).T
            for part in (inverse[:, ::2], inverse[:, 1::2]):
                yield np.vstack((np.repeat(units, part.shape[1], axis=1), part))


def held_bounds(
    held: Mapping[str, FloatArray], margin: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Least and greatest values of the constraints of each block.

    Args:
        held: Part of each limit that is allowed.
        margin: Part of it that is left for the solver.
    """
    for name, parts in PARTS.items():
        if name in held:
            breaks, pieces = held[name][::2], held[name][1::2]
            for times, one in ((1, breaks), (len(parts), pieces)):
                most = np.full((times * one.shape[1], len(one)), 1.0 - margin)
                yield -most, most
