"""Fast evaluation of piecewise polynomials: in cache-sized blocks into one preallocated array.

Few values are worked on all at once. Where times are sorted and many fall in one piece, all of them
use the same coefficients: a single component is evaluated by Horner's scheme in place, several by
the product of the powers of time with the coefficients. Otherwise the coefficients of each time are
gathered. All ways agree to rounding.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from knotwork.errors import TimeRangeError
from knotwork.waypoints import FloatArray

BLOCK = 49152
"""Values that are worked on together: their buffers stay in the nearer caches, and bookkeeping is
negligible next to them."""

HORNER_THRESHOLD = 1024
"""Mean number of times in a piece from which Horner's scheme is faster than gathering."""

FEW = 12288
"""Values that are worked on without regard to how many fall in one piece."""

KEPT = 524288
"""Coefficients of a curve up to which those of its derivatives are kept, once they were used."""

GATHERED = 16384
"""Values whose coefficients are gathered together."""

PRODUCT_THRESHOLD = 1024
"""Mean number of values in a piece from which products are faster than gathering."""


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
    size = c.shape[0] - nu
    factors = falling_factorials(size, nu) if nu and size > 0 else None
    out = np.empty((t.size, c.shape[2]))
    step = max(1, BLOCK // max(1, c.shape[2]))
    for low in range(0, t.size, step):
        block, target = t[low : low + step], out[low : low + step]
        is_sorted = bool((block[1:] >= block[:-1]).all())
        lowest, highest = (block[0], block[-1]) if is_sorted else (block.min(), block.max())
        if not (lowest >= start and highest <= end):
            raise TimeRangeError(first_outside(block, start, end), start, end)
        if size <= 0:
            target[...] = 0.0
        elif is_sorted:
            _evaluate_sorted(x, c[:size], block, factors, target)
        else:
            _by_gathering(x, c[:size], block, pieces_of(x, block), factors, target)
    return out


class FewTimes:
    """Evaluates a piecewise polynomial and its derivatives at few times, in few calls of NumPy.

    Args:
        x: Breaks, shape (m+1,).
        c: Coefficients, shape (k+1, m, d), highest power first, contiguous.
    """

    __slots__ = ("_c", "_d", "_orders", "_piece_at", "_start_of")

    def __init__(self, x: FloatArray, c: FloatArray) -> None:
        # What is after the end, and NaN, has no piece; what is before the start is before the
        # start of its piece.
        ends = x[1:].copy()
        ends[-1] = np.nextafter(x[-1], np.inf)
        self._piece_at, self._start_of = ends.searchsorted, x[:-1].take
        self._c, self._d = c, c.shape[2]
        self._orders: dict[int, tuple[FloatArray, FloatArray | None]] = {}

    def at(self, t: FloatArray, nu: int) -> FloatArray | None:
        """Evaluate the nu-th derivative, 0 <= nu <= k, at times of shape (s,), in any order.

        Args:
            t: Times, s > 0.
            nu: Order of the derivative.

        Returns:
            Values, shape (s, d), contiguous; `None` if a time lies outside [x[0], x[-1]] or is NaN.
        """
        piece = self._piece_at(t, "right")
        try:
            u = t - self._start_of(piece)
        except IndexError:
            return None
        if not u.item(u.argmin()) >= 0.0:
            return None
        c, factors = self._orders.get(nu) or self._order(nu)
        terms = c.take(piece, 1)
        if factors is not None:
            terms *= factors
        value: FloatArray = terms[0]
        if len(terms) > 1:
            # over contiguous memory products take a fourth of the time
            u = u.repeat(self._d).reshape(-1, self._d)
            for power in range(1, len(terms)):
                value = value * u
                value += terms[power]
        return value

    def _order(self, nu: int) -> tuple[FloatArray, FloatArray | None]:
        """Coefficients of a derivative, and what they are still to be multiplied by, if anything.

        They are kept.
        """
        c, factors = self._c, None
        if nu:
            c = c[: c.shape[0] - nu]
            factors = np.array(falling_factorials(c.shape[0], nu))[:, None, None]
            if c.size <= KEPT:
                c, factors = c * factors, None
        self._orders[nu] = c, factors
        return c, factors


def pieces_of(x: FloatArray, t: FloatArray) -> NDArray[np.intp]:
    """Index of the piece that holds each of the times, which lie in [x[0], x[-1]]."""
    return x[1:-1].searchsorted(t, side="right")


def _evaluate_sorted(
    x: FloatArray,
    c: FloatArray,
    block: FloatArray,
    factors: list[float] | None,
    target: FloatArray,
) -> None:
    """Evaluate sorted times in the way that suits how many of them share a piece."""
    first, last = pieces_of(x, block[[0, -1]]).tolist()
    if last - first >= block.size:
        _by_gathering(x, c, block, pieces_of(x, block), factors, target)
        return
    cuts = np.searchsorted(block, x[first + 1 : last + 1], side="left")
    cuts = np.concatenate(([0], cuts, [block.size]))
    pieces, d = last - first + 1, c.shape[2]
    if d == 1 and block.size >= HORNER_THRESHOLD * pieces:
        _by_horner(x, c[:, :, 0], block, first, cuts.tolist(), factors, target[:, 0])
    elif d > 1 and block.size * d >= PRODUCT_THRESHOLD * pieces:
        _by_products(x, c, block, first, cuts, factors, target)
    else:
        piece = np.repeat(np.arange(first, last + 1), np.diff(cuts))
        _by_gathering(x, c, block, piece, factors, target)


def _by_horner(
    x: FloatArray,
    c: FloatArray,
    block: FloatArray,
    first: int,
    cuts: list[int],
    factors: list[float] | None,
    target: FloatArray,
) -> None:
    """Evaluate one component at sorted times; those from cuts[i] on lie in piece first + i."""
    local = np.empty(block.size)
    for i, (low, high) in enumerate(itertools.pairwise(cuts), first):
        value, u = target[low:high], local[low:high]
        leading, *others = (c[:, i] if factors is None else c[:, i] * factors).tolist()
        if not others:
            value[...] = leading
            continue
        np.subtract(block[low:high], x[i], out=u)
        np.multiply(u, leading, out=value)
        for coefficient in others[:-1]:
            np.add(value, coefficient, out=value)
            np.multiply(value, u, out=value)
        np.add(value, others[-1], out=value)


def _by_products(
    x: FloatArray,
    c: FloatArray,
    block: FloatArray,
    first: int,
    cuts: NDArray[np.intp],
    factors: list[float] | None,
    target: FloatArray,
) -> None:
    """Evaluate at sorted times as powers times coefficients, piece by piece."""
    powers = np.empty((c.shape[0], block.size))
    powers[-1] = 1.0
    if c.shape[0] > 1:
        u = powers[-2]
        np.subtract(block, np.repeat(x[first : first + cuts.size - 1], np.diff(cuts)), out=u)
        for power in range(c.shape[0] - 3, -1, -1):
            np.multiply(powers[power + 1], u, out=powers[power])
    if factors is not None:
        powers *= np.array(factors)[:, None]
    for i, (low, high) in enumerate(itertools.pairwise(cuts.tolist()), first):
        np.matmul(powers[:, low:high].T, c[:, i], out=target[low:high])


def _by_gathering(
    x: FloatArray,
    c: FloatArray,
    block: FloatArray,
    piece: NDArray[np.intp],
    factors: list[float] | None,
    target: FloatArray,
) -> None:
    """Evaluate times in any order, each with the coefficients of its own piece."""
    d = c.shape[2]
    step = min(block.size, max(1, GATHERED // max(1, d)))
    terms, local = np.empty((step, d)), np.empty(step)
    for low in range(0, block.size, step):
        index, value = piece[low : low + step], target[low : low + step]
        term, u = terms[: index.size], local[: index.size]
        np.take(x, index, out=u, mode="clip")
        np.subtract(block[low : low + step], u, out=u)
        # one local time for each value, so that every pass below runs over contiguous memory
        spread = u[:, None] if d == 1 else np.repeat(u, d).reshape(u.size, d)
        for power, coefficients in enumerate(c):
            into = term if power else value
            np.take(coefficients, index, axis=0, out=into, mode="clip")
            if factors is not None:
                np.multiply(into, factors[power], out=into)
            if power:
                np.add(value, term, out=value)
            if power < c.shape[0] - 1:
                np.multiply(value, spread, out=value)
