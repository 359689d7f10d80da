"""Alignment of a log with its plan: the shift between their clocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.verification.recording.log_delays import Delay, estimate_delays, fit_delay, plan_at
from knotwork.verification.recording.noise import largest_near
from knotwork.verification.recording.smoothing import ERROR_ORDERS, Smoothed

COARSE_STEPS = 2000
"""Maximum number of steps into which a plan is divided in the search for the shift."""
STANDARD_ERRORS = 4.0
"""Margin, in standard errors, up to which a requirement is undecided."""
PLAN_RESIDUAL_RATIO = 1.5
"""Maximum residual of a noise-free log, as a multiple of that of the smoothed plan."""
PIECE_TIMES = 17
"""Number of times in each piece at which the plan is compared."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """A smoothed log in the time of a plan.

    Attributes:
        trajectory: The motion of the log by the plan's clock, over the part of the plan's time that
            the log covers.
        shift: Time of the log's clock at time 0 of the plan [s].
        shift_error: Standard error of the shift [s], from the residual between log and plan.
        plan: The plan.
        smoothed: The smoothed log, by its own clock.
        lead: Time from the log's first sample to time 0 of the plan [s].
        delays: Spans of the plan's time with the delay of the log in each; the first is on time.
    """

    trajectory: JointTrajectory
    shift: float
    shift_error: float
    plan: JointTrajectory
    smoothed: Smoothed
    lead: float
    delays: tuple[Delay, ...]

    def on_time(self) -> JointTrajectory:
        """The motion without its delays. It jumps where the delay changes."""
        curve, parts = self.smoothed.trajectory.polynomial, []
        for span in self.delays:
            ahead = self.lead + span.delay
            low = max(span.start, self.trajectory.start_time, curve.x[0] - ahead)
            high = min(span.end, self.trajectory.end_time, curve.x[-1] - ahead)
            if low < high:
                parts.append(_shifted_part(curve, low, high, ahead))
        c = np.concatenate([piece.c for piece in parts], axis=1)
        x = np.concatenate([*(piece.x[:-1] for piece in parts), parts[-1].x[-1:]])
        return replace(self.trajectory, polynomial=PiecewisePolynomial(c, x))

    def uncertainty(self, order: int, time: float | None) -> FloatArray:
        """Uncertainty of each joint, from noise and from the residual of the smoothed plan; (d,).

        Args:
            order: Order of the derivative, from 0 for position to 3 for jerk.
            time: Time by the plan's clock [s]; `None` for the largest uncertainty over all time.
        """
        grid, motion = self.smoothed.grid - self.lead, self.trajectory
        ends = (motion.start_time, motion.end_time) if time is None else (time, time)
        first, last = (int(np.abs(grid - end).argmin()) for end in ends)
        noise = self.smoothed.errors[order, first : last + 1].max(axis=0)
        residual = self.residual.errors[order, first : last + 1].max(axis=0)
        return np.asarray(STANDARD_ERRORS * noise + PLAN_RESIDUAL_RATIO * residual)

    @cached_property
    def residual(self) -> PlanResidual:
        """Deviation of the plan from its own smoothed curve with the log's knots."""
        return plan_residual(self.smoothed, self.plan, self.lead)


def aligned(curve: Smoothed, plan: JointTrajectory) -> Alignment:
    """Find the time shift between a log and its plan, and convert the log to the plan's time.

    The log is compared with the plan at every shift, in steps of its sample period. The best shift
    is then improved by least squares between all samples and the polynomials of the plan, which is
    taken to be at rest before and after its time. If the log has delays, the shift is that of its
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
        plan: The plan, with the log's joints in any order.

    Raises:
        InputError: The plan has other joints or never moves; or log and plan have
            no time in common.
    """
    log = curve.log
    plan = plan.reordered(log.joint_names, log.joint_units, owner=log.source)
    begin, end = plan.start_time, plan.end_time
    if not np.abs(plan.extrema(1).peak).max() > 0.0:
        raise InputError("the plan never moves, so the time shift of the log can't be found")
    whole = Delay(-np.inf, np.inf, _coarse_shift(curve, plan))
    lead, error = fit_delay(curve, plan, whole)
    spans = estimate_delays(curve, plan, lead)
    lead = spans[0].delay
    spans = tuple(span._replace(delay=span.delay - lead) for span in spans)
    # a log that only overlaps the plan by its extrapolation still has that part
    first = begin if begin + lead >= curve.trajectory.start_time else log.time[0] - lead
    last = end if end + lead <= curve.trajectory.end_time else log.time[-1] - lead
    if not last > first:
        raise InputError(
            f"{log.source} lasts {log.time[-1]:.6g} s and has no time in common with the plan"
        )
    polynomial = _shifted_part(curve.trajectory.polynomial, first, last, lead)
    trajectory = replace(curve.trajectory, polynomial=polynomial, waypoint_times=None)
    return Alignment(trajectory, lead + log.origin, error, plan, curve, lead, spans)


