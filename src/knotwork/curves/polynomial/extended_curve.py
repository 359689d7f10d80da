"""`ExtendedCurve`: a curve extended before its start and after its end; stacking of curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.polynomial.piecewise import PiecewisePolynomial
from knotwork.curves.polynomial.splitting import cut_curve, split_at


@dataclass(frozen=True, eq=False)
class ExtendedCurve:
    """A curve continued beyond both ends, at rest or at constant velocity.

    Attributes:
        curve: Positions, trailing shape (e,).
        holds_ends: Whether it rests outside its time, at its end positions; otherwise it keeps the
            velocity that it has at its ends.
        delay: Time at which the curve's own time is 0 [s].

    >>> rising = ExtendedCurve(PiecewisePolynomial([[[2.0]], [[0.0]]], [0, 1]))
    >>> rising([-1.0, 3.0]).T, rising.between(2, 3).c.T
    (array([[0., 2.]]), array([[[0., 2.]]]))
    """

    curve: PiecewisePolynomial
    holds_ends: bool = True
    delay: float = 0.0

    def __call__(self, t: ArrayLike, nu: int = 0) -> FloatArray:
        """Positions or their nu-th derivative, shape (k, e), at times [s], shape (k,)."""
        local = np.asarray(t, dtype=float) - self.delay
        inside = np.clip(local, *self.curve.x[[0, -1]])
        beyond, value = (local - inside)[:, None], self.curve(inside, nu)
        outer_degree = 0 if self.holds_ends else 1
        if nu > outer_degree:
            return np.where(beyond != 0.0, 0.0, value)
        return value if nu == outer_degree else value + beyond * self.curve(inside, 1)

    def between(self, start: float, end: float) -> PiecewisePolynomial:
        """The curve from one time to a later one [s]."""
        x, c = self.curve.x + self.delay, np.array(self.curve.c)
        if len(c) == 1:
            c = np.concatenate((np.zeros_like(c), c))
        for before, edge, outer in ((True, x[0], start), (False, x[-1], end)):
            if not (outer < edge if before else outer > edge):
                continue
            piece = np.zeros((len(c), 1, c.shape[2]))
            rate = self([edge], 1)[0] if not self.holds_ends else 0.0
            piece[-2, 0] = rate
            piece[-1, 0] = self([outer if before else edge])[0]
            c = np.concatenate((piece, c) if before else (c, piece), axis=1)
            x = np.concatenate(([outer], x) if before else (x, [outer]))
        return cut_curve(PiecewisePolynomial(c, x), start, end)


def stack_curves(*curves: PiecewisePolynomial) -> PiecewisePolynomial:
    """Stack the components of curves over the same time, shapes (e,), with the breaks of all.

    >>> rising, still = ([[[1.0]], [[0.0]]], [[[3.0]]])
    >>> stack_curves(*(PiecewisePolynomial(c, [0, 2]) for c in (rising, still)))(1.0)
    array([1., 3.])
    """
    breaks = sort_distinct(*(curve.x for curve in curves))
    coefficients = [split_at(curve, breaks).c for curve in curves]
    size = max(map(len, coefficients))
    padded = [np.pad(c, ((size - len(c), 0), (0, 0), (0, 0))) for c in coefficients]
    return PiecewisePolynomial(np.concatenate(padded, axis=2), breaks)
