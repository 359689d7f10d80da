"""Tightening of the solver's limits until the exact curve keeps the limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from knotwork.planning.timing.efforts import effort_shares, proved_efforts, proved_tool, tool_shares
from knotwork.planning.timing.problem import BoolArray, TimingProblem
from knotwork.planning.timing.spline import pieces_each
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.waypoints import FloatArray, IndexArray

BETWEEN = 1e-4
"""Relative margin of effort and tool speed for values between the samples."""

KNOWN = 2.0
"""Factor on a limit for the solver where a value is given and can't change."""

MARGIN = 1e-6
"""Relative margin to each limit, larger than the solver's tolerance."""

SLACK = 1e-10
"""Relative rounding tolerance of limits."""

CHECKS = {
    "effort": (effort_shares, proved_efforts),
    "tool_speed": (tool_shares, proved_tool),
}
"""Limits that depend on the robot: functions of their use at samples of a curve, and proved."""


@dataclass(frozen=True, eq=False)
class Tightening:
    """Margins of the limits, and the limits between the breaks that the solver has.

    Attributes:
        margin: Relative margin to each limit.
        position: Whether positions between the breaks are limited.
        held: Allowed fraction of the limits of `CHECKS`, alternately at each break and inside each
            piece, shape (2 pieces + 1, d or 1), for the limits that the solver has.
        places: Whether they are constraints at each of these places, by name, shape
            (2 pieces + 1,); by default at all.
    """

    margin: float = MARGIN
    position: bool = False
    held: Mapping[str, FloatArray] = field(default_factory=dict)
    places: Mapping[str, BoolArray] = field(default_factory=dict)

    def same_equations(self, other: Tightening) -> bool:
        """Whether the solver has the same equations with another tightening."""
        return self.position == other.position and self.held.keys() == other.held.keys()


def first_tightening(problem: TimingProblem) -> Tightening:
    """Tightening of a first solution: with efforts only if nothing else limits a joint."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isfinite(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        intervals = len(problem.position) - 1
        pieces = pieces_each(intervals) * intervals
        return Tightening(held={"effort": _all_allowed(problem, "effort", pieces)})
    return Tightening()


def _given(problem: TimingProblem, name: str) -> BoolArray:
    """Whether the limited value at each waypoint is given, shape (n,)."""
    known = problem.velocity_known
    return known & problem.acceleration_known if name == "effort" else known


def _all_allowed(problem: TimingProblem, name: str, pieces: int) -> FloatArray:
    """First fractions of a limit: nearly 1, and more where a value is given."""
    width = np.size(getattr(problem.limits, name))
    allowed = np.full((2 * pieces + 1, width), 1.0 - BETWEEN)
    allowed[_rows(problem, pieces)[_given(problem, name)]] = KNOWN
    return allowed


def tightened(
    problem: TimingProblem,
    tightening: Tightening,
    curve: PiecewisePolynomial,
    near: float | None = None,
) -> Tightening | None:
    """Compare a curve with all limits.

    Args:
        problem: The problem.
        tightening: Tightening of the solution.
        curve: The exact curve of the solution.
        near: Fraction of limits of `CHECKS` above which they become constraints in a piece; by
            default they are constraints everywhere.

    Returns:
        The next tightening, or `None` if every limit is kept.
    """
    beyond = outside(problem, curve)
    if beyond and not tightening.position:
        return replace(tightening, position=True)
    if beyond or too_fast(problem, curve):
        return replace(tightening, margin=10.0 * tightening.margin)
    over = exceeded(problem, curve)
    if over is None:
        return None
    name, shares = over
    allowed = tightening.held.get(name)
    if allowed is None:
        less = _all_allowed(problem, name, len(curve.x) - 1)
    else:
        less = _less(problem, name, allowed, shares)
    places = tightening.places
    if near is not None:
        taken = np.repeat(shares.max(axis=1) > near, 2)
        both = np.append(taken, False) | np.insert(taken, 0, False)
        places = {**places, name: both | places.get(name, False)}
    return replace(tightening, held={**tightening.held, name: less}, places=places)


def exceeded(problem: TimingProblem, curve: PiecewisePolynomial) -> tuple[str, FloatArray] | None:
    """The first limit of `CHECKS` that a curve is not proved to keep, or `None`.

    Returns:
        Name of the limit, and its use in each piece.
    """
    for name, (sampled, proved) in CHECKS.items():
        if not np.isfinite(getattr(problem.limits, name)).any():
            continue
        shares = sampled(problem, curve)
        if shares.max() <= 1.0 - 0.5 * BETWEEN:
            shares = proved(problem, curve)
            if shares.max() <= 1.0:
                continue
        return name, shares
    return None


def keeps_limits(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a curve keeps every limit, for any pieces."""
    return tightened(problem, Tightening(), curve) is None


def _less(problem: TimingProblem, name: str, allowed: FloatArray, shares: FloatArray) -> FloatArray:
    """Reduce the allowed values in the pieces in which a limit is exceeded, and at their ends.

    Given values at waypoints are not constrained.
    """
    over = shares > 1.0 - 0.5 * BETWEEN
    factor = np.where(over, 1.0 - 1.2 * (1.0 - (1.0 - BETWEEN) / np.maximum(shares, 0.5)), 1.0)
    less = np.array(allowed)
    for first, last in ((0, -1), (1, None), (2, None)):
        less[first:last:2] *= factor
    less[_rows(problem, len(shares))[_given(problem, name)]] = KNOWN
    return less


def _rows(problem: TimingProblem, pieces: int) -> IndexArray:
    """Indices of the waypoints among the breaks and middles of the pieces."""
    intervals = len(problem.position) - 1
    return np.arange(intervals + 1) * 2 * (pieces // intervals)


def too_fast(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a velocity, acceleration or jerk exceeds its limit, by the exact extrema."""
    return any(
        (curve.extrema(order).peak > getattr(problem.limits, name) * (1.0 + SLACK)).any()
        for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk"))
    )


def outside(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a position is outside its limits, by the exact extrema."""
    positions = curve.extrema(0)
    slack = SLACK * np.maximum(1.0, np.abs(problem.position).max(axis=0))
    below = positions.minimum < problem.limits.lower - slack
    return bool((below | (positions.maximum > problem.limits.upper + slack)).any())
