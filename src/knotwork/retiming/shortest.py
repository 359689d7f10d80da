"""The minimum-time clock that stops within the limits, by a sequence of linear programs.

The stop takes T, divided into parts of given fractions. The second derivative of the clock's rate
is constant in each part, and rate, slope of the rate and clock value are linear in it. The use of
limits is linearised about the last clock; T is minimised within a shrinking trust region, with a
penalty on violations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.distinct import distinct
from knotwork.retiming.clock import inverse_time
from knotwork.waypoints import FloatArray

BREAKS = np.concatenate(((0.0, 0.006, 0.014, 0.025, 0.04, 0.06), np.linspace(0.09, 1.0, 25)))
"""Ends of the parts of a stop in [0, 1]: shorter at first, where the motion may be at limits."""
PARTS = len(BREAKS) - 1
STEPS = 18
"""Maximum number of linear programs."""
SETTLED = 1e-5
"""Relative change of the duration at convergence."""
REGION = 0.3
"""First trust region, as a relative change of the duration."""
SHRINK = 0.75
"""Factor of the trust region from one program to the next."""
CHANGE = 6.0
"""Maximum change of the rate's slope over a whole stop, for a trust region of 1."""
PENALTY = 10.0
"""Penalty of exceeding a limit by 100 %, relative to the first guess of T."""
ASIDE = 1e-9
"""Distance of the samples on both sides of a break, relative to the duration."""


class Use(NamedTuple):
    """Signed use of limits at samples, relative, shape (samples, d).

    With the rate s of the clock the acceleration is q₂ s² + q₁ s', and the jerk
    q₃ s³ + 3 q₂ s s' + q₁ s'', where qₖ is the k-th derivative of the curve. Limits are raised to
    the values of the curve itself, so that a constant rate always keeps them.
    """

    acceleration: FloatArray
    jerk: FloatArray
    slopes: tuple[FloatArray, FloatArray]
    """Derivatives of both over clock value, s, s', s'', shape (4, samples, d)."""


def use(
    curve: PiecewisePolynomial,
    clock: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    acceleration: FloatArray,
    jerk: FloatArray,
) -> Use:
    """Compute a clock's use of the limits.

    Args:
        curve: Positions, trailing shape (d,).
        clock: Clock values within the curve's time, s, s' and s'', shape (samples,) each.
        acceleration: Acceleration limits, shape (d,); infinite where there is none.
        jerk: Jerk limits, shape (d,).
    """
    q1, q2, q3 = (curve(clock[0], nu) for nu in (1, 2, 3))
    s, change, bend = (one[:, None] for one in clock[1:])
    most = np.maximum(acceleration, np.abs(q2 * s**2))
    jolt = np.maximum(jerk, np.abs(q3 * s**3))
    zero = np.zeros_like(q1)
    by_acceleration = np.array([q3 * s**2 + q2 * change, 2.0 * q2 * s, q1, zero])
    by_jerk = np.array(
        [
            3.0 * q3 * s * change + q2 * bend,
            3.0 * q3 * s**2 + 3.0 * q2 * change,
            3.0 * q2 * s,
            q1,
        ]
    )
    return Use(
        (q2 * s**2 + q1 * change) / most,
        (q3 * s**3 + 3.0 * q2 * s * change + q1 * bend) / jolt,
        (by_acceleration / most, by_jerk / jolt),
    )


def shortest_stop(
    curve: PiecewisePolynomial,
    start: float,
    end: float,
    guess: float,
    acceleration: FloatArray,
    jerk: FloatArray,
) -> PiecewisePolynomial | None:
    """The minimum-time clock with a rate from 1 to 0, within [0, 1] (C2 smooth).

    Args:
        curve: Positions, trailing shape (d,).
        start: First value of the clock.
        end: Maximum last value.
        guess: Approximate duration.
        acceleration: Acceleration limits, shape (d,); infinite where there is none.
        jerk: Jerk limits, shape (d,).

    Returns:
        The clock, from time 0 on; `None` if none was found.
    """
    search = _Search(curve, start, end, guess, acceleration, jerk)
    bend, length, region = 12.0 * search.middle - 6.0, guess, REGION
    for _ in range(STEPS):
        step = search.step(bend, length, region)
        if step is None:
            return None
        bend, length = bend + step[0], length + step[1]
        region *= SHRINK
        if abs(step[1]) < SETTLED * min(1.0, region) * length:
            break
    clock = search.clock(bend, length)
    return clock if float(clock(clock.x[-1])) <= end else None


