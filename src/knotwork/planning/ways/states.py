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


def slow_down(curve: PiecewisePolynomial, factor: float) -> PiecewisePolynomial:
    """A cubic motion that begins at time 0, slowed down by a constant factor."""
    scale = factor ** -np.arange(3.0, -1.0, -1.0)
    return PiecewisePolynomial(curve.c * scale[:, None, None], factor * curve.x)


def concatenate(*motions: PiecewisePolynomial | None) -> PiecewisePolynomial:
    """Concatenate motions, each from time 0 on, without those that are `None`."""
    present = [part for part in motions if part is not None]
    starts = np.cumsum([0.0, *(part.x[-1] for part in present)])
    x = [start + part.x[:-1] for start, part in zip(starts[:-1], present, strict=True)]
    return PiecewisePolynomial(
        np.concatenate([part.c for part in present], axis=1),
        np.append(np.concatenate(x), starts[-1]),
    )


def reverse(curve: PiecewisePolynomial) -> PiecewisePolynomial:
    """A cubic motion that begins at time 0, reversed."""
    span = np.diff(curve.x)[:, None]
    a, b, c, d = curve.c
    turned = (-a, b + 3.0 * a * span, -c - (2.0 * b + 3.0 * a * span) * span)
    at_end = d + (c + (b + a * span) * span) * span
    return PiecewisePolynomial(np.stack((*turned, at_end))[:, ::-1], curve.x[-1] - curve.x[::-1])
