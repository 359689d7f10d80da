"""`PolynomialCurve`: a piecewise polynomial curve in space, parametrised by arc length.

Pieces are divided into spans, each with a parameter w in [0, 1]. A span is short enough if its
speed |dC/dw| is so uniform that Gauss-Legendre quadrature gives its length to rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.critical_points import differentiate, horner, to_bernstein
from knotwork.curves.polynomial.splitting import split_at
from knotwork.curves.tool_paths.curve import Curve, checked_curve_order, geometry_error, sort_ends

NODES, WEIGHTS = (array for array in np.polynomial.legendre.leggauss(8))
NODES, WEIGHTS = 0.5 * (NODES + 1.0), 0.5 * WEIGHTS

LENGTH_TOLERANCE = 4e-15
"""Relative difference of a span's length and the sum of its halves at which it is short enough."""

MIN_SPEED_RATIO = 0.7
"""Minimum ratio of lowest to highest speed on a span."""

MAX_SPAN_TURN = 0.1
"""Maximum turn on a span [rad], for tight bounds of curvature."""

MAX_SPAN_HALVINGS = 40
"""Maximum number of halvings of a piece. A curve that stops or turns back would need more."""

MIN_DIVISOR = 1e-150
"""Minimum of divisors, so that the curvature of a curve that stops is large and not NaN."""

MAX_NEWTON_STEPS = 30
"""Maximum number of Newton steps; each doubles the digits."""


class PolynomialCurve(Curve):
    """Piecewise polynomial as a function of its arc length.

    Args:
        c: Coefficients, each piece in its unit parameter, highest power first, shape
            (degree + 1, m, 3). Direction and curvature must be continuous between pieces.

    Attributes:
        piece_ends: Arc lengths of the ends of the pieces [m], shape (m + 1,).

    Raises:
        PathError: The curve stops or turns back.
    """

    def __init__(self, c: FloatArray) -> None:
        spans, first = _divide(c)
        self._c = [spans]
        for _ in range(3):
            self._c.append(differentiate(self._c[-1]))
        self._curvature = np.append(_curvature_bounds(spans), 0.0)
        self._s: FloatArray = np.concatenate(([0.0], np.cumsum(_lengths(self._c[1]))))
        self._speeds = [_norm(horner(self._c[1], np.array(w))) for w in (0.0, 1.0)]
        self.length = float(self._s[-1])
        self.piece_ends: FloatArray = np.append(self._s[first], self.length)

    def _span_of(self, s: FloatArray) -> IndexArray:
        return np.clip(np.searchsorted(self._s, s, "right") - 1, 0, len(self._s) - 2)

    def _parameters(self, s: FloatArray) -> tuple[IndexArray, FloatArray]:
        """Span of each arc length, and the parameter w in it, outside [0, 1] beyond the ends.

        Newton's method, from the cubic with the exact values and slopes at both ends.
        """
        span = self._span_of(s)
        wanted, length = s - self._s[span], self._s[span + 1] - self._s[span]
        x = wanted / length
        slopes = [length / speed[span] for speed in self._speeds]
        w = x * x * (3.0 - 2.0 * x) + x * (1.0 - x) * ((1.0 - x) * slopes[0] - x * slopes[1])
        w = np.where((x < 0.0) | (x > 1.0), x, w)
        going = np.arange(s.size)
        for _ in range(MAX_NEWTON_STEPS):
            rows, at = span[going], w[going]
            slope = self._c[1][:, rows]
            off = wanted[going] - _lengths(slope, 0.0, at)
            step = off / _norm(horner(slope, at[:, None]))
            w[going] = at + step
            going = going[np.abs(step) > 1e-9]  # the next step would be smaller than rounding
            if not going.size:
                break
        return span, w

    def position(self, s: ArrayLike, order: int = 0) -> FloatArray:
        """Points of the curve, or their derivatives: see `Curve.position`.

        By the chain rule, with w' = 1/‖C'‖, w'' = -C'·C''/‖C'‖⁴ and so on.
        """
        return self.derivatives(s, order)[order]

    def derivatives(self, s: ArrayLike, order: int) -> list[FloatArray]:
        """Points and their derivatives up to an order, each of shape (k, 3)."""
        checked_curve_order(order)
        span, w = self._parameters(np.asarray(s, dtype=float))
        C = [horner(c[:, span], w[:, None]) for c in self._c[: order + 1]]
        result = C[:1]
        if order >= 1:
            speed = _norm(C[1])[:, None]
            result.append(C[1] / speed)
        if order >= 2:
            along = _dot(C[1], C[2])
            first, second = 1.0 / speed, -along / speed**4
            result.append(C[2] * first**2 + C[1] * second)
        if order >= 3:
            growth = _dot(C[2], C[2]) + _dot(C[1], C[3])
            third = -growth / speed**5 + 4.0 * along**2 / speed**7
            result.append(C[3] * first**3 + 3.0 * C[2] * first * second + C[1] * third)
        return result

    def nearest(self, points: ArrayLike, guess: ArrayLike) -> FloatArray:
        """Arc lengths of the nearest points, by Newton's method from the guess.

        A step that does not reduce the distance is halved.
        """
        points = np.asarray(points, dtype=float)
        s: FloatArray = np.clip(np.asarray(guess, dtype=float), 0.0, self.length)
        going, state = np.arange(s.size), self.derivatives(s, 2)
        for _ in range(MAX_NEWTON_STEPS):
            position, tangent, bend = state
            off = position - points[going]
            slope, growth = _dot(off, tangent)[:, 0], 1.0 + _dot(off, bend)[:, 0]
            step = -slope / np.where(growth > 0.1, growth, 1.0)
            step = np.clip(s[going] + step, 0.0, self.length) - s[going]
            on = np.abs(step) > 1e-10 * self.length
            s[going[~on]] += step[~on]
            going, step, before = going[on], step[on], _norm(off)[on]
            if not going.size:
                break
            for _ in range(MAX_NEWTON_STEPS):
                state = self.derivatives(s[going] + step, 2)
                is_farther = _norm(state[0] - points[going]) > before * (1.0 + 1e-12)
                if not is_farther.any():
                    break
                step = np.where(is_farther, 0.5 * step, step)
            s[going] += step
        return s

    def curvature_bound(self, s0: ArrayLike, s1: ArrayLike) -> FloatArray:
        """Upper bounds of the curvature from arc length s0 to s1 [1/m], shape (k,).

        The bound on each span is ‖C' × C''‖ / ‖C'‖³ by the Bernstein coefficients of both.
        """
        low, high = map(self._span_of, sort_ends(s0, s1))
        if not low.size:
            return np.zeros(0)
        limits = np.column_stack((low, high + 1)).ravel()
        return np.asarray(np.maximum.reduceat(self._curvature, limits)[::2])


