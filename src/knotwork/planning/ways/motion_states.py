"""A motion as positions, velocities and accelerations at the breaks of its pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class States:
    """A motion by the states at its breaks.

    Attributes:
        span: Durations of the pieces [s], shape (n,).
        q, v, a: Positions, velocities, accelerations at the breaks, shape (n + 1, d) each.
        curve: The motion with these states, which a first guess only follows roughly.
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


def states_of(curve: PiecewisePolynomial) -> States:
    """The states at the breaks of a cubic motion that begins at time 0."""
    return States(np.diff(curve.x), curve(curve.x), curve(curve.x, 1), curve(curve.x, 2), curve)


def sample_states(
    curve: PiecewisePolynomial, times: FloatArray, pieces: int, max_acceleration: FloatArray
) -> States:
    """Sample the states of a few pieces that roughly follow a motion, as a first guess.

    The pieces with these states are not a continuous motion.
    """
    fractions = np.arange((len(times) - 1) * pieces + 1) / pieces
    t = np.interp(fractions, np.arange(len(times)), times)
    q = curve(t)
    v = np.gradient(q, t, axis=0)
    a = np.clip(np.gradient(v, t, axis=0), -0.5 * max_acceleration, 0.5 * max_acceleration)
    v[[0, -1]], a[[0, -1]] = curve(t[[0, -1]], 1), curve(t[[0, -1]], 2)
    return States(np.diff(t), q, v, a, curve)
