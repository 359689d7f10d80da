"""The clock of the shortest stop within the limits, by a sequence of linear programs.

The unknowns are the duration T and the second derivative of the clock's rate, constant in each of
30 parts of T. Rate, slope of the rate and value of the clock are linear in the latter. Utilisation
of the limits is linearised about the last clock, by differences. Each program minimises T within a
shrinking trust region, with a penalty on violations.
"""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.polynomial.monotone import first_times
from knotwork.joint_quantities import JointLimits

STOP_BREAKS = np.concatenate(((0.0, 0.006, 0.014, 0.025, 0.04, 0.06), np.linspace(0.09, 1.0, 25)))
"""Ends of the parts of a stop in [0, 1]: shorter at first, where the motion may be at limits."""
STOP_PARTS = len(STOP_BREAKS) - 1
MIDDLES = 0.5 * (STOP_BREAKS[1:] + STOP_BREAKS[:-1])
MAX_PROGRAMS = 18
"""Maximum number of linear programs. Then the trust region is 0.2 % of the duration."""
SETTLED_DURATION = 1e-5
"""Relative change of the duration at convergence."""
FIRST_REGION, REGION_FACTOR = 0.3, 0.75
"""Initial trust region, as a relative change of the duration, and its factor after each program."""
SLOPE_CHANGE = 6.0
"""Maximum change of the rate's slope over a whole stop, for a trust region of 1."""
EXCESS_PENALTY = 10.0
"""Penalty of exceeding a limit by 100 %, relative to the first guess of T."""
BREAK_OFFSET = 1e-6
"""Distance of the samples on both sides of a break, relative to the duration."""
DIFFERENCE_STEP = 1e-8
"""Relative change of an unknown for the derivatives: about the root of the resolution of floats."""


def find_shortest_stop(
    curve: PiecewisePolynomial,
    start: float,
    end: float,
    guess: float,
    limits: JointLimits,
) -> PiecewisePolynomial | None:
    """Find the shortest clock whose rate goes from 1 to 0, within [0, 1] (C2 smooth).

    Args:
        curve: Positions, trailing shape (d,).
        start: First value of the clock.
        end: Maximum last value.
        guess: Approximate duration.
        limits: Limits, of which those of acceleration and jerk are kept.

    Returns:
        The clock, from time 0 on; `None` if none was found.
    """
    program = _StopProgram(curve, start, end, np.stack((limits.acceleration, limits.jerk)))
    unknowns, region = np.append(12.0 * MIDDLES - 6.0, guess), FIRST_REGION
    for _ in range(MAX_PROGRAMS):
        change = program.best_change(unknowns, region, guess)
        if change is None:
            return None
        unknowns, region = unknowns + change, region * REGION_FACTOR
        if abs(change[-1]) < SETTLED_DURATION * min(1.0, region) * unknowns[-1]:
            break
    clock = program.clock(unknowns)
    return clock if float(clock(clock.x[-1])) <= end else None


