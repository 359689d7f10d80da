"""Curves as lines to draw: points piece by piece, and jumps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.critical_points import find_critical_points, horner
from knotwork.curves.polynomial.jumps import measure_jumps

CURVE_POINTS, MIN_POINTS, MAX_POINTS = 3000, 12, 400
"""Number of points of a whole curve, and the minimum and maximum number of one piece."""


@dataclass(frozen=True, eq=False)
class Strokes:
    """A derivative of one component, evaluated piece by piece, with both values at each break.

    Attributes:
        time: Times [s], shape (m, n): n of each piece, from its start to its end.
        value: Values, shape (m, n). Between two of them the curve is monotone.
        jumps: Indices of the breaks at which the derivative jumps, in 1 … m-1.
    """

    time: FloatArray
    value: FloatArray
    jumps: IndexArray

    def line(self, *, steps: bool = False) -> tuple[FloatArray, FloatArray]:
        """Times and values of a line, with NaN at jumps.

        Args:
            steps: Whether a vertical line joins the two sides of a jump instead.
        """
        time, value = self.time.ravel(), self.value.ravel()
        if steps or not self.jumps.size:
            return time, value
        at = self.jumps * self.time.shape[1]
        return np.insert(time, at, self.time[self.jumps, 0]), np.insert(value, at, np.nan)

    def jump_lines(self) -> tuple[FloatArray, FloatArray]:
        """Times and values of vertical lines from one side of each jump to the other, with NaN."""
        k = self.jumps
        gap = np.full(k.shape, np.nan)
        time = self.time[k, 0]
        value = np.stack((self.value[k - 1, -1], self.value[k, 0], gap), axis=1)
        return np.stack((time, time, time), axis=1).ravel(), value.ravel()

    def beyond(self, lower: float, upper: float) -> tuple[FloatArray, FloatArray]:
        """Times, and values where they are beyond a limit, NaN elsewhere."""
        time, value = self.line()
        return time, np.where((value < lower) | (value > upper), value, np.nan)


def strokes(curve: PiecewisePolynomial, component: int, order: int, factor: float) -> Strokes:
    """Evaluate a derivative of one component of a curve, piece by piece.

    Args:
        curve: Trailing shape (d,).
        component: Index of the component.
        order: Order of the derivative.
        factor: Factor to the displayed unit.
    """
    derived = curve.derivative(order) if order else curve
    c = factor * derived.c[:, :, component]
    span = np.diff(curve.x)
    degree = len(c) - 1
    unit = c * span ** np.arange(degree, -1, -1)[:, None]
    pieces = span.size
    count = min(max(CURVE_POINTS // pieces, MIN_POINTS), MAX_POINTS) if degree > 1 else 2
    regular = np.broadcast_to(np.linspace(0.0, 1.0, count)[:, None], (count, pieces))
    fraction = np.sort(np.concatenate((regular, find_critical_points(unit))), axis=0)
    time = np.minimum(curve.x[:-1] + fraction * span, curve.x[1:])
    time[-1] = curve.x[1:]
    value = horner(unit, fraction)
    return Strokes(time.T, value.T, jump_breaks(curve, component, order))


def jump_breaks(curve: PiecewisePolynomial, component: int, order: int) -> IndexArray:
    """Indices of the inner breaks at which a derivative jumps by more than rounding explains."""
    sizes, allowed = measure_jumps(curve, order)
    return np.flatnonzero((sizes > allowed)[:, component]) + 1
