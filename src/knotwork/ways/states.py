"""A motion by the states at its breaks, and the planes that it stays beyond."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray


class Row(NamedTuple):
    """A plane that the motion stays beyond at one place: normal · q >= offset.

    Attributes:
        piece: Index of the piece.
        place: Where in it, from 0 to 1.
        normal: By joint position [1/rad or 1/m], shape (d,).
        offset: A number near one or less, without a unit.
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
        curve: The motion that they are of; a first guess follows it only roughly.
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

    def at(self, piece: int, place: float) -> FloatArray:
        """Joint positions at a place of a piece, from 0 to 1."""
        time = float(self.span[:piece].sum()) + place * float(self.span[piece])
        return np.asarray(self.curve(min(time, float(self.curve.x[-1]))))

    def place_of(self, time: float) -> tuple[int, float]:
        """In which piece a time is, and where in it, from 0 to 1."""
        x = self.curve.x
        piece = min(max(int(np.searchsorted(x, time, side="right")) - 1, 0), len(x) - 2)
        return piece, float((time - x[piece]) / self.span[piece])


def states_of(curve: PiecewisePolynomial) -> States:
    """The states at the breaks of a cubic motion that begins at time 0."""
    last = np.minimum(curve.x, curve.x[-1])
    return States(np.diff(curve.x), curve(last), curve(last, 1), curve(last, 2), curve)


def slowed(curve: PiecewisePolynomial, factor: float) -> PiecewisePolynomial:
    """A cubic motion that begins at time 0, all along slower by a factor."""
    scale = factor ** -np.arange(3.0, -1.0, -1.0)
    return PiecewisePolynomial(curve.c * scale[:, None, None], factor * curve.x)


def followed(*motions: PiecewisePolynomial | None) -> PiecewisePolynomial:
    """Those motions that are there, one after the other, each from time 0 on."""
    there = [one for one in motions if one is not None]
    starts = np.cumsum([0.0, *(one.x[-1] for one in there)])
    x = [start + one.x[:-1] for start, one in zip(starts[:-1], there, strict=True)]
    return PiecewisePolynomial(
        np.concatenate([one.c for one in there], axis=1), np.append(np.concatenate(x), starts[-1])
    )


def backwards(curve: PiecewisePolynomial) -> PiecewisePolynomial:
    """A cubic motion that begins at time 0, from its end to its start."""
    span = np.diff(curve.x)[:, None]
    a, b, c, d = curve.c
    turned = (-a, b + 3.0 * a * span, -c - (2.0 * b + 3.0 * a * span) * span)
    at_end = d + (c + (b + a * span) * span) * span
    return PiecewisePolynomial(np.stack((*turned, at_end))[:, ::-1], curve.x[-1] - curve.x[::-1])
