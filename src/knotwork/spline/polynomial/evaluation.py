"""Fast evaluation of piecewise polynomials: in cache-sized blocks into one preallocated array.

If times are sorted and many fall in one piece, they share its coefficients: their values are the
product of the powers of time with these. Otherwise the coefficients of each time are gathered. Both
methods agree to rounding.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from knotwork.errors import TimeRangeError
from knotwork.waypoints import FloatArray

BLOCK = 49152
"""Values per block: small enough for the caches, large enough to make overhead negligible."""

FEW = 12288
"""Number of values below which they are always gathered."""

PRODUCT_THRESHOLD = 1024
"""Mean number of values in a piece from which products are faster than gathering."""


def falling_factorials(size: int, nu: int) -> list[float]:
    """Factors of the highest `size` powers after `nu` differentiations.

    Args:
        size: Number of coefficients left after differentiation, highest power first.
        nu: Order of the derivative.

    Returns:
        For the powers size-1+nu, …, nu: power!/(power-nu)!.
    """
    return [float(math.perm(power + nu, nu)) for power in range(size - 1, -1, -1)]


def evaluate(x: FloatArray, c: FloatArray, t: FloatArray) -> FloatArray:
    """Evaluate a piecewise polynomial.

    Pieces are half open, [x[i], x[i+1]), the last one closed.

    Args:
        x: Breaks, shape (m+1,).
        c: Coefficients, shape (k+1, m, d), highest power first.
        t: Times, shape (s,), in any order.

    Returns:
        Values, shape (s, d).

    Raises:
        TimeRangeError: A time lies outside [x[0], x[-1]] or is NaN.
    """
    start, end = x.item(0), x.item(-1)
    if t.size and not (t.item(t.argmin()) >= start and t.item(t.argmax()) <= end):
        raise TimeRangeError(float(t[~((t >= start) & (t <= end))][0]), start, end)
    d = max(1, c.shape[2])
    if t.size * d <= FEW:
        return _gathered(x, c, t)
    out = np.empty((t.size, c.shape[2]))
    step = max(1, BLOCK // d)
    for low in range(0, t.size, step):
        _evaluate_block(x, c, t[low : low + step], out[low : low + step])
    return out


def _gathered(x: FloatArray, c: FloatArray, t: FloatArray) -> FloatArray:
    """Evaluate at times in any order, each with the coefficients of its own piece."""
    piece = x[1:-1].searchsorted(t, side="right")
    terms = c.take(piece, 1)
    # over contiguous memory products take a fourth of the time
    u = (t - x.take(piece)).repeat(c.shape[2]).reshape(t.size, c.shape[2])
    value: FloatArray = terms[0]
    for term in terms[1:]:
        value *= u
        value += term
    return value


def _evaluate_block(x: FloatArray, c: FloatArray, block: FloatArray, target: FloatArray) -> None:
    """Evaluate by products or by gathering, depending on how many times share a piece."""
    first, last = x[1:-1].searchsorted(block[[0, -1]], side="right").tolist()
    is_sorted = bool((block[1:] >= block[:-1]).all())
    if is_sorted and target.size >= PRODUCT_THRESHOLD * (last - first + 1):
        _by_products(x[first : last + 2], c[:, first : last + 1], block, target)
        return
    step = max(1, FEW // max(1, c.shape[2]))
    for low in range(0, block.size, step):
        target[low : low + step] = _gathered(x, c, block[low : low + step])


def _by_products(x: FloatArray, c: FloatArray, block: FloatArray, target: FloatArray) -> None:
    """Evaluate at sorted times as powers times coefficients, piece by piece."""
    cuts = np.concatenate(([0], block.searchsorted(x[1:-1]), [block.size]))
    powers = np.empty((c.shape[0], block.size))
    powers[-1] = 1.0
    if c.shape[0] > 1:
        np.subtract(block, x[:-1].repeat(np.diff(cuts)), out=powers[-2])
        for power in range(c.shape[0] - 3, -1, -1):
            np.multiply(powers[power + 1], powers[-2], out=powers[power])
    for i, (low, high) in enumerate(itertools.pairwise(cuts.tolist())):
        np.matmul(powers[:, low:high].T, c[:, i], out=target[low:high])
