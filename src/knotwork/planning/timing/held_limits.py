"""Limits of efforts and tool speed in a program: at breaks, and inside pieces."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.planning.timing.efforts import effort_kernel, tool_kernel
from knotwork.planning.timing.nonlinear_program import Block
from knotwork.planning.timing.spline import Layout, Scale
from knotwork.planning.timing.tightening import Tightening
from knotwork.planning.timing.timing_problem import TimingProblem

KERNELS = {"effort": effort_kernel, "tool_speed": tool_kernel}


def held_blocks(
    problem: TimingProblem, tightening: Tightening, scale: Scale, layout: Layout
) -> Iterator[Block]:
    """Blocks of each limit at the places where it is a constraint.

    Args:
        problem: The problem.
        tightening: Allowed fraction of each limit.
        scale: Units of the program.
        layout: Its variables.
    """
    bound = 1.0 - tightening.margin
    for name, held in tightening.held.items():
        for k, columns in enumerate((layout.state, layout.piece)):
            active = held.active[k::2]
            inverse = 1.0 / (held.allowed[k::2][active] * getattr(problem.limits, name)).T
            units = np.repeat(scale.state[:, None], inverse.shape[1], axis=1)
            kernel = KERNELS[name](problem.arm, inside=bool(k))
            yield Block(kernel, columns[:, active], np.vstack((units, inverse)), -bound, bound)
