"""`PolynomialCurve`: a piecewise polynomial curve in space, by arc length.

Pieces are divided into spans, each with its own parameter w in [0, 1], until the speed |dC/dw| is
so even on each that Gauss-Legendre quadrature gives its length to rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knotwork.errors import PathError
from knotwork.polynomial.critical_points import to_bernstein
from knotwork.tool_paths.curve import Curve, checked_order
from knotwork.waypoints import FloatArray

NODES, WEIGHTS = (array for array in np.polynomial.legendre.leggauss(8))
NODES, WEIGHTS = 0.5 * (NODES + 1.0), 0.5 * WEIGHTS

SETTLED = 4e-15
"""Relative difference of a length and the sum of its halves at which a span is short enough."""

EVEN = 0.7
"""Least part of its greatest speed that the speed has on each span."""

BENT = 0.1
"""Turn on a span [rad] above which it is divided, for narrow bounds of curvature."""

DEEPEST = 40
"""How often a piece may be halved. A curve that stops or turns back on the way would need more."""

TINY = 1e-150
"""Divisors are no less, so that a curve that stops has a great curvature and not none."""

ITERATIONS = 30
"""Bound on Newton steps; they double the digits."""


class PolynomialCurve(Curve):
    """Piecewise polynomial as a function of its arc length.

    Args:
        c: Coefficients, each piece in its own unit parameter, highest power first, shape
            (degree + 1, m, 3). Neighbours must meet with the same direction and curvature.

    Attributes:
        piece_ends: Arc lengths of the ends of the pieces [m], shape (m + 1,).

    Raises:
        PathError: The curve stops or turns back on the way.
    """

    def __init__(self, c: FloatArray) -> None:
        spans = _divided(c)
        self._c = [_derivative(spans.c, order) for order in range(4)]
        self._curvature = np.append(spans.curvature_bounds(), 0.0)
        lengths = spans.lengths()
        self._s: FloatArray = np.concatenate(([0.0], np.cumsum(lengths)))
        self._speeds = [_norm(_values(self._c[1], np.full(lengths.size, w))) for w in (0.0, 1.0)]
        self.length = float(self._s[-1])
        first = np.flatnonzero(np.diff(spans.piece, prepend=-1))
        self.piece_ends: FloatArray = np.append(self._s[first], self.length)

    def _span_of(self, s: FloatArray) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self._s, s, "right") - 1, 0, len(self._s) - 2)

    def _parameters(self, s: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
        """Span of each arc length, and the parameter w in it; beyond 0 to 1 beyond the ends.

        Newton's method from the cubic that has the right values and slopes at both ends.
        """
        span = self._span_of(s)
        wanted, whole = s - self._s[span], self._s[span + 1] - self._s[span]
        x = wanted / whole
        slopes = [whole / speed[span] for speed in self._speeds]
        w = x * x * (3.0 - 2.0 * x) + x * (1.0 - x) * ((1.0 - x) * slopes[0] - x * slopes[1])
        w = np.where((x < 0.0) | (x > 1.0), x, w)
        going = np.arange(s.size)
        for _ in range(ITERATIONS):
            rows, at = span[going], w[going]
            step = (wanted[going] - self._length_to(rows, at)) / _norm(
                _values([c[rows] for c in self._c[1]], at)
            )
            w[going] = at + step
            going = going[np.abs(step) > 1e-9]  # the next step would be below rounding
            if not going.size:
                break
        return span, w

    def _length_to(self, span: NDArray[np.intp], w: FloatArray) -> FloatArray:
        """Length from the start of spans to parameters w in them."""
        c = [coefficient[span] for coefficient in self._c[1]]
        total = np.zeros(w.size)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            total += weight * _norm(_values(c, node * w))
        return np.asarray(total * w)

    def position(self, s: ArrayLike, order: int = 0) -> FloatArray:
        """Points of the curve, or their derivatives: see `Curve.position`.

        By the chain rule, with w' = 1/‖C'‖, w'' = -C'·C''/‖C'‖⁴ and so on.
        """
        return self.derivatives(s, order)[order]

    def derivatives(self, s: ArrayLike, order: int) -> list[FloatArray]:
        """Points and their derivatives up to an order, each of shape (k, 3)."""
        span, w = self._parameters(np.asarray(s, dtype=float))
        checked_order(order)
        C = [_values([c[span] for c in self._c[i]], w) for i in range(order + 1)]
        found = C[:1]
        if order >= 1:
            speed = _norm(C[1])[:, None]
            found.append(C[1] / speed)
        if order >= 2:
            along = _dot(C[1], C[2])
            first, second = 1.0 / speed, -along / speed**4
            found.append(C[2] * first**2 + C[1] * second)
        if order >= 3:
            growth = _dot(C[2], C[2]) + _dot(C[1], C[3])
            third = -growth / speed**5 + 4.0 * along**2 / speed**7
            found.append(C[3] * first**3 + 3.0 * C[2] * first * second + C[1] * third)
        return found

    def nearest(self, points: ArrayLike, guess: ArrayLike) -> FloatArray:
        """Arc lengths of the nearest points, by Newton's method from the guess.

        Where a step does not come nearer it is halved.
        """
        points = np.asarray(points, dtype=float)
        s: FloatArray = np.clip(np.array(guess, dtype=float), 0.0, self.length)
        going = np.arange(s.size)
        for _ in range(ITERATIONS):
            at, tangent, bend = self.derivatives(s[going], 2)
            off = at - points[going]
            slope, growth = _dot(off, tangent)[:, 0], 1.0 + _dot(off, bend)[:, 0]
            step = -slope / np.where(growth > 0.1, growth, 1.0)
            before = _norm(off)
            for _ in range(ITERATIONS):
                following = np.clip(s[going] + step, 0.0, self.length)
                farther = _norm(self.position(following) - points[going]) > before * (1 + 1e-12)
                if not farther.any():
                    break
                step = np.where(farther, 0.5 * step, step)
            moved = np.abs(following - s[going])
            s[going] = following
            going = going[moved > 1e-10 * self.length]
            if not going.size:
                break
        return s

    def curvature_bound(self, s0: ArrayLike, s1: ArrayLike) -> FloatArray:
        """Upper bounds of the curvature from arc length s0 to s1 [1/m], shape (k,).

        Of the spans there: ‖C' × C''‖ / ‖C'‖³ by the Bernstein coefficients of both.
        """
        ends = np.broadcast_arrays(np.asarray(s0, dtype=float), np.asarray(s1, dtype=float))
        low, high = self._span_of(np.minimum(*ends)), self._span_of(np.maximum(*ends))
        if not low.size:
            return np.zeros(0)
        limits = np.column_stack((low, high + 1)).ravel()
        return np.asarray(np.maximum.reduceat(self._curvature, limits)[::2])


@dataclass(frozen=True)
class _Spans:
    """Parts of pieces, each a polynomial in its own unit parameter.

    Attributes:
        c: Coefficients, highest power first, shape (degree + 1, n, 3).
        piece: Index of the piece of each.
        start: Where each begins in its piece, 0 to 1.
        size: Which part of its piece it is.
    """

    c: FloatArray
    piece: NDArray[np.intp]
    start: FloatArray
    size: FloatArray

    def chosen(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> _Spans:
        return _Spans(self.c[:, which], self.piece[which], self.start[which], self.size[which])

    def joined(self, other: _Spans) -> _Spans:
        return _Spans(
            np.concatenate((self.c, other.c), axis=1),
            np.concatenate((self.piece, other.piece)),
            np.concatenate((self.start, other.start)),
            np.concatenate((self.size, other.size)),
        )

    def halves(self) -> _Spans:
        """Both halves of each span, C(w/2) and C((1 + w)/2)."""
        degree, size = len(self.c) - 1, 0.5 * self.size
        left = self.c * (0.5 ** np.arange(degree, -1, -1.0))[:, None, None]
        right = np.array(left)
        for i in range(degree):  # shifted by one: synthetic division, repeated
            for j in range(1, degree + 1 - i):
                right[j] += right[j - 1]
        first = _Spans(left, self.piece, self.start, size)
        return first.joined(_Spans(right, self.piece, self.start + size, size))

    def lengths(self, low: float = 0.0, high: float = 1.0) -> FloatArray:
        """Length of each span between two parameters."""
        slope = _derivative(self.c, 1)
        total = np.zeros(self.piece.size)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            at = np.full(total.size, low + (high - low) * node)
            total += (high - low) * weight * _norm(_values(slope, at))
        return total

    def speed_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds below and above of |dC/dw|² on each span."""
        slope = _derivative(self.c, 1)
        squared = _products(slope, slope).sum(axis=2)
        coefficients = _bernstein(squared)
        return coefficients.min(axis=0), coefficients.max(axis=0)

    def curvature_bounds(self) -> FloatArray:
        """Bounds above of the curvature on each span."""
        slope, bend = _derivative(self.c, 1), _derivative(self.c, 2)
        x, y, z = (slope[:, :, [i]] for i in range(3))
        u, v, w = (bend[:, :, [i]] for i in range(3))
        turn = np.concatenate(
            [_products(a, d) - _products(b, c) for a, b, c, d in ((y, z, v, w), (z, x, w, u))]
            + [_products(x, v) - _products(y, u)],
            axis=2,
        )
        largest = np.linalg.norm(_bernstein(turn), axis=2).max(axis=0)
        return np.asarray(largest / np.maximum(self.speed_bounds()[0], TINY) ** 1.5)

    def short_enough(self) -> NDArray[np.bool_]:
        """Which spans have a speed, a length and a turn that are known well."""
        least, most = self.speed_bounds()
        whole = self.lengths()
        parts = self.lengths(0.0, 0.5) + self.lengths(0.5, 1.0)
        settled = np.abs(whole - parts) <= SETTLED * whole
        even = least > EVEN**2 * most
        return np.asarray(settled & even & (self.curvature_bounds() * whole < BENT))