class _StopProgram:
    """Linear programs for a stop; unknowns are the second derivatives of the rate, and T."""

    def __init__(
        self, curve: PiecewisePolynomial, start: float, end: float, limits: FloatArray
    ) -> None:
        self.curve, self.start, self.end, self.limits = curve, start, end, limits
        # second derivative of the rate, slope, rate and clock in [0, 1], by the unknowns
        unit = PiecewisePolynomial(np.eye(STOP_PARTS)[None], STOP_BREAKS)
        self.curves = tuple(unit.antiderivative(nu) for nu in range(4))

    def clock(self, unknowns: FloatArray) -> PiecewisePolynomial:
        """The clock over time."""
        length = unknowns[-1]
        c = self.curves[3].c @ unknowns[:-1]
        c[-2] += 1.0
        c[-1] += STOP_BREAKS[:-1]
        c *= length ** (1.0 - np.arange(len(c))[::-1, None])
        c[-1] += self.start
        return PiecewisePolynomial(c, length * STOP_BREAKS)

    def _sample_points(self, unknowns: FloatArray) -> FloatArray:
        """Sample points in [0, 1] on both sides of the ends of parts and of the curve's pieces."""
        clock = self.clock(unknowns)
        inner = self.curve.x[(self.curve.x > self.start) & (self.curve.x < self.end)]
        inner = inner[inner < clock(unknowns[-1])]
        breaks = sort_distinct(STOP_BREAKS, first_times(clock, inner) / unknowns[-1])
        sides = np.concatenate((breaks[:-1] + BREAK_OFFSET, breaks[1:] - BREAK_OFFSET, MIDDLES))
        return np.clip(sides, 0.0, 1.0)

    def _accelerations_and_jerks(
        self, unknowns: FloatArray, points: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Compute accelerations and jerks at points in [0, 1], and at constant rates, (2, m, d).

        With the rate s of the clock the acceleration is q₂ s² + q₁ s', and the jerk
        q₃ s³ + 3 q₂ s s' + q₁ s'', where qₖ is the k-th derivative of the curve.
        """
        length = unknowns[-1]
        ds2, ds, s, time = (curve(points) @ unknowns[:-1] for curve in self.curves)
        value = self.start + length * (points + time)
        value = np.clip(value, self.curve.x[0], self.curve.x[-1])
        s, ds, ds2 = (x[:, None] for x in (1.0 + s, ds / length, ds2 / length**2))
        q1, q2, q3 = (self.curve(value, nu) for nu in (1, 2, 3))
        steady = np.stack((q2 * s**2, q3 * s**3))
        return steady + np.stack((q1 * ds, 3.0 * q2 * s * ds + q1 * ds2)), steady

    def best_change(self, unknowns: FloatArray, region: float, guess: float) -> FloatArray | None:
        """Find the best change of the unknowns within a trust region, by the linearised limits."""
        from scipy.optimize import linprog

        bend, length = unknowns[:-1], unknowns[-1]
        points = self._sample_points(unknowns)
        values, steady = self._accelerations_and_jerks(unknowns, points)
        # limits are raised to the values of the curve, so that a constant rate keeps them
        limits = np.maximum(self.limits[:, None], np.abs(steady))
        steps = DIFFERENCE_STEP * np.diag(np.append(np.ones(STOP_PARTS), length))
        columns = []
        for step in steps:
            changed, _ = self._accelerations_and_jerks(unknowns + step, points)
            columns.append(((changed - values) / limits).ravel() / step.sum())
        slopes = np.stack(columns, axis=1)
        utilisation = (values / limits).ravel()
        change, rate, time = (curve(STOP_BREAKS[1:]) for curve in self.curves[1:])
        passed = 1.0 + time[-1] @ bend
        end = np.append(time[-1], passed / length)
        soft = np.concatenate((slopes, -slopes, end[None]))
        margin = (self.end - self.start) / length - passed
        bound = np.concatenate((1.0 - utilisation, 1.0 + utilisation, [margin]))
        # the rate stays within [0, 1], and its slope in the trust region
        now = 1.0 + rate @ bend
        hard = np.pad(np.concatenate((rate, -rate, change, -change)), ((0, 0), (0, 1)))
        hard_bound = np.concatenate((1.0 - now, now, np.full(2 * len(now), SLOPE_CHANGE * region)))
        excess = np.append(np.ones(len(soft)), np.zeros(len(hard)))
        solution = linprog(
            [*np.zeros(STOP_PARTS), 1.0 / guess, EXCESS_PENALTY],
            A_ub=np.column_stack((np.concatenate((soft, hard)), -excess)),
            b_ub=np.append(bound, hard_bound),
            A_eq=np.pad(np.stack((rate[-1], change[-1])), ((0, 0), (0, 2))),
            b_eq=[-now[-1], -change[-1] @ bend],
            bounds=[(None, None)] * STOP_PARTS + [(-region * length, region * length), (0.0, None)],
            method="highs",
        )
        return None if solution.x is None else solution.x[:-1]
