"""A log compared with its plan: the shift of its clock, and the deviation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from knotwork.errors import InputError
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.refined import cut_curve
from knotwork.spline.trajectory import JointTrajectory
from knotwork.verification.recording.lateness import Delay, delays
from knotwork.verification.recording.likeness import PlanResidual, plan_residual
from knotwork.verification.recording.smoothing import Smoothed
from knotwork.waypoints import FloatArray

COARSE_STEPS = 2000
"""Number of steps of a plan in the search for the shift."""
MOST_SHIFT_STEPS = 50
STANDARD_ERRORS = 4.0
"""Number of standard errors beyond which a margin counts."""
PLAN_RESIDUAL_RATIO = 1.5
"""Largest residual of a noise-free log, as a multiple of that of the smoothed plan."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """A smoothed log in the time of a plan.

    Attributes:
        trajectory: The motion of the log, in the plan's order of joints, by the plan's clock and
            within the plan's time as far as the log reaches.
        shift: Time of the log's clock at time 0 of the plan [s].
        shift_error: Standard error of the shift [s], from the residual between log and plan.
        reference: The plan.
        curve: The smoothed log, by its own clock.
        start: The shift since the log's first sample [s].
        delays: Delays of the log over the plan's time; its first span is on time.
    """

    trajectory: JointTrajectory
    shift: float
    shift_error: float
    reference: JointTrajectory
    curve: Smoothed
    start: float
    delays: tuple[Delay, ...]

    def on_time(self) -> JointTrajectory:
        """The motion without its delays; it jumps where they change."""
        curve, parts = self.curve.trajectory.polynomial, []
        for delay in self.delays:
            ahead = self.start + delay.late
            low = max(delay.start, self.trajectory.start_time, curve.x[0] - ahead)
            high = min(delay.end, self.trajectory.end_time, curve.x[-1] - ahead)
            if low < high:
                parts.append(_shifted_part(curve, low, high, ahead))
        c = np.concatenate([piece.c for piece in parts], axis=1)
        x = np.concatenate([*(piece.x[:-1] for piece in parts), parts[-1].x[-1:]])
        return replace(self.trajectory, polynomial=PiecewisePolynomial(c, x))

    def uncertainty(self, order: int, time: float | None) -> FloatArray:
        """Uncertainty of each joint, by noise and by the residual of the smoothed plan; (d,).

        Args:
            order: 0 for the position to 3 for the jerk.
            time: Time by the plan's clock [s]; `None` for the largest over the plan's time.
        """
        grid, motion = self.curve.grid - self.start, self.trajectory
        ends = (motion.start_time, motion.end_time) if time is None else (time, time)
        first, last = (int(np.abs(grid - end).argmin()) for end in ends)
        noise, residual = (
            errors[order, first : last + 1].max(axis=0)
            for errors in (self.curve.errors, self.residual.errors)
        )
        return np.asarray(STANDARD_ERRORS * noise + PLAN_RESIDUAL_RATIO * residual)

    @cached_property
    def residual(self) -> PlanResidual:
        """Deviation of the plan from its own smoothed curve with the log's knots."""
        return plan_residual(self.curve, self.reference, self.start)


