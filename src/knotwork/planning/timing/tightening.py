"""Tightening of the solver's limits until the exact curve keeps the limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.joint_quantities import RATE_QUANTITIES
from knotwork.planning.timing.robot_limits import sampled_utilisation, unproved_utilisation
from knotwork.planning.timing.spline import pieces_per_interval
from knotwork.planning.timing.timing_problem import TimingProblem

SAMPLE_MARGIN = 1e-4
"""Relative margin of effort and tool speed for values between the samples."""

SOLVER_MARGIN = 1e-6
"""Relative margin to each limit, larger than the solver's tolerance."""

CURVE_SLACK = 1e-10
"""Relative rounding tolerance of limits, smaller than the `LIMIT_SLACK` of the check."""


@dataclass(frozen=True, eq=False)
class Tightening:
    """Margins of the limits, and the limits between the breaks that the solver has.

    Attributes:
        margin: Relative margin to each limit.
        limits_positions: Whether positions between the breaks are limited.
        allowed_utilisation: Allowed utilisation of the limits in `FRACTIONS_IN_PIECE` that the
            solver has, by name: see `robot_limit_blocks`.
    """

    margin: float = SOLVER_MARGIN
    limits_positions: bool = False
    allowed_utilisation: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def kinds_of_limits(self) -> tuple[bool, set[str]]:
        """Kinds of limits that the solver has in addition to those at the breaks."""
        return self.limits_positions, set(self.allowed_utilisation)


def first_tightening(problem: TimingProblem) -> Tightening:
    """Tightening of a first solution.

    It includes efforts only if no other quantity limits a joint.
    """
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isfinite(limits.effort)
    if problem.objective.time and problem.duration_is_unknown.any() and unlimited.any():
        intervals = len(problem.position) - 1
        utilisation = np.zeros((pieces_per_interval(intervals) * intervals, len(unlimited)))
        return Tightening(allowed_utilisation={"effort": _allowed_utilisation(None, utilisation)})
    return Tightening()


def tighten(
    problem: TimingProblem, tightening: Tightening, curve: PiecewisePolynomial
) -> Tightening | None:
    """Compare a curve with all limits.

    Args:
        problem: The problem.
        tightening: Tightening of the solution.
        curve: The exact curve of the solution.

    Returns:
        The next tightening, or `None` if every limit is kept.
    """
    beyond = exceeds_position_limits(problem, curve)
    if beyond and not tightening.limits_positions:
        return replace(tightening, limits_positions=True)
    over = None if beyond else exceeded_limit(problem, curve)
    if beyond or (over is not None and over[0] in RATE_QUANTITIES):
        return replace(tightening, margin=10.0 * tightening.margin)
    if over is None:
        return None
    name, utilisation = over
    allowed = dict(tightening.allowed_utilisation)
    allowed[name] = _allowed_utilisation(allowed.get(name), utilisation)
    return replace(tightening, allowed_utilisation=allowed)


def _allowed_utilisation(before: FloatArray | None, utilisation: FloatArray) -> FloatArray:
    """Allowed utilisation of a limit for the solver.

    At first it leaves a margin. Later it is reduced in and around the pieces that exceed the limit.

    Args:
        before: Allowed utilisation in the previous solution, if it had the limit.
        utilisation: Utilisation of the limit in each piece, shape (pieces, d or 1).
    """
    pieces, width = utilisation.shape
    if before is None:
        return np.full((2 * pieces + 1, width), 1.0 - SAMPLE_MARGIN)
    allowed = np.array(before)
    over = utilisation > 1.0 - 0.5 * SAMPLE_MARGIN
    factor = 1.0 - 1.2 * (1.0 - (1.0 - SAMPLE_MARGIN) / np.maximum(utilisation, 0.5))
    for first, last in ((0, -1), (1, None), (2, None)):
        allowed[first:last:2] *= np.where(over, factor, 1.0)
    return allowed


def exceeded_limit(
    problem: TimingProblem, curve: PiecewisePolynomial
) -> tuple[str, FloatArray] | None:
    """The first limit that a curve is not proved to keep, positions aside, or `None`.

    Returns:
        Name of the limit, and its utilisation, shape (k, d or 1): in each piece for
        `FRACTIONS_IN_PIECE`, over the whole curve for velocity, acceleration and jerk.
    """
    for order, name in enumerate(RATE_QUANTITIES, 1):
        utilisation = curve.extrema(order).peak / problem.limits[name]
        if (utilisation > 1.0 + CURVE_SLACK).any():
            return name, utilisation[None]
    for name, utilisation in sampled_utilisation(problem, curve).items():
        if utilisation.max() <= 1.0 - 0.5 * SAMPLE_MARGIN:
            unproved = unproved_utilisation(problem, curve, name)
            if unproved.max() > 1.0:
                return name, unproved
        else:
            return name, utilisation
    return None


def keeps_limits(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a curve keeps every limit, for any pieces."""
    return not exceeds_position_limits(problem, curve) and exceeded_limit(problem, curve) is None


def exceeds_position_limits(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a position is outside its limits, by the exact extrema."""
    positions = curve.extrema(0)
    slack = CURVE_SLACK * np.maximum(1.0, np.abs(problem.position).max(axis=0))
    below = positions.minimum < problem.limits.lower - slack
    return bool((below | (positions.maximum > problem.limits.upper + slack)).any())
