"""Limits of efforts and of the tool's speed in a program: their blocks, parameters and bounds.

Each has one block for the breaks and one for the pieces, in the order of `PARTS`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.timing.dynamics import Dynamics
from knotwork.timing.efforts import EFFORT_PARTS, TOOL_PARTS, effort_kernel, tool_kernel
from knotwork.timing.problem import BoolArray, TimingLimits
from knotwork.timing.program import Block
from knotwork.timing.spline import Layout, Scale
from knotwork.timing.tightening import Tightening
from knotwork.waypoints import FloatArray

PARTS = {"effort": EFFORT_PARTS, "tool_speed": TOOL_PARTS}
"""Where in each piece the limits are held."""

KERNELS = {"effort": effort_kernel, "tool_speed": tool_kernel}


def held_blocks(at: Layout, dynamics: Dynamics, tightening: Tightening) -> list[Block]:
    """Blocks at the places where limits are held."""
    return [
        Block(KERNELS[name](dynamics, inside=inside), columns[:, places])
        for name in PARTS
        if name in tightening.held
        for inside, columns, (_, places) in zip(
            (False, True), (at.state, at.piece), _by_block(tightening, name), strict=True
        )
    ]


def held_parameters(
    tightening: Tightening, limits: TimingLimits, scale: Scale
) -> Iterator[FloatArray]:
    """Parameters of each block: units of the state, and inverse limits.

    Args:
        tightening: Part of each limit that is allowed.
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
    """Least and greatest values of the constraints of each block."""
    for name, parts in PARTS.items():
        if name in tightening.held:
            for times, (allowed, places) in zip(
                (1, len(parts)), _by_block(tightening, name), strict=True
            ):
                shape = times * allowed.shape[1], int(places.sum())
                most = np.full(shape, 1.0 - tightening.margin)
                yield -most, most


def _by_block(tightening: Tightening, name: str) -> list[tuple[FloatArray, BoolArray]]:
    """What is allowed at the breaks and in the pieces, and at which of them it is held."""
    allowed = tightening.held[name]
    places = tightening.places.get(name, np.ones(len(allowed), dtype=bool))
    return [(allowed[k::2], places[k::2]) for k in (0, 1)]
