"""Fast evaluation of piecewise polynomials: in cache-sized blocks into one preallocated array.

Where consecutive times are sorted and many fall in one piece, Horner's scheme runs in place over
slices with scalar coefficients; otherwise each time's coefficients are gathered. Both do the same
operations in the same order, so a value does not depend on which times are asked for with it.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from knotwork.errors import TimeRangeError
from knotwork.waypoints import FloatArray

BLOCK = 4096
"""Times in a block: its buffers stay in the second-level cache while Horner passes over them."""

SLICE_THRESHOLD = 96
"""Mean number of times in a piece from which slices are faster than gathering (measured)."""


def falling_factorials(size: int, nu: int) -> list[float]:
    """Factors that the highest `size` powers get when differentiated `nu` times.

    Args:
        size: Number of coefficients left after differentiation, highest power first.
        nu: Order of the derivative.

    Returns:
        For the powers size-1+nu, …, nu: power!/(power-nu)!.
    """
    return [float(math.perm(power + nu, nu)) for power in range(size - 1, -1, -1)]


def first_outside(t: FloatArray, start: float, end: float) -> float:
    """Return the first of the times that is not in [start, end]; NaN is outside."""
    return float(t[np.flatnonzero(~((t >= start) & (t <= end)))[0]])


def evaluate(x: FloatArray, c: FloatArray, t: FloatArray, nu: int) -> FloatArray:
    """Evaluate the nu-th derivative of a piecewise polynomial.

    Pieces are half open, [x[i], x[i+1]), the last one closed.

    Args:
        x: Breaks, shape (m+1,).
        c: Coefficients, shape (k+1, m, d), highest power first.
        t: Times, shape (s,), in any order.
        nu: Order of the derivative, >= 0.

    Returns:
        Values, shape (s, d).

    Raises:
        TimeRangeError: A time lies outside [x[0], x[-1]] or is NaN.
    """
    start, end = float(x[0]), float(x[-1])
    out = np.empty((t.size, c.shape[2]))
    size = c.shape[0] - nu
    factors = falling_factorials(size, nu) if nu and size > 0 else None
    buffers = np.empty((2, min(BLOCK, t.size)))
    for low in range(0, t.size, BLOCK):
        block = t[low : low + BLOCK]
        target = out[low : low + BLOCK]
        is_sorted = bool((block[1:] >= block[:-1]).all())
        lowest, highest = (block[0], block[-1]) if is_sorted else (block.min(), block.max())
        if not (lowest >= start and highest <= end):
            raise TimeRangeError(first_outside(block, start, end), start, end)
        if size <= 0:
            target[...] = 0.0
            continue
        if is_sorted:
            first, last = (
                min(int(i) - 1, c.shape[1] - 1)
                for i in np.searchsorted(x, (lowest, highest), side="right")
            )
            if block.size >= SLICE_THRESHOLD * (last - first + 1):
                cuts = np.searchsorted(block, x[first + 1 : last + 1], side="left").tolist()
                _by_slices(x, c, block, first, [0, *cuts, block.size], factors, buffers, target)
                continue
        piece = np.searchsorted(x, block, side="right")
        piece -= 1
        np.minimum(piece, c.shape[1] - 1, out=piece)
        _by_gathering(x, c[:size], block, piece, factors, target)
    return out


def _by_slices(
    x: FloatArray,
    c: FloatArray,
    block: FloatArray,
    first: int,
    cuts: list[int],
    factors: list[float] | None,
    buffers: FloatArray,
    target: FloatArray,
) -> None:
    """Evaluate sorted times; those from cuts[i] to cuts[i+1] lie in piece first + i."""
    size = len(factors) if factors is not None else c.shape[0]
    for offset, (low, high) in enumerate(itertools.pairwise(cuts)):
        if low == high:
            continue
        i = first + offset
        u = np.subtract(block[low:high], x[i], out=buffers[0, : high - low])
        value = buffers[1, : high - low]
        coefficients = c[:size, i]
        if factors is not None:
            coefficients = coefficients * np.array(factors)[:, None]
        for j, column in enumerate(coefficients.T.tolist()):
            if size == 1:
                target[low:high, j] = column[0]
                continue
            np.multiply(u, column[0], out=value)
            for power in column[1:-1]:
                np.add(value, power, out=value)
                np.multiply(value, u, out=value)
            np.add(value, column[-1], out=target[low:high, j])


def _by_gathering(
    x: FloatArray,
    c: FloatArray,
    block: FloatArray,
    piece: NDArray[np.intp],
    factors: list[float] | None,
    target: FloatArray,
) -> None:
    """Evaluate times in any order, each with the coefficients of its own piece."""
    # one local time for each value, so that every pass below runs over contiguous memory
    u = np.empty_like(target)
    u[...] = (block - x[piece])[:, None]
    term = np.empty_like(target)
    for power in range(c.shape[0]):
        if power:
            np.multiply(target, u, out=target)
        np.take(c[power], piece, axis=0, out=term, mode="clip")
        if factors is not None:
            np.multiply(term, factors[power], out=term)
        if power:
            np.add(target, term, out=target)
        else:
            target[...] = term