def aligned(curve: Smoothed, reference: JointTrajectory) -> Alignment:
    """Find the time shift between a log and its plan, and convert the log to the plan's time.

    The log is compared with the plan at every shift, in steps of its sample period; then the best
    shift is improved by least squares between all samples and the plan's polynomials. Before and
    after its time the plan is at rest. If there are delays within the log, the shift is that of its
    beginning.

    >>> plan = kw.plan("paper_case")
    >>> time = np.arange(0.0, 25.0, 0.05)
    >>> log = np.column_stack([time + 3, plan.trajectory.position(time)])
    >>> np.savetxt("log.csv", log, "%.4f", ",", header="time,joint_1", comments="")
    >>> recorded = kw.recording.read_log("log.csv", ["joint_1"], ["rad"])
    >>> shift = aligned(kw.recording.smoothed(recorded), plan.trajectory).shift
    >>> round(shift, 3)
    3.0

    Args:
        curve: The smoothed log.
        reference: The plan, with the log's joints in any order.

    Raises:
        InputError: The plan has other joints or never moves; or log and plan have
            no time in common.
    """
    log = curve.log
    reference = reference.reordered(log.joint_names, log.joint_units, owner=log.source)
    begin, end = reference.start_time, reference.end_time
    if not np.abs(reference.extrema(1).peak).max() > 0.0:
        raise InputError("the plan never moves, so the time shift of the log can't be found")
    shift, error = _refine_shift(curve, reference, _coarse_shift(curve, reference))
    spans = delays(curve, reference, shift)
    first_late = spans[0].late
    spans = tuple(span._replace(late=span.late - first_late) for span in spans)
    shift += first_late
    # a log without more of the plan than its extrapolation still has that part
    first = begin if begin + shift >= curve.trajectory.start_time else log.time[0] - shift
    last = end if end + shift <= curve.trajectory.end_time else log.time[-1] - shift
    if not last > first:
        raise InputError(
            f"{log.source} lasts {log.time[-1]:.6g} s and has no time in common with the plan"
        )
    polynomial = _shifted_part(curve.trajectory.polynomial, first, last, shift)
    trajectory = replace(curve.trajectory, polynomial=polynomial, waypoint_times=None)
    return Alignment(trajectory, shift + log.origin, error, reference, curve, shift, spans)


def _shifted_part(
    curve: PiecewisePolynomial, start: float, end: float, ahead: float
) -> PiecewisePolynomial:
    """Part of a curve between two times of a clock over which it is ahead [s], by that clock."""
    cut = cut_curve(curve, start + ahead, end + ahead)
    return PiecewisePolynomial(cut.c, np.concatenate(([start], cut.x[1:-1] - ahead, [end])))


def _extend_plan(reference: JointTrajectory, time: FloatArray, order: int = 0) -> FloatArray:
    """The plan at any times; at rest before and after its own."""
    inside = np.clip(time, reference.start_time, reference.end_time)
    values = reference(inside, order)
    if order:
        values = np.where((inside == time)[:, None], values, 0.0)
    return np.asarray(values)


def _coarse_shift(curve: Smoothed, reference: JointTrajectory) -> float:
    """The shift with the smallest sum of squares, in steps."""
    length = curve.log.time[-1]
    step = max(curve.log.period, reference.duration / COARSE_STEPS)
    plan = _extend_plan(reference, np.arange(reference.start_time, reference.end_time + step, step))
    log = curve.trajectory.position(np.clip(np.arange(0.0, length + step, step), 0.0, length))
    middle, margin = plan.mean(axis=0), len(plan) - 1
    log, plan = np.pad(log - middle, ((margin, margin), (0, 0)), mode="edge"), plan - middle
    squares = np.concatenate(([0.0], np.cumsum((log**2).sum(axis=1))))
    sums = squares[len(plan) :] - squares[: -len(plan)]
    for j in range(plan.shape[1]):
        sums = sums - 2.0 * np.correlate(log[:, j], plan[:, j], mode="valid")
    return float((int(sums.argmin()) - margin) * step - reference.start_time)


def _refine_shift(curve: Smoothed, reference: JointTrajectory, shift: float) -> tuple[float, float]:
    """The shift by least squares of all samples (Gauss-Newton), and its error."""
    time, q = curve.log.time, curve.log.position
    for _ in range(MOST_SHIFT_STEPS):
        slopes = _extend_plan(reference, time - shift, 1)
        residuals = q - _extend_plan(reference, time - shift)
        weight = float((slopes**2).sum())
        if weight == 0.0:
            return shift, np.inf
        step = float((slopes * residuals).sum()) / weight
        shift -= step
        if abs(step) < 1e-12 * max(1.0, abs(shift)):
            break
    moving = slopes.any(axis=1)
    return shift, float(np.sqrt((residuals[moving] ** 2).mean() / weight))
