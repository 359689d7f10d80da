"""Exact extrema of piecewise polynomials: from the polynomials themselves, without sampling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knotwork.polynomial.critical_points import (
    critical_points,
    differentiate,
    horner,
    safeguarded_newton,
)
from knotwork.polynomial.isolation import isolate
from knotwork.waypoints import FloatArray

BLOCK = 8192
"""Pieces times components examined together, so that the temporaries stay small."""

CLOSED_FORM = 3
"""Up to this degree all critical points have a closed form."""


@dataclass(frozen=True, eq=False)
class Extrema:
    """Least and greatest value of each component of a curve, and when it takes them first.

    At a break both one-sided values count: where the curve jumps, the time of an extremum may be
    a break at which evaluation, which takes the right-hand piece, gives the other value.

    Attributes:
        minimum, maximum: Values, of the curve's trailing shape.
        minimum_time, maximum_time: Times [s], of the same shape.

    >>> found = kw.PiecewisePolynomial([[-1], [1], [0]], [0, 2]).extrema()  # t - t²
    >>> float(found.maximum), float(found.peak), float(found.peak_time)
    (0.25, 2.0, 2.0)
    """

    minimum: FloatArray
    minimum_time: FloatArray
    maximum: FloatArray
    maximum_time: FloatArray

    @property
    def peak(self) -> FloatArray:
        """Greatest absolute value of each component."""
        return np.maximum(np.abs(self.minimum), np.abs(self.maximum))

    @property
    def peak_time(self) -> FloatArray:
        """When each component takes its greatest absolute value [s]."""
        return np.where(
            np.abs(self.minimum) > np.abs(self.maximum), self.minimum_time, self.maximum_time
        )


def piecewise_extrema(x: FloatArray, c: FloatArray) -> Extrema:
    """Find the extrema of a piecewise polynomial.

    Args:
        x: Breaks, shape (m+1,).
        c: Coefficients, shape (k+1, m, d), highest power first.

    Returns:
        Extrema of shape (d,).
    """
    leading = 0
    while leading < c.shape[0] - 1 and not c[leading].any():
        leading += 1
    c = c[leading:]
    best = _Best(c.shape[2])
    step = max(1, BLOCK // max(1, c.shape[2]))
    for low in range(0, c.shape[1], step):
        high = min(low + step, c.shape[1])
        _examine(best, x[low : high + 1], c[:, low:high])
    return Extrema(-best.value[1], best.time[1], best.value[0], best.time[0])


class _Best:
    """The greatest values of each component, and of its negative, and when they are first taken."""

    def __init__(self, components: int) -> None:
        self.value = np.full((2, components), -np.inf)
        self.time = np.zeros((2, components))

    def take(self, values: FloatArray, times: FloatArray) -> None:
        """Compare with values in time order, shape (n, d), at times of the same shape."""
        # what is not a number may be anything: no limit is kept
        lost = np.isnan(values)
        for i, sign in enumerate((1.0, -1.0)):
            signed = np.where(lost, np.inf, sign * values)
            index = np.argmax(signed, axis=0)[None]
            candidate = np.take_along_axis(signed, index, axis=0)[0]
            time = np.take_along_axis(times, index, axis=0)[0]
            better = candidate > self.value[i]
            self.value[i] = np.where(better, candidate, self.value[i])
            self.time[i] = np.where(better, time, self.time[i])

    def take_scattered(
        self, component: NDArray[np.intp], values: FloatArray, times: FloatArray
    ) -> None:
        """Compare with values of any components, shape (n,) all."""
        for i, sign in enumerate((1.0, -1.0)):
            order = np.lexsort((times, -sign * values, component))
            changed, first = np.unique(component[order], return_index=True)
            index = order[first]
            better = sign * values[index] > self.value[i, changed]
            self.value[i, changed[better]] = sign * values[index[better]]
            self.time[i, changed[better]] = times[index[better]]


def candidates(x: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and times at the ends and critical points of pieces, in time order.

    Args:
        x: Breaks, shape (m+1,).
        c: Coefficients, shape (k+1, m, d), highest power first.

    Returns:
        Both of shape (number of candidates of a piece, m, d).
    """
    return _at_points(x, c, critical_points(_in_unit(x, c)))


def _in_unit(x: FloatArray, c: FloatArray) -> FloatArray:
    """Coefficients in the unit variable of each piece."""
    span, unit = np.diff(x)[:, None], np.array(c)
    for low in range(1, len(c)):  # no power of the span by itself, which may overflow
        unit[:low] *= span
    return unit


def _at_points(x: FloatArray, c: FloatArray, inner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and times at the ends of pieces and at points of the unit variable between them."""
    span = np.diff(x)[:, None]
    local = np.empty((len(inner) + 2, *c.shape[1:]))
    local[0] = 0.0
    np.multiply(inner, span, out=local[1:-1])
    local[-1] = span
    values = horner(c[:, None], local)
    return values, np.minimum(x[:-1, None] + local, x[1:, None])


def _examine(best: _Best, x: FloatArray, c: FloatArray) -> None:
    """Look at the ends and the critical points of pieces."""
    unit = _in_unit(x, c)
    inner = critical_points(unit[-1 - CLOSED_FORM :])
    higher = len(c) - 1 > CLOSED_FORM
    if higher:
        inner *= ~unit[: -1 - CLOSED_FORM].any(axis=0)
    # piece by piece, so that the first of equal values is the earliest
    found = _at_points(x, c, inner)
    values, times = (part.swapaxes(0, 1).reshape(-1, c.shape[2]) for part in found)
    best.take(values, times)
    if higher and np.isfinite(best.value).all():
        _examine_high_degrees(best, x, c, unit)


def _examine_high_degrees(best: _Best, x: FloatArray, c: FloatArray, unit: FloatArray) -> None:
    """Examine the extrema of those pieces, of any degree, that may go beyond what is known."""
    piece, component = np.nonzero(unit[: -1 - CLOSED_FORM].any(axis=0))
    columns = unit[:, piece, component]
    found = isolate(columns, component, -best.value[1], best.value[0])
    roots = safeguarded_newton(
        differentiate(columns[:, found.column]), found.low, found.high, found.rising
    )
    which = np.concatenate((found.column, found.points[0]))
    local = np.concatenate((roots, found.points[1])) * np.diff(x)[piece[which]]
    values = horner(c[:, piece[which], component[which]], local)
    times = np.minimum(x[piece[which]] + local, x[piece[which] + 1])
    best.take_scattered(component[which], values, times)
