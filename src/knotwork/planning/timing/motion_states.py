"""A motion as positions, velocities and accelerations at the breaks of its pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial


@dataclass(frozen=True, eq=False)
class States:
    """A motion by the states at its breaks.

    Attributes:
        span: Durations between the breaks [s], shape (n,).
        q, v, a: Positions, velocities, accelerations at the breaks, shape (n + 1, d) each.
        curve: The motion with these states. It may have other pieces.
    """

    span: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    curve: PiecewisePolynomial

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return float(self.span.sum())

    def position_at(self, piece: int, fraction: float) -> FloatArray:
        """Joint positions after a fraction of the duration of a piece, 0 to 1."""
        time = float(self.span[:piece].sum()) + fraction * float(self.span[piece])
        return np.asarray(self.curve(min(time, float(self.curve.x[-1]))))

    def piece_at(self, time: float) -> tuple[int, float]:
        """Piece that contains a time, and the fraction of its duration until then, 0 to 1."""
        x = self.curve.x
        piece = min(max(int(np.searchsorted(x, time, side="right")) - 1, 0), len(x) - 2)
        return piece, float((time - x[piece]) / self.span[piece])


def states_of(curve: PiecewisePolynomial, span: FloatArray | None = None) -> States:
    """The states of a motion that begins at time 0.

    Args:
        curve: The motion.
        span: Durations between the breaks of the states [s], shape (n,); by default those of the
            curve.
    """
    breaks = curve.x
    if span is None:
        span = np.diff(breaks)
    else:
        breaks = np.minimum(np.append(0.0, np.cumsum(span)), breaks[-1])
    return States(span, curve(breaks), curve(breaks, 1), curve(breaks, 2), curve)
