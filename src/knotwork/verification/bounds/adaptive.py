"""Adaptive proof: samples at the ends of intervals, and a bound on the values between them.

For a vector g(t) and a convex function φ with |φ(x) - φ(y)| <= |x - y|, on an interval of length h

    φ(g(t)) <= max(φ(g(start)), φ(g(end))) + h²/8 · max |g''|,

because g is within h²/8 · max |g''| of its chord, and φ along the chord is at most its larger end.
Intervals with an open verdict are divided.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.critical_points import differentiate, horner
from knotwork.verification.bounds.rate_bounds import Intervals, joint_rates
from knotwork.waypoints import FloatArray

INTERVALS = 500
"""Number of equal intervals of the first division, which is also at every break."""

BUDGET = 20_000
"""Maximum evaluations after the first division; a verdict still open then is not proved."""

ABSURD = 10.0
"""No bound is computed if a sample exceeds a limit by this factor on its size."""

BUDGET_PER_PIECE = 8
"""Minimum budget per piece and coefficient, which is enough for every polynomial."""

PRECISION = 1e-3
"""Tightness of a bound, relative to the largest sample or to the limit."""

FLOOR = 1e-6
"""Resolution of values near zero, relative to the largest that the joints' rates allow."""

TINY = np.finfo(float).tiny

BLOCK = 8192
"""Number of intervals per block, to limit memory."""

MOST_PARTS = 8
"""Maximum parts of one division of an interval."""

ROUNDING = 2.0**-38
"""Rounding error of a value, relative to the bounds of its factors and per radian of joint angles.

A value is a sum of products of at most seven factors: an axis, a lever, an inertia, velocities.
Joint angles have errors of 2⁻⁵² times the degree times the sum of the magnitudes of their terms,
which rotates each factor by as much; other factors have at most 2⁻⁴² (`EVALUATION_ROUNDING`), and
from the base to a tip and back an arm of 30 joints makes about 2,000 roundings of 2⁻⁵³. In total
less than 7·2⁻⁴² + 2,000·7·2⁻⁵³ < 2⁻³⁸."""


class Quantity(NamedTuple):
    """A quantity to bound, with c components.

    Attributes:
        values: Function from joint positions, velocities and accelerations, shape (k, d) each, to
            φ(g), shape (k, c); signed if it is absolute.
        sizes: Function from bounds of the joints' derivatives, shape (5, d, n), to bounds of |g|,
            |g'| and |g''|, shape (3, c, n).
        angles: Whether each joint's position is an angle, shape (d,).
        absolute: Whether the magnitude of the values counts.
    """

    values: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    sizes: Callable[[FloatArray], FloatArray]
    angles: NDArray[np.bool_]
    absolute: bool = False


class Maximum(NamedTuple):
    """Largest samples and upper bounds, by component.

    Attributes:
        value: Largest sample with its sign, shape (c,); infinite if a sample is not finite.
        time: Time of that sample [s], shape (c,).
        bound: Upper bound over the motion, shape (c,).
        proved: Whether the limit is proved to be kept or violated, shape (c,); without a limit,
            whether the bound is as tight as requested.
        evaluations: Number of evaluations of the quantity.
    """

    value: FloatArray
    time: FloatArray
    bound: FloatArray
    proved: NDArray[np.bool_]
    evaluations: int