def _divided(c: FloatArray) -> _Spans:
    """Spans of pieces, short enough, in order.

    Raises:
        PathError: The curve stops or turns back in a piece.
    """
    count = c.shape[1]
    waiting = _Spans(c, np.arange(count), np.zeros(count), np.ones(count))
    done = waiting.chosen(np.zeros(count, dtype=bool))
    for _ in range(DEEPEST):
        ready = waiting.short_enough()
        done = done.joined(waiting.chosen(ready))
        waiting = waiting.chosen(~ready)
        if not waiting.piece.size:
            return done.chosen(np.lexsort((done.start, done.piece)))
        waiting = waiting.halves()
    i = int(waiting.piece[0])
    raise PathError(
        f"the curve stops or turns back sharply between points {i} and {i + 1}; "
        "move or leave out points there"
    )


def _derivative(c: FloatArray, order: int) -> FloatArray:
    """Coefficients of a derivative, highest power first; at least a constant."""
    for _ in range(order):
        if len(c) == 1:
            return np.zeros_like(c)
        c = c[:-1] * np.arange(len(c) - 1, 0, -1.0)[:, None, None]
    return c


def _values(c: Sequence[FloatArray] | FloatArray, w: FloatArray) -> FloatArray:
    """Polynomials with coefficients c[power][k] at w, shape (k, 3), by Horner's scheme."""
    value = np.array(c[0])
    for coefficient in c[1:]:
        value = value * w[:, None] + coefficient
    return value


def _products(a: FloatArray, b: FloatArray) -> FloatArray:
    """Coefficients of the products of polynomials, component by component."""
    found = np.zeros((len(a) + len(b) - 1, *np.broadcast_shapes(a.shape[1:], b.shape[1:])))
    for i, coefficient in enumerate(a):
        found[i : i + len(b)] += coefficient * b
    return found


def _bernstein(c: FloatArray) -> FloatArray:
    """Bernstein coefficients of polynomials along the first axis."""
    return np.tensordot(to_bernstein(len(c) - 1), c[::-1], 1)


def _norm(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors, shape (k,)."""
    return np.asarray(np.sqrt(np.einsum("ki,ki->k", vectors, vectors)))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of vectors, shape (k, 1)."""
    return np.asarray(np.einsum("ki,ki->k", a, b)[:, None])
