"""The proof: samples at the ends of intervals, and a bound on the values between them.

For a vector g(t) and a convex function φ with |φ(x) - φ(y)| <= |x - y|, on an interval of length h

    φ(g(t)) <= max(φ(g(start)), φ(g(end))) + h²/8 · max |g''|,

because g is within h²/8 · max |g''| of its chord, and φ along the chord is at most its larger end.
Intervals are divided where that leaves a verdict open.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.critical_points import differentiate, horner
from knotwork.verification.bounds.polynomials import Intervals, joint_rates
from knotwork.waypoints import FloatArray

INTERVALS = 500
"""The motion is first divided into this many equal intervals, and at every break."""

BUDGET = 20_000
"""Evaluations after the first division. A verdict that is still open then is not proved."""

ABSURD = 10.0
"""No bound is sought where a sample is beyond a limit by this times its size: it is broken."""

BUDGET_PER_PIECE = 8
"""Evaluations for each piece, times the number of its coefficients, if these are more: enough
for everything that a polynomial does."""

PRECISION = 1e-3
"""How near a bound comes to the largest value found, relative to that or to the limit."""

FLOOR = 1e-6
"""Resolution of values near zero, as a fraction of the largest that the joints' rates allow."""

TINY = np.finfo(float).tiny

BLOCK = 8192
"""Intervals whose bounds are computed together, so that the temporaries stay small."""

MOST_PARTS = 8
"""An interval is divided into at most this many at a time."""

ROUNDING = 2.0**-38
"""Rounding of a value, relative to the bounds of its factors and per radian of joint angles.

A value is a sum of products of at most seven factors: an axis, a lever, an inertia, velocities.
Joint angles are rounded by 2⁻⁵² times the degree times the sum of the sizes of their terms, which
turns each factor by as much; other factors have at most 2⁻⁴² (`EVALUATION_ROUNDING`), and on the
way from the base to a tip and back an arm of 30 joints makes some 2,000 roundings of 2⁻⁵³. In all
less than 7·2⁻⁴² + 2,000·7·2⁻⁵³ < 2⁻³⁸."""


class Quantity(NamedTuple):
    """A quantity to be bounded, in c components.

    Attributes:
        values: From joint positions, velocities and accelerations, shape (k, d) each, to φ(g),
            shape (k, c); if it is absolute, with its sign.
        sizes: From bounds of the joints' derivatives, shape (5, d, n), to those of |g|, |g'| and
            |g''|, shape (3, c, n).
        angles: Which joints' positions are angles, shape (d,).
        absolute: Whether the magnitude of the values counts.
    """

    values: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    sizes: Callable[[FloatArray], FloatArray]
    angles: NDArray[np.bool_]
    absolute: bool = False


class Maximum(NamedTuple):
    """The largest values found, and what no value exceeds, by component.

    Attributes:
        value: Largest sample, shape (c,), with its sign; infinite if one is not a finite number.
        time: When [s], shape (c,).
        bound: What the quantity does not exceed at any time, shape (c,).
        proved: Whether it is proved that the limit is kept, or that it is not, shape (c,); without
            a limit, whether the bound is as near to the samples as asked for.
        evaluations: How often the quantity was evaluated.
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
    """Bound a quantity over a whole motion from above.

    Args:
        curve: Joint positions, trailing shape (d,).
        quantity: What to bound.
        limit: What it is compared with, shape (c,); infinite for none.
        precision: From the largest samples and the largest bounds of |g|, shape (c,) each, how near
            the bound has to come to the samples, shape (c,), where no limit decides; by default a
            part of the limit, or of the samples if they are larger.
        budget: How many evaluations may follow the first division; the usual budget grows with the
            number of pieces. They are spent where the bounds are worst.
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
    """Evaluates a quantity along a curve and keeps the largest value that it has seen."""

    def __init__(self, curve: PiecewisePolynomial, quantity: Quantity, components: int) -> None:
        self.curve, self.quantity = curve, quantity
        self.value, self.time = np.full(components, -np.inf), np.full(components, curve.x[0])
        self.signed = self.value
        self.scale = np.zeros(components)
        self.evaluations = 0

    def evaluate(
        self, division: _Division, chosen: NDArray[np.bool_] | slice = slice(None)
    ) -> FloatArray:
        """Evaluate at the chosen points of a division, each in its own piece; shape (k, c)."""
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
        """How far values may lie above those at the ends, and by rounding, shape (n, c) both."""
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
    """Intervals divided: all ends of the parts, and the parts.

    Attributes:
        piece: Piece of each end, shape (k,).
        time: Where it is, from the start of the piece on [s], shape (k,).
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
    """Into how many parts to divide each piece at first; none is looked at at its ends alone."""
    share = span / span.max()
    share /= share.sum()
    return np.asarray(np.maximum(2, np.ceil(share * INTERVALS)), dtype=np.intp)


def _worst_first(
    beyond: FloatArray, is_open: NDArray[np.bool_], parts: NDArray[np.intp], remaining: int
) -> NDArray[np.bool_]:
    """The open intervals with bounds farthest beyond their targets, as many as the budget allows.

    Args:
        beyond: How far each bound is beyond its target, shape (n, c).
        is_open: Where that leaves a verdict open, shape (n, c).
        parts: Into how many parts each interval is to be divided, shape (n,).
        remaining: How many evaluations are left.
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
    """Into how many parts to divide each interval, so that the excess falls to what is allowed."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        needed = np.sqrt(np.where(is_open, excess / allowed, 0.0)).max(axis=1)
    return np.asarray(np.clip(np.ceil(needed), 2, MOST_PARTS), dtype=np.intp)