def maximum(
    curve: PiecewisePolynomial,
    quantity: Quantity,
    limit: FloatArray,
    precision: Callable[[FloatArray, FloatArray], FloatArray] | None = None,
    budget: int = BUDGET,
) -> Maximum:
    """Compute an upper bound of a quantity over a whole motion.

    Args:
        curve: Joint positions, trailing shape (d,).
        quantity: The quantity.
        limit: Limits, shape (c,); infinite for none.
        precision: Function from the largest samples and the largest bounds of |g|, shape (c,) each,
            to the required tightness of the bound where no limit decides, shape (c,); by default a
            fraction of the limit, or of the samples if they are larger.
        budget: Maximum evaluations after the first division, spent where the bounds are worst; the
            usual budget grows with the number of pieces.
    """
    search = _Search(curve, quantity, len(limit))
    span = np.diff(curve.x)
    pieces = Intervals(np.arange(span.size), np.zeros(span.size), span)
    division = _divide(pieces, _first_parts(span))
    values = search.evaluate(division)
    at_start, at_end = values[~division.last], values[~division.first]
    intervals, closed = division.parts, np.full(len(limit), -np.inf)
    if budget >= BUDGET:
        budget = max(budget, BUDGET_PER_PIECE * len(curve.c) * span.size)
    allowance = search.evaluations + budget
    while True:
        excess, rounding = search.excess(intervals)
        ends = np.maximum(at_start, at_end)
        upper = ends + (excess + rounding)
        if precision is None:
            step = _relative_precision(search.value, search.scale, limit)
        else:
            step = precision(search.value, search.scale)
        near = search.value + step
        target = np.where(search.value <= limit, np.minimum(near, limit), near)
        target[search.value > limit + ABSURD * np.abs(limit)] = np.inf
        is_open = (upper > target) & (excess > rounding) & np.isfinite(search.value)
        waiting = is_open.any(axis=1)
        remaining = allowance - search.evaluations
        parts = _parts(excess, np.maximum(target - ends, rounding), is_open)
        waiting = _worst_first(upper - target, is_open, np.where(waiting, parts, 1), remaining)
        if not waiting.any():
            break
        parts = parts[waiting]
        closed = np.maximum(closed, upper[~waiting].max(axis=0, initial=-np.inf))
        division = _divide(intervals[waiting], parts)
        values = np.empty((division.first.size, len(limit)))
        values[division.first], values[division.last] = at_start[waiting], at_end[waiting]
        values[division.inner] = search.evaluate(division, division.inner)
        at_start, at_end = values[~division.last], values[~division.first]
        intervals = division.parts
    bound = np.maximum(closed, upper.max(axis=0))
    decided = np.where(np.isfinite(limit), (bound <= limit) | (search.value > limit), bound <= near)
    return Maximum(search.signed, search.time, bound, decided, search.evaluations)


def _relative_precision(value: FloatArray, scale: FloatArray, limit: FloatArray) -> FloatArray:
    least = np.where(np.isfinite(limit), limit, FLOOR / PRECISION * scale)
    share = np.maximum(np.where(np.isfinite(value), value, 0.0), least)
    return np.asarray(PRECISION * share)


class _Search:
    """Evaluations of a quantity along a curve, and the largest value so far."""

    def __init__(self, curve: PiecewisePolynomial, quantity: Quantity, components: int) -> None:
        self.curve, self.quantity = curve, quantity
        self.value, self.time = np.full(components, -np.inf), np.full(components, curve.x[0])
        self.signed = self.value
        self.scale = np.zeros(components)
        self.evaluations = 0

    def evaluate(
        self, division: _Division, chosen: NDArray[np.bool_] | slice = slice(None)
    ) -> FloatArray:
        """Evaluate at the chosen points of a division, each in its piece; shape (k, c)."""
        piece, local = division.piece[chosen], division.time[chosen]
        coefficients = self.curve.c[:, piece]
        states = []
        for _ in range(3):
            states.append(horner(coefficients, local[:, None]))
            coefficients = (
                differentiate(coefficients) if len(coefficients) > 1 else 0.0 * coefficients
            )
        signed = self.quantity.values(states[0], states[1], states[2])
        signed = np.where(np.isfinite(signed), signed, np.inf)
        values = np.abs(signed) if self.quantity.absolute else signed
        self.evaluations += len(values)
        time = np.minimum(self.curve.x[piece] + local, self.curve.x[piece + 1])
        best = values.argmax(axis=0)
        largest = np.take_along_axis(values, best[None], axis=0)[0]
        larger = largest > self.value
        self.time = np.where(larger, time[best], self.time)
        found = np.take_along_axis(signed, best[None], axis=0)[0]
        self.signed = np.where(larger, found, self.signed)
        self.value = np.where(larger, largest, self.value)
        return values

    def excess(self, intervals: Intervals) -> tuple[FloatArray, FloatArray]:
        """Maximum excess of values over those at the ends, and by rounding, shape (n, c) both."""
        found = []
        for low in range(0, intervals.piece.size, BLOCK):
            block = intervals[low : low + BLOCK]
            with np.errstate(over="ignore", invalid="ignore"):
                rates = joint_rates(self.curve, block)
                sizes = self.quantity.sizes(rates.bounds)
                turned = 1.0 + rates.size[self.quantity.angles].sum(axis=0)
                excess = (1.0 + ROUNDING) / 8.0 * block.length**2 * sizes[2]
                pair = np.stack((excess, ROUNDING * turned * sizes[0]))
            pair[np.isnan(pair)] = np.inf
            self.scale = np.maximum(self.scale, sizes[0].max(axis=1))
            found.append(pair)
        excess, rounding = np.concatenate(found, axis=2).swapaxes(1, 2)
        return excess, rounding


