"""Tightening of the solver's limits until the exact curve keeps the limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.timing.robot_limits import (
    robot_limits,
    sampled_utilisation,
    unproved_utilisation,
)
from knotwork.planning.timing.spline import pieces_each
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.waypoints import FloatArray

SAMPLE_MARGIN = 1e-4
"""Relative margin of effort and tool speed for values between the samples."""

SOLVER_MARGIN = 1e-6
"""Relative margin to each limit, larger than the solver's tolerance."""

CURVE_SLACK = 1e-10
"""Relative rounding tolerance of limits."""


@dataclass(frozen=True, eq=False)
class Tightening:
    """Margins of the limits, and the limits between the breaks that the solver has.

    Attributes:
        margin: Relative margin to each limit.
        position: Whether positions between the breaks are limited.
        held: Allowed fractions of the limits of `ROBOT_LIMITS` that the solver has, by name: see
            `held_blocks`.
    """

    margin: float = SOLVER_MARGIN
    position: bool = False
    held: Mapping[str, FloatArray] = field(default_factory=dict)

    def same_equations(self, following: Tightening) -> bool:
        """Whether the solver has the same equations with another tightening."""
        return self.position == following.position and self.held.keys() == following.held.keys()


def first_tightening(problem: TimingProblem) -> Tightening:
    """Tightening of a first solution.

    It includes efforts only if no other quantity limits a joint.
    """
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isfinite(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        intervals = len(problem.position) - 1
        used = np.zeros((pieces_each(intervals) * intervals, len(unlimited)))
        return Tightening(held={"effort": _allowed_fractions(None, used)})
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
    beyond = outside(problem, curve)
    if beyond and not tightening.position:
        return replace(tightening, position=True)
    if beyond or _exceeded_rate(problem, curve) is not None:
        return replace(tightening, margin=10.0 * tightening.margin)
    over = exceeded_limit(problem, curve)
    if over is None:
        return None
    name, used = over
    held = _allowed_fractions(tightening.held.get(name), used)
    return replace(tightening, held={**tightening.held, name: held})


def _allowed_fractions(before: FloatArray | None, used: FloatArray) -> FloatArray:
    """Allowed fractions of a limit for the solver.

    The first ones leave a margin; later ones are reduced in and around pieces that exceed it.

    Args:
        before: Fractions that the solver had, if it had the limit.
        used: Use of the limit in each piece, shape (pieces, d or 1).
    """
    pieces, width = used.shape
    if before is None:
        return np.full((2 * pieces + 1, width), 1.0 - SAMPLE_MARGIN)
    allowed = np.array(before)
    over = used > 1.0 - 0.5 * SAMPLE_MARGIN
    factor = np.where(over, 1.0 - 1.2 * (1.0 - (1.0 - SAMPLE_MARGIN) / np.maximum(used, 0.5)), 1.0)
    for first, last in ((0, -1), (1, None), (2, None)):
        allowed[first:last:2] *= factor
    return allowed


def exceeded_limit(
    problem: TimingProblem, curve: PiecewisePolynomial
) -> tuple[str, FloatArray] | None:
    """The first limit of `ROBOT_LIMITS` that a curve is not proved to keep, or `None`.

    Returns:
        Name of the limit, and its use in each piece.
    """
    for name in robot_limits(problem):
        used = sampled_utilisation(problem, curve, name)
        if used.max() <= 1.0 - 0.5 * SAMPLE_MARGIN:
            used = unproved_utilisation(problem, curve, name)
            if used.max() <= 1.0:
                continue
        return name, used
    return None


def keeps_limits(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a curve keeps every limit, for any pieces."""
    return not outside(problem, curve) and first_excess(problem, curve) is None


def first_excess(problem: TimingProblem, curve: PiecewisePolynomial) -> tuple[str, int] | None:
    """The first limit that a curve is not proved to keep, apart from positions, and its joint.

    Returns:
        Name of the limit and index of the joint, 0 for the tool; `None` if all are kept.
    """
    if (rate := _exceeded_rate(problem, curve)) is not None:
        return rate
    over = exceeded_limit(problem, curve)
    return None if over is None else (over[0], int(over[1].max(axis=0).argmax()))


def _exceeded_rate(problem: TimingProblem, curve: PiecewisePolynomial) -> tuple[str, int] | None:
    """The velocity, acceleration or jerk limit exceeded by the exact extrema, and its joint."""
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        utilisation = curve.extrema(order).peak / getattr(problem.limits, name)
        if utilisation.max() > 1.0 + CURVE_SLACK:
            return name, int(utilisation.argmax())
    return None


def outside(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a position is outside its limits, by the exact extrema."""
    positions = curve.extrema(0)
    slack = CURVE_SLACK * np.maximum(1.0, np.abs(problem.position).max(axis=0))
    below = positions.minimum < problem.limits.lower - slack
    return bool((below | (positions.maximum > problem.limits.upper + slack)).any())
