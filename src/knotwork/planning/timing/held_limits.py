"""Limits of efforts and tool speed in a program: blocks, parameters and bounds.

Each has one block for the breaks and one for the pieces, in the order of `PARTS`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from knotwork.planning.timing.efforts import EFFORT_PARTS, TOOL_PARTS, effort_kernel, tool_kernel
from knotwork.planning.timing.problem import BoolArray, TimingLimits
from knotwork.planning.timing.program import Block
from knotwork.planning.timing.spline import Form, Scale, layout
from knotwork.planning.timing.tightening import Tightening
from knotwork.waypoints import FloatArray

PARTS = {"effort": EFFORT_PARTS, "tool_speed": TOOL_PARTS}
"""Positions in each piece at which limits are constraints."""

KERNELS = {"effort": effort_kernel, "tool_speed": tool_kernel}


def held_blocks(form: Form, places: Mapping[str, BoolArray]) -> list[Block]:
    """Blocks at the places where limits are constraints, by default everywhere."""
    at, found = layout(form), []
    for name in form.held:
        for k, columns in enumerate((at.state, at.piece)):
            own = columns[:, places[name][k::2]] if name in places else columns
            found.append(Block(KERNELS[name](form.dynamics, inside=bool(k)), own))
    return found


def held_parameters(
    tightening: Tightening, limits: TimingLimits, scale: Scale
) -> Iterator[FloatArray]:
    """Parameters of each block: units of the state, and inverse limits.

    Args:
        tightening: Allowed fraction of each limit.
        limits: The limits.
        scale: Units of the program.
    """
    units = np.concatenate([scale.unit(order) for order in range(3)])[:, None]
    for name in PARTS:
        if name in tightening.held:
            for allowed, places in _by_block(tightening, name):
                inverse = 1.0 / (allowed[places] * getattr(limits, name)).T
                yield np.vstack((np.repeat(units, inverse.shape[1], axis=1), inverse))


def held_bounds(tightening: Tightening) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Lower and upper bounds of the constraints of each block."""
    for name, parts in PARTS.items():
        if name in tightening.held:
            for times, (allowed, places) in zip(
                (1, len(parts)), _by_block(tightening, name), strict=True
            ):
                shape = times * allowed.shape[1], int(places.sum())
                most = np.full(shape, 1.0 - tightening.margin)
                yield -most, most


def _by_block(tightening: Tightening, name: str) -> list[tuple[FloatArray, BoolArray]]:
    """Allowed values at the breaks and in the pieces, and whether each one is a constraint."""
    allowed = tightening.held[name]
    places = tightening.places.get(name, np.ones(len(allowed), dtype=bool))
    return [(allowed[k::2], places[k::2]) for k in (0, 1)]
