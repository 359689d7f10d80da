"""Gaps of a log during its plan."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.refined import cut_curve
from knotwork.verification import Finding
from knotwork.verification.recording.alignment import Alignment
from knotwork.waypoints import FloatArray

GAP_PERIODS = 5.5
"""Number of periods without a sample beyond which there is a gap."""
MOVING_GAP_PERIODS, MOVING_GAP_RANGE = 1.75, 0.1
"""Number of periods without a sample beyond which there is a gap if a joint of the plan moves
meanwhile by more than this fraction of its whole range."""
REST_DEVIATIONS = 4.0
"""Motion of a plan, in standard deviations of the noise, below which it is at rest."""


def hole_findings(alignment: Alignment) -> Iterator[Finding]:
    """Report each gap in the plan's time, in which the motion of the robot is unknown.

    It fails if the plan moves there; at rest it is a warning. The smoothed curve continues in
    a gap, but only as a guess, and so do all findings on it.
    """
    plan, log = alignment.reference, alignment.curve.log
    time = log.time - alignment.start
    known = np.concatenate(([plan.start_time], time, [plan.end_time]))
    known = np.sort(np.clip(known, plan.start_time, plan.end_time))
    far = MOVING_GAP_RANGE * _range(plan.polynomial)
    for i in np.flatnonzero(np.diff(known) > MOVING_GAP_PERIODS * log.period):
        start, end = float(known[i]), float(known[i + 1])
        moved = _range(cut_curve(plan.polynomial, start, end))
        moves = moved > REST_DEVIATIONS * alignment.curve.noise.position
        is_far = (moves & (moved > far)).any()
        allowed = MOVING_GAP_PERIODS if is_far else GAP_PERIODS
        if end - start > allowed * log.period:
            yield _gap_finding((start, end), log.period, allowed, moves=bool(moves.any()))


def _range(curve: PiecewisePolynomial) -> FloatArray:
    """Range of motion of each joint, shape (d,)."""
    extrema = curve.extrema(0)
    return extrema.maximum - extrema.minimum


def _gap_finding(
    interval: tuple[float, float], period: float, allowed: float, *, moves: bool
) -> Finding:
    start, end = interval
    duration, limit = end - start, allowed * period
    plan_text = (
        "moves there, so the motion of the robot is undecided"
        if moves
        else "is at rest there, which the log does not confirm"
    )
    fact = (
        f"the log has no sample from {start:.3f} s to {end:.3f} s: {duration:.4g} s, "
        f"{duration / period:.3g} times its interval of {1e3 * period:.4g} ms; the plan {plan_text}"
    )
    return Finding(
        "Log", "motion", "", "hole", "failed" if moves else "warning", fact, value=duration,
        limit=limit, margin=limit - duration, unit="s", time=start, interval=interval,
    )  # fmt: skip
