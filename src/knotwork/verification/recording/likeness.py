"""Residual of a plan smoothed with the knots of a log.

If the jerk or the acceleration of a motion jumps, no smooth curve follows it, however exact a log
is. A log of the plan then deviates from its curve as the plan's own samples deviate from theirs,
and the curve deviates from the motion by as much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.spline.trajectory import JointTrajectory
from knotwork.verification.recording.noise import largest_near
from knotwork.verification.recording.smoothing import ERROR_ORDERS, Smoothed
from knotwork.waypoints import FloatArray

PIECE_TIMES = 17
"""Number of times in each piece at which the plan is compared."""


@dataclass(frozen=True, eq=False)
class PlanResidual:
    """Deviation of a plan from a curve with the knots and the weights of a log.

    Attributes:
        samples: Largest distance of its samples [rad or m], shape (d,).
        errors: Distances of position, velocity, acceleration and jerk in the piece of each time of
            the log's grid or next to it [rad or m, per s, per s², per s³], shape (4, g, d).
    """

    samples: FloatArray
    errors: FloatArray


def plan_residual(curve: Smoothed, plan: JointTrajectory, start: float) -> PlanResidual:
    """Smooth a plan like a log; zero residuals for a plan that jumps in position or velocity.

    Args:
        curve: The smoothed log.
        plan: The plan, with the log's joints in its order.
        start: The plan's time 0 since the log's first sample [s].
    """
    time, grid = curve.log.time, curve.grid
    if plan.continuity.order < 1:
        return PlanResidual(np.zeros(len(plan.joint_names)), np.zeros_like(curve.errors))
    position = _extend(plan, time - start, 0)
    followed = curve.curve_of(position)
    samples = np.abs(position - followed(time))
    # many times in each piece, for the jerk may jump between two
    breaks, parts = followed.x, np.linspace(0.0, 1.0, PIECE_TIMES)
    fine = (breaks[:-1, None] + np.diff(breaks)[:, None] * parts).ravel()
    # the curve extends beyond log and plan
    fine = fine.clip(min(0.0, start + plan.start_time), max(time[-1], start + plan.end_time))
    gaps = np.abs([_extend(plan, fine - start, nu) - followed(fine, nu) for nu in ERROR_ORDERS])
    worst = gaps.reshape(len(ERROR_ORDERS), len(breaks) - 1, PIECE_TIMES, -1).max(axis=2)
    # knots that suit the log but not the plan show that the log is of another motion there
    of_log = _by_piece(curve, np.abs(curve.residuals) + curve.sigma)
    share = np.minimum(1.0, of_log / np.maximum(_by_piece(curve, samples), np.finfo(float).tiny))
    piece = np.clip(np.searchsorted(followed.x, grid, side="right") - 1, 0, len(share) - 1)
    return PlanResidual(
        samples.max(axis=0), share[piece] * largest_near(worst, 1, axis=1)[:, piece]
    )


def _extend(plan: JointTrajectory, time: FloatArray, order: int) -> FloatArray:
    """A plan extended before and after its time, without a jump of velocity."""
    inside = np.clip(time, plan.start_time, plan.end_time)
    beyond = (time - inside)[:, None]
    values = plan(inside, order)
    if order == 0:
        return np.asarray(values + plan.velocity(inside) * beyond)
    return values if order == 1 else np.where(beyond == 0.0, values, 0.0)


def _by_piece(curve: Smoothed, values: FloatArray) -> FloatArray:
    """The largest of samples in each piece and next to it, shape (pieces, d)."""
    first = np.searchsorted(curve.log.time, curve.trajectory.breaks[:-1])
    return largest_near(np.maximum.reduceat(values, first, axis=0), 1)
