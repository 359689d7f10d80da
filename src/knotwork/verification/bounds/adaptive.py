"""Adaptive proof: samples at the ends of intervals, and a bound on the values between them.

For a vector g(t) and a convex function φ with |φ(x) - φ(y)| <= |x - y|, on an interval of length h

    φ(g(t)) <= max(φ(g(start)), φ(g(end))) + h²/8 · max |g''|,

because g is within h²/8 · max |g''| of its chord, and φ along the chord is at most its larger end.
Intervals with an undecided verdict are divided.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.critical_points import differentiate, horner
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors.arguments import require_number
from knotwork.robot import Robot
from knotwork.verification.bounds.rate_bounds import Intervals, first_intervals, joint_rates

FIRST_INTERVALS = 500
"""Approximate number of intervals of the first division, which is also at every break."""

EVALUATION_BUDGET = 20_000
"""Maximum number of evaluations after the first division.

A verdict that is still undecided then is not proved.
"""

EVALUATIONS_PER_PIECE = 8
"""Minimum budget per piece and coefficient, sufficient for every polynomial."""

MAX_EXCESS = 10.0
"""Excess of a sample over a limit, relative to the limit, above which no bound is computed."""

BOUND_PRECISION = 1e-3
"""Tightness of a bound, relative to the largest sample or to the limit."""

VALUE_FLOOR = 1e-6
"""Resolution of values near zero, relative to the largest value that the rates of the joints
allow.
"""

MIN_EXCESS = np.finfo(float).tiny
"""Excess in place of zero, so that others can be divided by it."""

BLOCK_INTERVALS = 8192
"""Number of intervals per block, to limit memory."""

DIVISION = 4
"""Number of parts into which an undecided interval is divided."""

VALUE_ROUNDING = 2.0**-38
"""Rounding error of a value, relative to the bounds of its factors and per radian of joint angles.

