"""What a log can't tell for other reasons than its noise: it is too coarse in value or in time.

A value that is rounded to r and stays the same for a time τ may be off by r/2 all that time. What
has such an error, back and forth within τ, has an error of `SHAPES` · r/2 / τᵏ in its derivative of
order k. The same holds for what the curve leaves of samples that change faster than they are taken,
with τ the time between two samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.recording.reading import Recording
from knotwork.waypoints import FloatArray

SHAPES = (1.0, 2.0, 8.0, 48.0)
"""Largest derivatives of order 0 to 3 of a bump of height and length 1, roughly."""
CONSTANT = 2.5
"""A value that stays the same for more sample periods than this is held by its rounding."""


def of_rounding(log: Recording, grid: FloatArray) -> FloatArray:
    """What rounding makes unknown where values stay the same, as standard errors, (4, g, d).

    The largest error counts as two standard errors.
    """
    errors = np.zeros((len(SHAPES), grid.size, log.position.shape[1]))
    for j, q in enumerate(log.position.T):
        changes = np.concatenate((log.time[:1], log.time[1:][np.diff(q) != 0.0], log.time[-1:]))
        stays = np.diff(changes)[np.clip(np.searchsorted(changes, grid) - 1, 0, changes.size - 2)]
        held = stays > CONSTANT * log.period
        for order, shape in enumerate(SHAPES):
            size = 0.25 * log.resolution[j] * shape / (0.5 * stays[held]) ** order
            errors[order, held, j] = size
    return errors


def of_pieces(curve: PiecewisePolynomial, grid: FloatArray) -> FloatArray:
    """What cubics make unknown where the jerk of the motion jumps between their ends, (4, g, d).

    A jump of the jerk by J within a piece of length h changes acceleration, velocity and position
    by some J h/4, J h²/32 and J h³/384; J is taken from the jumps of the curve next to it.
    """
    jumps = np.abs(curve.jumps(3))
    jumps = np.concatenate((jumps[:1], jumps, jumps[-1:])) if len(jumps) else np.zeros((2, 1))
    length = np.diff(curve.x)
    piece = np.clip(np.searchsorted(curve.x, grid, side="right") - 1, 0, length.size - 1)
    most = np.maximum(jumps[piece], jumps[piece + 1])
    h = length[piece][:, None]
    return 0.5 * np.stack((most * h**3 / 384.0, most * h**2 / 32.0, most * h / 4.0, most))


def of_missed(
    log: Recording, residuals: FloatArray, spans: Sequence[tuple[float, float]], grid: FloatArray
) -> FloatArray:
    """What the log does not show where it changes too fast for its samples, (4, g, d)."""
    errors = np.zeros((len(SHAPES), grid.size, residuals.shape[1]))
    for start, end in spans:
        margin = end - start
        inside = (log.time >= start) & (log.time <= end)
        near = (grid >= start - margin) & (grid <= end + margin)
        most = np.abs(residuals[inside]).max(axis=0)
        for order, shape in enumerate(SHAPES):
            size = most * shape / log.period**order
            errors[order, near] = np.maximum(errors[order, near], size)
    return errors
