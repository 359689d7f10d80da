"""A motion by the states at its breaks, and separating planes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray


class Plane(NamedTuple):
    """A linear constraint at one point of the motion: normal · q >= offset.

    Attributes:
        piece: Index of the piece.
        place: Position in the piece, 0 to 1.
        normal: Normal in joint space [1/rad or 1/m], shape (d,).
        offset: Dimensionless offset, of order one.
    """

    piece: int
    place: float
    normal: FloatArray
    offset: float


@dataclass(frozen=True, eq=False)
class States:
    """A motion by its pieces.

    Attributes:
        span: Durations of the pieces [s], shape (n,).
        q, v, a: Positions, velocities, accelerations at the breaks, shape (n + 1, d) each.
        curve: The motion of these states; for a first guess only approximately.
    """

    span: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    curve: PiecewisePolynomial

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.span.sum())

    def position_at(self, piece: int, place: float) -> FloatArray:
        """Joint positions at a position in a piece, 0 to 1."""
        time = float(self.span[:piece].sum()) + place * float(self.span[piece])
        return np.asarray(self.curve(min(time, float(self.curve.x[-1]))))

    def place_of(self, time: float) -> tuple[int, float]:
        """Piece that contains a time, and the position in it, 0 to 1."""
        x = self.curve.x
        piece = min(max(int(np.searchsorted(x, time, side="right")) - 1, 0), len(x) - 2)
        return piece, float((time - x[piece]) / self.span[piece])


def states_of(curve: PiecewisePolynomial) -> States:
    """The states at the breaks of a cubic motion that begins at time 0."""
    last = np.minimum(curve.x, curve.x[-1])
    return States(np.diff(curve.x), curve(last), curve(last, 1), curve(last, 2), curve)