A value is a sum of products of at most seven factors: an axis, a lever, an inertia, velocities.
Joint angles have errors of 2⁻⁵² times the degree times the sum of the magnitudes of their terms,
and each factor is rotated by this error. Other factors have errors of at most 2⁻⁴²
(`EVALUATION_ROUNDING`). For an arm of 30 joints there are about 2,000 roundings of 2⁻⁵³ from the
base to a tip and back. The total is less than 7·2⁻⁴² + 2,000·7·2⁻⁵³ < 2⁻³⁸.
"""


class Quantity(NamedTuple):
    """A quantity to bound, with c components.

    Attributes:
        values: Function from joint positions, velocities and accelerations, shape (k, d) each, to
            φ(g), shape (k, c); signed if it is absolute.
        rate_bounds: Function from bounds of the joints' derivatives, shape (5, d, n), to bounds
            of |g|, |g'| and |g''|, shape (3, c, n).
        angles: Whether each joint's position is an angle, shape (d,).
        absolute: Whether φ is the magnitude, so that signed values are compared by magnitude.
    """

    values: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    rate_bounds: Callable[[FloatArray], FloatArray]
    angles: BoolArray
    absolute: bool = False


def upper_bounds(
    curve: PiecewisePolynomial,
    quantity: Quantity,
    limits: FloatArray,
    precision: Callable[[FloatArray, FloatArray], FloatArray] | None = None,
) -> tuple[Bound, ...]:
    """Bound each component of a quantity over a whole motion.

    Args:
        curve: Joint positions, trailing shape (d,).
        quantity: The quantity.
        limits: Upper limits, shape (c,); infinite for none.
        precision: Function from the largest samples and the largest bounds of |g|, shape (c,) each,
            to the tightness that the bound must have where no limit decides, shape (c,). By default
            it is a fraction of the limit, or of the largest sample if that is larger.
    """
    precision = precision or partial(_relative_precision, limit=limits)
    search = _Evaluations(curve, quantity, len(limits))
    intervals = first_intervals(curve.x, FIRST_INTERVALS)
    at_start, at_end = search.evaluate_ends(intervals)
    closed = np.full(len(limits), -np.inf)
    coefficients = curve.c.shape[0] * curve.c.shape[1]
    allowance = search.count + max(EVALUATION_BUDGET, EVALUATIONS_PER_PIECE * coefficients)
    while True:
        excess, rounding = search.measure_excess(intervals)
        upper = np.maximum(at_start, at_end) + (excess + rounding)
        near = search.value + precision(search.value, search.scale)
        target = np.where(search.value <= limits, np.minimum(near, limits), near)
        target[search.value > limits + MAX_EXCESS * np.abs(limits)] = np.inf
        is_open = (upper > target) & (excess > rounding) & np.isfinite(search.value)
        count = max(allowance - search.count, 0) // DIVISION
        divided = _worst_intervals(upper - target, is_open, count)
        if not divided.any():
            break
        closed = np.maximum(closed, upper[~divided].max(axis=0, initial=-np.inf))
        intervals = intervals[divided].split(DIVISION)
        at_start, at_end = search.evaluate_parts(intervals, at_end[divided])
    bound = np.maximum(closed, upper.max(axis=0))
    decided = np.where(
        np.isfinite(limits), (bound <= limits) | (search.value > limits), bound <= near
    )
    return tuple(
        Bound(
            value=float(search.signed[i]),
            time=float(search.time[i]),
            bound=float(bound[i]),
            limit=float(limit) if np.isfinite(limit) else None,
            ok=bool(abs(search.signed[i]) <= limit),
            proved=bool(decided[i]),
        )
        for i, limit in enumerate(limits)
    )


def _relative_precision(value: FloatArray, scale: FloatArray, limit: FloatArray) -> FloatArray:
    minimum = np.where(np.isfinite(limit), limit, VALUE_FLOOR / BOUND_PRECISION * scale)
    reference = np.maximum(np.where(np.isfinite(value), value, 0.0), minimum)
    return np.asarray(BOUND_PRECISION * reference)


class _Evaluations:
    """Evaluations of a quantity along a curve, and the largest value so far."""

    def __init__(self, curve: PiecewisePolynomial, quantity: Quantity, components: int) -> None:
        self.curve, self.quantity = curve, quantity
        self.value, self.time = np.full(components, -np.inf), np.full(components, curve.x[0])
        self.signed = self.value
        self.scale = np.zeros(components)
        self.count = 0

    def evaluate_ends(self, intervals: Intervals) -> tuple[FloatArray, FloatArray]:
        """Evaluate at both ends of consecutive intervals, each within its piece; (n, c) both."""
        at_start = self._evaluate(intervals.piece, intervals.start)
        last = np.append(np.diff(intervals.piece) != 0, True)
        at_end = np.roll(at_start, -1, axis=0)
        ends = intervals[last]
        at_end[last] = self._evaluate(ends.piece, ends.start + ends.duration)
        return at_start, at_end

    def evaluate_parts(
        self, intervals: Intervals, at_end: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Evaluate at both ends of the parts of intervals, given the values at their ends."""
        at_start = self._evaluate(intervals.piece, intervals.start)
        inner = at_start.reshape(-1, DIVISION, at_start.shape[1])[:, 1:]
        ends = np.append(inner, at_end[:, None], axis=1)
        return at_start, ends.reshape(at_start.shape)

    def _evaluate(self, piece: IndexArray, local: FloatArray) -> FloatArray:
        """Values at times since the start of pieces [s], shape (k, c)."""
        c = self.curve.c[:, piece]
        states = []
        for _ in range(3):
            states.append(horner(c, local[:, None]))
            c = differentiate(c) if len(c) > 1 else 0.0 * c
        signed = self.quantity.values(*states)
        signed = np.where(np.isfinite(signed), signed, np.inf)
        values = np.abs(signed) if self.quantity.absolute else signed
        self.count += len(values)
        best, component = values.argmax(axis=0), np.arange(values.shape[1])
        largest = values[best, component]
        larger = largest > self.value
        time = np.minimum(self.curve.x[piece] + local, self.curve.x[piece + 1])
        self.time = np.where(larger, time[best], self.time)
        self.signed = np.where(larger, signed[best, component], self.signed)
        self.value = np.where(larger, largest, self.value)
        return values

    def measure_excess(self, intervals: Intervals) -> tuple[FloatArray, FloatArray]:
        """Bound the excess over the values at the ends, and the rounding errors, (n, c) both.

        This also updates `scale`, the largest bound on the values so far.
        """
        blocks = []
        for low in range(0, intervals.piece.size, BLOCK_INTERVALS):
            block = intervals[low : low + BLOCK_INTERVALS]
            with np.errstate(over="ignore", invalid="ignore"):
                rates = joint_rates(self.curve, block)
                bounds = self.quantity.rate_bounds(rates.bounds)
                turned = 1.0 + rates.size[self.quantity.angles].sum(axis=0)
                excess = (1.0 + VALUE_ROUNDING) / 8.0 * block.duration**2 * bounds[2]
                pair = np.stack((excess, VALUE_ROUNDING * turned * bounds[0]))
            pair[np.isnan(pair)] = np.inf
            self.scale = np.maximum(self.scale, bounds[0].max(axis=1))
            blocks.append(pair)
        excess, rounding = np.concatenate(blocks, axis=2).swapaxes(1, 2)
        return excess, rounding