class _Search:
    """Linear programs for a stop; unknowns are the second derivatives of the rate, and T."""

    def __init__(
        self,
        curve: PiecewisePolynomial,
        start: float,
        end: float,
        guess: float,
        acceleration: FloatArray,
        jerk: FloatArray,
    ) -> None:
        self.curve, self.start, self.end, self.guess = curve, start, end, guess
        self.limits = acceleration, jerk
        self.middle = 0.5 * (BREAKS[1:] + BREAKS[:-1])
        # second derivative of the rate, slope, rate and clock in [0, 1], by the unknowns
        unit = PiecewisePolynomial(np.eye(PARTS)[None], BREAKS)
        self.curves = tuple(unit.antiderivative(nu) for nu in range(4))
        self.change, self.rate, self.time = (one(BREAKS) for one in self.curves[1:])

    def shown(self, bend: FloatArray, length: float) -> float:
        """Last value of the clock."""
        return self.start + length * (1.0 + float(self.time[-1] @ bend))

    def samples(self, bend: FloatArray, length: float) -> FloatArray:
        """Points in [0, 1] on both sides of the ends of all parts, and of the curve's pieces."""
        inner = self.curve.x[(self.curve.x > self.start) & (self.curve.x < self.end)]
        clock = self.clock(bend, length)
        inner = inner[inner < clock(length)]
        breaks = distinct(BREAKS, inverse_time(clock, inner) / length)
        beside = np.concatenate((breaks[:-1] + ASIDE, breaks[1:] - ASIDE, self.middle))
        return np.clip(beside, 0.0, 1.0)

    def used(self, bend: FloatArray, length: float, at: FloatArray) -> tuple[Use, FloatArray]:
        """Use of limits at points in [0, 1], and its derivatives by the unknowns.

        The derivatives are those of clock value, s, s' and s'', shape (4, points, parts + 1).
        """
        bends, change, rate, time = (one(at) for one in self.curves)
        passed, slope = at + time @ bend, change @ bend
        clock = (
            np.clip(self.start + length * passed, self.curve.x[0], self.curve.x[-1]),
            1.0 + rate @ bend,
            slope / length,
            bends @ bend / length**2,
        )
        by_bend = length * time, rate, change / length, bends / length**2
        by_length = passed, 0.0 * passed, -clock[2] / length, -2.0 * clock[3] / length
        both = [np.column_stack(one) for one in zip(by_bend, by_length, strict=True)]
        return use(self.curve, clock, *self.limits), np.stack(both)

    def step(
        self, bend: FloatArray, length: float, region: float
    ) -> tuple[FloatArray, float] | None:
        """The best change of the unknowns within a trust region, by the linearised limits."""
        from scipy.optimize import linprog

        found, inner = self.used(bend, length, self.samples(bend, length))
        values = np.concatenate((found.acceleration.ravel(), found.jerk.ravel()))
        slopes = np.concatenate(
            [np.einsum("ksd,ksx->sdx", one, inner).reshape(-1, PARTS + 1) for one in found.slopes]
        )
        end = np.append(self.time[-1], (1.0 + self.time[-1] @ bend) / length)
        soft = np.concatenate((slopes, -slopes, end[None]))
        room = (self.end - self.shown(bend, length)) / length
        bound = np.concatenate((1.0 - values, 1.0 + values, [room]))
        # the rate stays within [0, 1], and its slope in the trust region
        rate, slope = (np.pad(one[1:], ((0, 0), (0, 1))) for one in (self.rate, self.change))
        now = 1.0 + self.rate[1:] @ bend
        hard = np.concatenate((rate, -rate, slope, -slope))
        most = np.concatenate((1.0 - now, now, np.full(2 * len(now), CHANGE * region)))
        excess = np.append(np.ones(len(soft)), np.zeros(len(hard)))
        ends = np.pad(np.stack((self.rate[-1], self.change[-1])), ((0, 0), (0, 2)))
        cost = np.zeros(PARTS + 2)
        cost[PARTS:] = 1.0 / self.guess, PENALTY
        solved = linprog(
            cost,
            A_ub=np.column_stack((np.concatenate((soft, hard)), -excess)),
            b_ub=np.append(bound, most),
            A_eq=ends,
            b_eq=[-now[-1], -self.change[-1] @ bend],
            bounds=[(None, None)] * PARTS + [(-region * length, region * length), (0.0, None)],
            method="highs",
        )
        return None if solved.x is None else (solved.x[:PARTS], float(solved.x[PARTS]))

    def clock(self, bend: FloatArray, length: float) -> PiecewisePolynomial:
        """The clock over time."""
        c = self.curves[3].c @ bend
        c[-2] += 1.0
        c[-1] += BREAKS[:-1]
        c *= length ** (1.0 - np.arange(len(c))[::-1, None])
        c[-1] += self.start
        return PiecewisePolynomial(c, length * BREAKS)
