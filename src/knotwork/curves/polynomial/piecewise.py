"""`PiecewisePolynomial`: a curve as polynomials between breaks, in SciPy's conventions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, ReadOnlyArrays, checked_times
from knotwork.curves.polynomial.coefficients import checked_coefficients, checked_order
from knotwork.curves.polynomial.critical_points import horner
from knotwork.curves.polynomial.extrema import Extrema, find_extrema
from knotwork.errors import InputError, TimeRangeError

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

MAX_CACHED_COEFFICIENTS = 524288
"""Maximum number of coefficients of a derivative that is cached."""


BLOCK_VALUES = 12288
"""Number of values evaluated at once, small enough for the caches."""


class PiecewisePolynomial(ReadOnlyArrays):
    """Piecewise polynomial in the local power basis (as smooth as its coefficients make it).

    Between breaks x[i] and x[i+1] the curve is sum(c[r, i] * (t - x[i])**(k - r), r = 0…k), as in
    `scipy.interpolate.PPoly`. Pieces are half open, [x[i], x[i+1]), the last one closed. Unlike
    SciPy's, the curve is never extrapolated, and its arrays are read-only.

    >>> curve = kw.PiecewisePolynomial([[1, -1], [0, 2], [0, 1]], [0, 1, 2])  # t², 1 + 2 s - s²
    >>> curve([0.5, 1, 2]), curve.derivative()(1.5)
    (array([0.25, 1.  , 2.  ]), array(1.))

    Args:
        c: Coefficients, shape (k+1, m, ...), highest power first; with `axis` = p > 0, the axes of
            length k+1 and m are p and p + 1.
        x: Breaks, shape (m+1,), strictly increasing.
        axis: Axis of the values along which time runs.

    Raises:
        InputError: The coefficients are complex, not finite or above 1e200, do not fit the breaks
            or axis, or are of a degree above 30.
        WaypointDataError: The breaks are not finite or not strictly increasing.
    """

    _x: FloatArray
    _c: FloatArray
    _axis: int
    _extrema: dict[int, Extrema]
    _derivatives: dict[int, FloatArray]

    def __init__(self, c: ArrayLike, x: ArrayLike, *, axis: int = 0) -> None:
        breaks = checked_times(x, subject="break")
        self._assign(checked_coefficients(c, breaks, axis), breaks, axis)

    def _assign(self, c: FloatArray, x: FloatArray, axis: int) -> None:
        """Take over checked arrays without copying them: c of shape (k+1, m, ...), contiguous."""
        c.setflags(write=False)
        x.setflags(write=False)
        self._c, self._x, self._axis = c, x, axis
        self._extrema = {}  # a cache: checks need them often
        self._derivatives = {}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_derivatives": {}}  # they are large; extrema are not

    @staticmethod
    def _from_parts(c: FloatArray, x: FloatArray, axis: int) -> PiecewisePolynomial:
        polynomial = object.__new__(PiecewisePolynomial)
        polynomial._assign(c, x, axis)
        return polynomial

    @property
    def x(self) -> FloatArray:
        """Breaks, shape (m+1,)."""
        return self._x

    @property
    def c(self) -> FloatArray:
        """Coefficients, shape (k+1, m, ...), highest power first."""
        return self._c

    @property
    def axis(self) -> int:
        """Axis of the values along which time runs."""
        return self._axis

    @property
    def degree(self) -> int:
        """Degree that the coefficients allow for, k."""
        return int(self._c.shape[0]) - 1

    def _derivative_coefficients(self, nu: int) -> FloatArray:
        """Coefficients of a derivative with the trailing axes as one, shape (≤ k+1, m, d)."""
        if nu in self._derivatives:
            return self._derivatives[nu]
        c = self.derivative(nu).c if nu else self._c
        flat = c.reshape(*c.shape[:2], math.prod(c.shape[2:]))
        if flat.size <= MAX_CACHED_COEFFICIENTS or not nu:
            self._derivatives[nu] = flat
        return flat

    def __call__(self, x: ArrayLike, nu: int = 0) -> FloatArray:
        """Evaluate the curve or a derivative of it.

        At a break the right-hand piece counts, and at the end the last piece.

        Args:
            x: Times, any shape.
            nu: Order of the derivative, >= 0.

        Returns:
            Values; the time axis of the data is replaced by the shape of `x`.

        Raises:
            TimeRangeError: A time is NaN, or outside [x[0], x[-1]], even by one rounding.
            InputError: `nu` is not an integer, or negative.
        """
        t = np.asarray(x)
        if t.dtype.kind not in "buif":
            raise InputError(f"times must be real numbers, not {t.dtype}")
        t = t.astype(float, copy=False)
        out = evaluate(self._x, self._derivative_coefficients(checked_order(nu)), t.ravel())
        if t.ndim != 1 or self._c.ndim != 3:
            out = out.reshape(t.shape + self._c.shape[2:])
        if self._axis == 0:
            return out
        # the axes of the times move behind the first `axis` axes of the data
        order = list(range(out.ndim))
        cut = t.ndim + self._axis
        return out.transpose(order[t.ndim : cut] + order[: t.ndim] + order[cut:])

    def derivative(self, nu: int = 1) -> PiecewisePolynomial:
        """Return the nu-th derivative as a curve; a negative order integrates.

        Raises:
            InputError: `nu` is not an integer.
        """
        if isinstance(nu, (int, np.integer)) and nu < 0:
            return self.antiderivative(-nu)
        nu = checked_order(nu)
        size = self._c.shape[0] - nu
        if size <= 0:
            return self._from_parts(np.zeros((1, *self._c.shape[1:])), self._x, self._axis)
        factors = np.array(falling_factorials(size, nu))
        c = self._c[:size] * factors.reshape(-1, *[1] * (self._c.ndim - 1))
        return self._from_parts(c, self._x, self._axis)

    def antiderivative(self, nu: int = 1) -> PiecewisePolynomial:
        """Return the curve that is 0 at the start and has this one as its nu-th derivative.

        It is continuous with its first nu - 1 derivatives. A negative order differentiates.

        Raises:
            InputError: `nu` is not an integer.
        """
        if isinstance(nu, (int, np.integer)) and nu < 0:
            return self.derivative(-nu)
        c = np.array(self._c)
        span = np.diff(self._x).reshape(-1, *[1] * (c.ndim - 2))
        for _ in range(checked_order(nu, "antiderivative order nu")):
            powers = np.arange(c.shape[0], 0, -1.0).reshape(-1, *[1] * (c.ndim - 1))
            c = np.concatenate((c / powers, np.zeros((1, *c.shape[1:]))))
            c[-1, 1:] = np.cumsum(horner(c, span)[:-1], axis=0)
        return self._from_parts(c, self._x, self._axis)

    def to_ppoly(self) -> PPoly:
        """Return the same curve as a SciPy object that does not extrapolate (imports SciPy)."""
        from scipy.interpolate import PPoly

        return PPoly.construct_fast(np.array(self._c), np.array(self._x), False, self._axis)

    def solve(self, y: float = 0.0, discontinuity: bool = True) -> Any:
        """Find the times at which the curve takes the value y (imports SciPy).

        Args:
            y: The value.
            discontinuity: Whether a change of sign across a jump counts.

        Returns:
            Times as `scipy.interpolate.PPoly.solve` gives them: an array, or for curves with
            trailing shape an object array of arrays. A piece on which the curve equals y
            throughout is reported by its start followed by NaN.
        """
        return self.to_ppoly().solve(y, discontinuity, False)

    def roots(self, discontinuity: bool = True) -> Any:
        """Find the times at which the curve is zero (imports SciPy).

        Args:
            discontinuity: Whether a change of sign across a jump counts.

        Returns:
            Times as `solve` gives them.

        >>> PiecewisePolynomial([[1], [-0.5]], [0, 2]).roots()  # t - 0.5
        array([0.5])
        """
        return self.solve(0.0, discontinuity)

    def jumps(self, nu: int = 0) -> FloatArray:
        """Measure the jump of the nu-th derivative at each inner break.

        Returns:
            Right-hand minus left-hand value, shape (m-1, ...).

        Raises:
            InputError: `nu` is not an integer, or negative.

        >>> curve = PiecewisePolynomial([[1, -1], [0, 2], [0, 1]], [0, 1, 2])  # t², 1 + 2 s - s²
        >>> curve.jumps(1), curve.jumps(2)
        (array([0.]), array([-4.]))
        """
        c = self.derivative(checked_order(nu)).c
        span = np.diff(self._x)[:-1].reshape(-1, *[1] * (c.ndim - 2))
        return c[-1, 1:] - horner(c[:, :-1], span)

    def extrema(self, nu: int = 0) -> Extrema:
        """Find the minimum and maximum of the nu-th derivative, without sampling.

        Inner extrema come from the polynomials themselves, in closed form up to degree three,
        by bracketed root finding above it. Both one-sided values count at breaks.

        Returns:
            Values and times, of the trailing shape.

        Raises:
            InputError: `nu` is not an integer, or negative.

        >>> found = PiecewisePolynomial([[-1], [1], [0]], [0, 2]).extrema()  # t - t²
        >>> found.maximum, found.maximum_time, found.minimum
        (array(0.25), array(0.5), array(-2.))
        """
        nu = checked_order(nu)
        if nu not in self._extrema:
            flat = find_extrema(self._x, self._derivative_coefficients(nu))
            arrays = (flat.minimum, flat.minimum_time, flat.maximum, flat.maximum_time)
            for values in arrays:
                values.setflags(write=False)
            self._extrema[nu] = Extrema(*(a.reshape(self._c.shape[2:]) for a in arrays))
        return self._extrema[nu]


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
    step = max(1, BLOCK_VALUES // max(1, c.shape[2]))
    if t.size <= step:
        return _evaluate_block(x, c, t)
    values = np.empty((t.size, c.shape[2]))
    for low in range(0, t.size, step):
        values[low : low + step] = _evaluate_block(x, c, t[low : low + step])
    return values


def _evaluate_block(x: FloatArray, c: FloatArray, t: FloatArray) -> FloatArray:
    """Evaluate at times in any order, each with the coefficients of its own piece."""
    piece = x[1:-1].searchsorted(t, side="right")
    terms = c.take(piece, 1)
    # products over contiguous memory take a quarter of the time
    u = (t - x.take(piece)).repeat(c.shape[2]).reshape(t.size, c.shape[2])
    value: FloatArray = terms[0]
    for term in terms[1:]:
        value *= u
        value += term
    return value