def _worst_intervals(beyond: FloatArray, is_open: BoolArray, count: int) -> BoolArray:
    """Select the intervals to divide: the undecided ones that are farthest beyond their targets.

    Args:
        beyond: Excess of each bound over its target, shape (n, c).
        is_open: Whether the excess leaves a verdict undecided, shape (n, c).
        count: Maximum number of intervals to divide.

    Returns:
        Whether each interval is divided, shape (n,).
    """
    largest = np.where(is_open, beyond, 0.0).max(axis=0)
    with np.errstate(over="ignore"):
        excess = np.where(is_open, beyond / np.maximum(largest, MIN_EXCESS), -np.inf).max(axis=1)
    divided = np.zeros(len(excess), dtype=bool)
    divided[np.argsort(-excess, kind="stable")[:count]] = True
    return divided & is_open.any(axis=1)


class Bound(NamedTuple):
    """The worst value of a quantity over a whole motion, and its proved bound.

    >>> plan = kw.plan("ur5_deburring")
    >>> bound = kw.verification.tool_speed_bound(plan.joints.robot, plan.trajectory, limit=1.0)
    >>> bound.ok, bound.proved, bound.value <= bound.bound <= 1.0
    (True, True, True)

    Attributes:
        value: The worst sample; infinite if a sample is not finite.
        time: Time of that sample [s].
        bound: Upper bound of the magnitude at all times, or lower bound of the smallest singular
            value, including rounding.
        limit: The limit, or `None`.
        ok: Whether all samples keep the limit.
        proved: Whether `ok` is proved, because the bound keeps the limit or a sample exceeds it.
            Without a limit, whether the bound is as tight as requested. If false, the budget was
            exhausted, and only samples are known.
    """

    value: float
    time: float
    bound: float
    limit: float | None
    ok: bool
    proved: bool

    @property
    def proof_gap(self) -> float:
        """Difference between the bound and the worst sample."""
        return abs(self.bound - abs(self.value))


def checked_limit(limit: float | None, quantity: str) -> float:
    """Return a limit as a number, infinite for none.

    Raises:
        InputError: The limit is not a positive number.
    """
    if limit is None or (isinstance(limit, float) and limit == math.inf):
        return math.inf
    return require_number(limit, f"the limit of the {quantity}", positive=True)


def curve_of(robot: Robot, trajectory: JointTrajectory) -> PiecewisePolynomial:
    """Return the motion of a robot's joints in the robot's order.

    Raises:
        InputError: The trajectory moves other joints than the robot's.
    """
    owner = f"robot {robot.name!r}"
    return trajectory.reordered(robot.joint_names, robot.joint_units, owner=owner).polynomial
