"""Times at which a curve that never decreases reaches given values."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.piecewise import PiecewisePolynomial

BISECTIONS = 60
"""Number of halvings of a piece, which exhaust the digits of its times."""


def first_times(curve: PiecewisePolynomial, values: FloatArray) -> FloatArray:
    """Find the times at which a curve that never decreases first reaches values.

    Bisection finds them, because Newton's method fails where the curve is at rest.

    >>> rising = PiecewisePolynomial([[1, 0], [0, 1]], [0, 1, 2])  # t up to 1
    >>> first_times(rising, np.array([0.25, 1.0]))
    array([0.25, 1.  ])

    Args:
        curve: The curve, without trailing axes.
        values: Values within its range, shape (k,).

    Returns:
        Times, shape (k,).
    """
    reached = curve(curve.x)
    piece = np.clip(np.searchsorted(reached, values, side="left") - 1, 0, len(reached) - 2)
    low, high = curve.x[piece], curve.x[piece + 1]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        late = curve(middle) >= values
        low, high = np.where(late, low, middle), np.where(late, middle, high)
    return np.where(values <= reached[0], curve.x[0], high)
