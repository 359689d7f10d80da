"""Exact extrema of piecewise polynomials, from the polynomials themselves, without samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.critical_points import find_critical_points, horner

BLOCK_PIECES = 8192
"""Pieces times components per block, to limit memory."""


@dataclass(frozen=True, eq=False)
class Extrema:
    """Minimum and maximum of each component of a curve, and the first times at which they occur.

    At a break both one-sided values count. Where the curve jumps, an extremum may be the left-hand
    value at a break, although evaluation there gives the right-hand value.

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
        """Maximum absolute value of each component."""
        return np.maximum(np.abs(self.minimum), np.abs(self.maximum))

    @property
    def peak_time(self) -> FloatArray:
        """Time at which each component has its maximum absolute value [s]."""
        return np.where(
            np.abs(self.minimum) > np.abs(self.maximum), self.minimum_time, self.maximum_time
        )


def find_extrema(x: FloatArray, c: FloatArray) -> Extrema:
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
    # maxima of each component and of its negative, and the first times at which they occur
    best = np.full((2, c.shape[2]), -np.inf)
    time = np.zeros((2, c.shape[2]))
    step = max(1, BLOCK_PIECES // max(1, c.shape[2]))
    for low in range(0, c.shape[1], step):
        high = min(low + step, c.shape[1])
        # piece by piece, so that the first of equal values is the earliest
        values, times = (
            table.swapaxes(0, 1).reshape(-1, c.shape[2])
            for table in locate_extremum_candidates(x[low : high + 1], c[:, low:high])
        )
        # NaN counts as unbounded, so that no limit is kept
        lost = np.isnan(values)
        for i, sign in enumerate((1.0, -1.0)):
            signed = np.where(lost, np.inf, sign * values)
            index = np.argmax(signed, axis=0)[None]
            greatest = np.take_along_axis(signed, index, axis=0)[0]
            better = greatest > best[i]
            best[i, better] = greatest[better]
            time[i, better] = np.take_along_axis(times, index, axis=0)[0, better]
    return Extrema(-best[1], time[1], best[0], time[0])


def locate_extremum_candidates(x: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Locate the ends and critical points of pieces: values and times, in time order.

    Args:
        x: Breaks, shape (m+1,).
        c: Coefficients, shape (k+1, m, d), highest power first.

    Returns:
        Both of shape (number of candidates of a piece, m, d).
    """
    span, unit = np.diff(x)[:, None], np.array(c)
    for low in range(1, len(c)):  # powers of the span may overflow
        unit[:low] *= span
    inner = find_critical_points(unit)
    local = np.empty((len(inner) + 2, *c.shape[1:]))
    local[0] = 0.0
    np.multiply(inner, span, out=local[1:-1])
    local[-1] = span
    values = horner(c[:, None], local)
    return values, np.minimum(x[:-1, None] + local, x[1:, None])
