"""How the limits are tightened for the solver until the exact curve keeps them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.efforts import (
    effort_shares,
    proved_efforts,
    proved_tool,
    tool_shares,
)
from knotwork.timing.problem import BoolArray, TimingProblem
from knotwork.timing.spline import pieces_each
from knotwork.waypoints import FloatArray, IndexArray

Shares = Callable[[TimingProblem, PiecewisePolynomial], FloatArray]

BETWEEN = 1e-4
"""Part of the limits of effort and tool speed kept as a margin between the samples."""

KNOWN = 2.0
"""Part of a limit that the solver is allowed where a value is given, which nothing can change."""


MARGIN = 1e-6
"""Part of each limit that the solver leaves, so that its tolerance never shows as a violation."""

SLACK = 1e-10
"""A limit counts as kept if it is exceeded by no more than this part of it: rounding."""


@dataclass(frozen=True, eq=False)
class Tightening:
    """Margins of the limits, and which limits the solver has between the breaks.

    Attributes:
        margin: Part of each limit that is left.
        position: Whether positions between the breaks are limited.
        effort: Part of the effort limits that is allowed at each break and inside each piece, by
            turns, shape (2 pieces + 1, d); `None` where efforts are not limited.
        tool: Part of the limit of the tool's speed, shape (2 pieces + 1, 1), or `None`.
    """

    margin: float = MARGIN
    position: bool = False
    effort: FloatArray | None = None
    tool: FloatArray | None = None


def first_tightening(problem: TimingProblem) -> Tightening:
    """Limits of a first solution: efforts only if nothing else limits a joint."""
    limits = problem.limits
    unlimited = np.isinf(limits.acceleration) & np.isinf(limits.jerk) & np.isfinite(limits.effort)
    if problem.objective.time and problem.free.any() and unlimited.any():
        return first_efforts(problem)
    return Tightening()


def first_efforts(problem: TimingProblem) -> Tightening:
    """Tightening for efforts too, nowhere more than elsewhere."""
    known = problem.velocity_known & problem.acceleration_known
    return Tightening(effort=_all_allowed(problem, len(problem.limits.effort), known))


def _all_allowed(problem: TimingProblem, width: int, known: BoolArray) -> FloatArray:
    """First parts of the limits: nearly all, and more where a value is known."""
    intervals = len(problem.position) - 1
    allowed = np.full((2 * pieces_each(intervals) * intervals + 1, width), 1.0 - BETWEEN)
    allowed[_rows(problem)[known]] = KNOWN
    return allowed


def equations_of(tightening: Tightening) -> tuple[bool, bool, bool]:
    """Which equations it takes."""
    return tightening.position, tightening.effort is not None, tightening.tool is not None


def tightened(
    problem: TimingProblem, tightening: Tightening, curve: PiecewisePolynomial
) -> Tightening | None:
    """Compare a curve with all limits.

    Returns:
        What to hold the solver to next, or `None` if every limit is kept.
    """
    over = excess(problem, curve)
    if "position" in over and not tightening.position:
        return replace(tightening, position=True)
    if over:
        return replace(tightening, margin=10.0 * tightening.margin)
    if problem.dynamics is None:
        return None
    if np.isfinite(problem.limits.effort).any():
        shares = exceeded(problem, curve, effort_shares, proved_efforts)
        if shares is not None:
            known = problem.velocity_known & problem.acceleration_known
            return replace(tightening, effort=_less(problem, tightening.effort, shares, known))
    if np.isfinite(problem.limits.tool_speed):
        shares = exceeded(problem, curve, tool_shares, proved_tool)
        if shares is not None:
            return replace(
                tightening, tool=_less(problem, tightening.tool, shares, problem.velocity_known)
            )
    return None


def keeps_limits(problem: TimingProblem, curve: PiecewisePolynomial) -> bool:
    """Whether a curve keeps every limit, whatever its pieces are."""
    looks = []
    if np.isfinite(problem.limits.effort).any():
        looks.append((effort_shares, proved_efforts))
    if np.isfinite(problem.limits.tool_speed):
        looks.append((tool_shares, proved_tool))
    over = excess(problem, curve) or any(
        exceeded(problem, curve, *look) is not None for look in looks
    )
    return not over


def exceeded(
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


def excess(problem: TimingProblem, curve: PiecewisePolynomial) -> dict[str, float]:
    """By how much a curve exceeds the limits of its joints' motion, relative to each limit.

    By its exact extrema; only the limits that are exceeded.
    """
    found = {}
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        over = float((curve.extrema(order).peak / getattr(problem.limits, name)).max()) - 1.0
        if over > SLACK:
            found[name] = over
    positions = curve.extrema(0)
    lower, upper = problem.limits.lower, problem.limits.upper
    size = np.maximum(1.0, np.maximum(np.abs(problem.position).max(axis=0), 0.0))
    over = float((np.maximum(lower - positions.minimum, positions.maximum - upper) / size).max())
    if over > SLACK:
        found["position"] = over
    return found