def _divide(c: FloatArray) -> tuple[FloatArray, IndexArray]:
    """Divide pieces into sufficiently short spans.

    Returns:
        Coefficients of the spans, each in its unit parameter, and the first span of each piece.

    Raises:
        PathError: The curve stops or turns back in a piece.
    """
    pieces = np.arange(c.shape[1] + 1.0)
    curve = PiecewisePolynomial(c, pieces)
    for _ in range(MAX_SPAN_HALVINGS):
        sizes = np.diff(curve.x)
        spans = curve.c * sizes[:, None] ** np.arange(curve.degree, -1.0, -1.0)[:, None, None]
        long = ~_short_enough(spans)
        if not long.any():
            return spans, np.searchsorted(curve.x, pieces[:-1])
        starts = curve.x[:-1][long]
        curve = split_at(curve, starts + 0.5 * sizes[long])
    piece = c[:, int(starts[0])]
    raise geometry_error(
        "the curve stops or turns back sharply between {start} and {end}; move or leave out points "
        "there",
        start=piece[-1],
        end=piece.sum(axis=0),
    )


def _short_enough(c: FloatArray) -> BoolArray:
    """Whether speed, length and turn of each span are sufficiently accurate."""
    slope = differentiate(c)
    slowest, fastest = _speed_bounds(slope)
    length = _lengths(slope)
    settled = np.abs(length - _lengths(slope, 0.0, 0.5) - _lengths(slope, 0.5, 1.0))
    is_even = slowest > MIN_SPEED_RATIO**2 * fastest
    return np.asarray(
        (settled <= LENGTH_TOLERANCE * length)
        & is_even
        & (_curvature_bounds(c) * length < MAX_SPAN_TURN)
    )


def _lengths(
    slope: FloatArray, low: FloatArray | float = 0.0, high: FloatArray | float = 1.0
) -> FloatArray:
    """Length of each span between two parameters, from the coefficients of dC/dw."""
    at = low + np.multiply.outer(NODES, high - low)
    tangents = horner(slope[:, None], at.reshape(len(NODES), -1, 1))
    speeds = np.sqrt(np.einsum("nki,nki->nk", tangents, tangents))
    return np.asarray((high - low) * (WEIGHTS @ speeds))


def _speed_bounds(slope: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of |dC/dw|² on each span."""
    squared = _bernstein(np.einsum("aki,bki->abk", slope, slope))
    return squared.min(axis=0), squared.max(axis=0)


def _curvature_bounds(c: FloatArray) -> FloatArray:
    """Upper bounds of the curvature on each span."""
    slope = differentiate(c)
    turn = _bernstein(np.cross(slope[:, None], differentiate(slope)))
    largest = np.linalg.norm(turn, axis=2).max(axis=0)
    return np.asarray(largest / np.maximum(_speed_bounds(slope)[0], MIN_DIVISOR) ** 1.5)


def _bernstein(products: FloatArray) -> FloatArray:
    """Bernstein coefficients of products of polynomials.

    Args:
        products: Products of all pairs of coefficients, highest powers first, along the first two
            axes.
    """
    rows, columns, *shape = products.shape
    c = np.zeros((rows + columns - 1, *shape))
    for i, row in enumerate(products):
        c[i : i + columns] += row
    return np.tensordot(to_bernstein(len(c) - 1), c[::-1], 1)


def _norm(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors, shape (k,)."""
    return np.asarray(np.sqrt(np.einsum("ki,ki->k", vectors, vectors)))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of vectors, shape (k, 1)."""
    return np.asarray(np.einsum("ki,ki->k", a, b)[:, None])