def _shifted_part(
    curve: PiecewisePolynomial, start: float, end: float, ahead: float
) -> PiecewisePolynomial:
    """Shift a curve to a clock `ahead` seconds behind it, from `start` to `end` of that clock."""
    cut = cut_curve(curve, start + ahead, end + ahead)
    return PiecewisePolynomial(cut.c, np.concatenate(([start], cut.x[1:-1] - ahead, [end])))


def _coarse_shift(curve: Smoothed, plan: JointTrajectory) -> float:
    """The multiple of a step that, as the shift, has the smallest sum of squares [s]."""
    length = curve.log.time[-1]
    step = max(curve.log.period, plan.duration / COARSE_STEPS)
    planned = plan_at(plan, np.arange(plan.start_time, plan.end_time + step, step))
    log = curve.trajectory.position(np.clip(np.arange(0.0, length + step, step), 0.0, length))
    middle, margin = planned.mean(axis=0), len(planned) - 1
    log = np.pad(log - middle, ((margin, margin), (0, 0)), mode="edge")
    planned = planned - middle
    squares = np.concatenate(([0.0], np.cumsum((log**2).sum(axis=1))))
    sums = squares[len(planned) :] - squares[: -len(planned)]
    for j in range(planned.shape[1]):
        sums = sums - 2.0 * np.correlate(log[:, j], planned[:, j], mode="valid")
    return float((int(sums.argmin()) - margin) * step - plan.start_time)


@dataclass(frozen=True, eq=False)
class PlanResidual:
    """Deviation of a plan from a curve with the knots and the weights of a log.

    Attributes:
        samples: Largest deviation of a sample [rad or m], shape (d,).
        errors: Largest deviations of position, velocity, acceleration and jerk near each time of
            the log's grid [rad or m, per s, per s², per s³], shape (4, g, d).
    """

    samples: FloatArray
    errors: FloatArray


def plan_residual(curve: Smoothed, plan: JointTrajectory, lead: float) -> PlanResidual:
    """Smooth a plan like a log, and measure how far the smooth curve is from the plan.

    The residual is taken as zero if the position or velocity of the plan jumps.

    Args:
        curve: The smoothed log.
        plan: The plan, with the log's joints in its order.
        lead: Time from the log's first sample to time 0 of the plan [s].
    """
    time, grid = curve.log.time, curve.grid
    if plan.continuity.order < 1:
        return PlanResidual(np.zeros(len(plan.joint_names)), np.zeros_like(curve.errors))
    position = _extend(plan, time - lead, 0)
    followed = curve.curve_of(position)
    samples = np.abs(position - followed(time))
    # many times in each piece, because the jerk of the plan may jump within it
    breaks, parts = followed.x, np.linspace(0.0, 1.0, PIECE_TIMES)
    fine = (breaks[:-1, None] + np.diff(breaks)[:, None] * parts).ravel()
    # the curve extends beyond log and plan
    fine = fine.clip(min(0.0, lead + plan.start_time), max(time[-1], lead + plan.end_time))
    differences = np.abs(
        [_extend(plan, fine - lead, nu) - followed(fine, nu) for nu in ERROR_ORDERS]
    )
    worst = differences.reshape(len(ERROR_ORDERS), len(breaks) - 1, PIECE_TIMES, -1).max(axis=2)
    # where the knots suit the log but not the plan, the log has another motion
    of_log = _by_piece(curve, np.abs(curve.residuals) + curve.sigma)
    share = np.minimum(1.0, of_log / np.maximum(_by_piece(curve, samples), np.finfo(float).tiny))
    piece = np.clip(np.searchsorted(followed.x, grid, side="right") - 1, 0, len(share) - 1)
    return PlanResidual(
        samples.max(axis=0), share[piece] * largest_near(worst, 1, axis=1)[:, piece]
    )


def _extend(plan: JointTrajectory, time: FloatArray, order: int) -> FloatArray:
    """Evaluate a plan that is extended before and after its time at constant velocity."""
    inside = np.clip(time, plan.start_time, plan.end_time)
    beyond = (time - inside)[:, None]
    values = plan(inside, order)
    if order == 0:
        return np.asarray(values + plan.velocity(inside) * beyond)
    return values if order == 1 else np.where(beyond == 0.0, values, 0.0)


def _by_piece(curve: Smoothed, values: FloatArray) -> FloatArray:
    """The largest value among the samples of each piece and its neighbours, shape (pieces, d)."""
    first = np.searchsorted(curve.log.time, curve.trajectory.breaks[:-1])
    return largest_near(np.maximum.reduceat(values, first, axis=0), 1)
