"""What the solver is held to, and with what margin, until a curve passes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.efforts import (
    effort_shares,
    proved_efforts,
    proved_tool,
    tool_shares,
)
from knotwork.timing.problem import BoolArray, TimingProblem
from knotwork.timing.section import Care, excess
from knotwork.timing.spline import pieces_each
from knotwork.waypoints import FloatArray

IndexArray = NDArray[np.intp]

Shares = Callable[[TimingProblem, PiecewisePolynomial], FloatArray]

BETWEEN = 1e-4
"""Part of the limits of effort and tool speed that is left between the places looked at."""

KNOWN = 2.0
"""Part of a limit that the solver is allowed where a value is given, which nothing can change."""


def first_care(problem: TimingProblem) -> Care:
    """What a first solution is held to: efforts only if nothing else limits a joint."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isfinite(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        return first_efforts(problem)
    return Care()


def first_efforts(problem: TimingProblem) -> Care:
    """Care for efforts too, nowhere more than elsewhere."""
    known = problem.velocity_known & problem.acceleration_known
    return Care(effort=_all_allowed(problem, len(problem.limits.effort), known))


def _all_allowed(problem: TimingProblem, width: int, known: BoolArray) -> FloatArray:
    """What is allowed at first: nearly all, and more where a value is known."""
    intervals = len(problem.position) - 1
    allowed = np.full((2 * pieces_each(intervals) * intervals + 1, width), 1.0 - BETWEEN)
    allowed[_rows(problem)[known]] = KNOWN
    return allowed


def form_of_care(care: Care) -> tuple[bool, bool, bool]:
    """Which equations it takes."""
    return care.position, care.effort is not None, care.tool is not None


def more_care(problem: TimingProblem, care: Care, curve: PiecewisePolynomial) -> Care | None:
    """Compare a curve with all limits.

    Returns:
        What to hold the solver to next, or `None` if every limit is kept.
    """
    over = excess(problem, curve)
    if "position" in over and not care.position:
        return replace(care, position=True)
    if over:
        return replace(care, margin=10.0 * care.margin)
    if problem.dynamics is None:
        return None
    if np.isfinite(problem.limits.effort).any():
        shares = _exceeded(problem, curve, effort_shares, proved_efforts)
        if shares is not None:
            known = problem.velocity_known & problem.acceleration_known
            return replace(care, effort=_less(problem, care.effort, shares, known))
    if np.isfinite(problem.limits.tool_speed):
        shares = _exceeded(problem, curve, tool_shares, proved_tool)
        if shares is not None:
            return replace(care, tool=_less(problem, care.tool, shares, problem.velocity_known))
    return None


def keeps_limits(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a curve keeps every limit, whatever its pieces are."""
    looks = []
    if np.isfinite(problem.limits.effort).any():
        looks.append((effort_shares, proved_efforts))
    if np.isfinite(problem.limits.tool_speed):
        looks.append((tool_shares, proved_tool))
    over = excess(problem, curve) or any(
        _exceeded(problem, curve, *look) is not None for look in looks
    )
    return not over


def _exceeded(
    problem: TimingProblem, curve: PiecewisePolynomial, looked_at: Shares, proved: Shares
) -> FloatArray | None:
    """Parts of a limit that each piece takes if the limit is exceeded; else it is kept, proved."""
    shares = looked_at(problem, curve)
    if shares.max() <= 1.0 - 0.5 * BETWEEN:
        shares = proved(problem, curve)
        if shares.max() <= 1.0:
            return None
    return shares


def _less(
    problem: TimingProblem, allowed: FloatArray | None, shares: FloatArray, known: BoolArray
) -> FloatArray:
    """Allow less in the pieces in which a limit is exceeded, and at their ends.

    At waypoints where the value is known nothing can be asked for.
    """
    if allowed is None:
        return _all_allowed(problem, shares.shape[1], known)
    over = shares > 1.0 - 0.5 * BETWEEN
    factor = np.where(over, 1.0 - 1.2 * (1.0 - (1.0 - BETWEEN) / np.maximum(shares, 0.5)), 1.0)
    less = np.array(allowed)
    for first, last in ((0, -1), (1, None), (2, None)):
        less[first:last:2] *= factor
    less[_rows(problem)[known]] = KNOWN
    return less


def _rows(problem: TimingProblem) -> IndexArray:
    """Where the waypoints are among the breaks and middles of the pieces."""
    intervals = len(problem.position) - 1
    return np.arange(intervals + 1) * 2 * pieces_each(intervals)