class _Division(NamedTuple):
    """Divided intervals: the ends of the parts, and the parts.

    Attributes:
        piece: Piece of each end, shape (k,).
        time: Time of each end since the start of the piece [s], shape (k,).
        first, last: Whether it starts or ends one of the intervals, shape (k,).
        parts: The intervals between the ends.
    """

    piece: NDArray[np.intp]
    time: FloatArray
    first: NDArray[np.bool_]
    last: NDArray[np.bool_]
    parts: Intervals

    @property
    def inner(self) -> NDArray[np.bool_]:
        """Whether an end is neither the first nor the last of an interval, shape (k,)."""
        return ~(self.first | self.last)


def _divide(intervals: Intervals, parts: NDArray[np.intp]) -> _Division:
    index = np.repeat(np.arange(parts.size), parts + 1)
    step = np.arange(index.size) - np.repeat(np.cumsum(parts + 1) - (parts + 1), parts + 1)
    first, last = step == 0, step == parts[index]
    piece = intervals.piece[index]
    time = intervals.start[index] + intervals.length[index] * (step / parts[index])
    between = Intervals(piece[~last], time[~last], time[~first] - time[~last])
    return _Division(piece, time, first, last, between)


def _first_parts(span: FloatArray) -> NDArray[np.intp]:
    """Number of parts of each piece in the first division, at least two."""
    share = span / span.max()
    share /= share.sum()
    return np.asarray(np.maximum(2, np.ceil(share * INTERVALS)), dtype=np.intp)


def _worst_first(
    beyond: FloatArray, is_open: NDArray[np.bool_], parts: NDArray[np.intp], remaining: int
) -> NDArray[np.bool_]:
    """Whether each open interval is divided: those with the largest excess, within the budget.

    Args:
        beyond: Excess of each bound over its target, shape (n, c).
        is_open: Whether that leaves a verdict open, shape (n, c).
        parts: Number of parts for each interval, shape (n,).
        remaining: Remaining evaluations.
    """
    waiting = is_open.any(axis=1)
    if int((parts - 1).sum()) <= remaining:
        return np.asarray(waiting)
    most = np.where(is_open, beyond, 0.0).max(axis=0)
    with np.errstate(over="ignore"):
        share = np.where(is_open, beyond / np.maximum(most, TINY), -np.inf).max(axis=1)
    order = np.argsort(-share, kind="stable")
    chosen = np.zeros(len(parts), dtype=bool)
    chosen[order[np.cumsum(parts[order] - 1) <= remaining]] = True
    return np.asarray(chosen & waiting)


def _parts(excess: FloatArray, allowed: FloatArray, is_open: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Number of parts for each interval with which the excess falls to the allowed one."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        needed = np.sqrt(np.where(is_open, excess / allowed, 0.0)).max(axis=1)
    return np.asarray(np.clip(np.ceil(needed), 2, MOST_PARTS), dtype=np.intp)
