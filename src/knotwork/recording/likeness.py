"""What a curve with the knots of a log leaves of the motion that was asked for.

Where the jerk or the acceleration of a motion jumps, no smooth curve follows it, however exact a
log is. A log of the plan is off its curve by what the same curve leaves of the plan's own samples,
and the curve is off the motion by as much.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.recording.smoothing import ORDERS, Smoothed
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

CONTINUED = 3.0
"""Number of periods that may be missing at an end of a log: its curve is continued over them."""


@dataclass(frozen=True, eq=False)
class LeftOfPlan:
    """How far a plan is off a curve with the knots and the weights of a log.

    Attributes:
        samples: Largest distance of its samples [rad or m], shape (d,).
        errors: Distances of position, velocity, acceleration and jerk at the times of the log's
            grid or next to them [rad or m, per s, per s², per s³], shape (4, g, d).
        ends: The same at the start and the end of the plan, if the curve is continued to there,
            shape (2, 4, d).
    """

    samples: FloatArray
    errors: FloatArray
    ends: FloatArray


def left_of_plan(curve: Smoothed, plan: JointTrajectory, start: float) -> LeftOfPlan:
    """Smooth a plan as a log was; nothing is left of a plan that jumps in position or velocity.

    Args:
        curve: The smoothed log.
        plan: The plan, with the log's joints in its order.
        start: The plan's time 0 since the log's first sample [s].
    """
    joints = len(plan.joint_names)
    if plan.continuity.order < 1:
        none = np.zeros((ORDERS, curve.grid.size, joints))
        return LeftOfPlan(np.zeros(joints), none, np.zeros((2, ORDERS, joints)))
    time = curve.log.time
    position, velocity = (_going_on(plan, time - start, order) for order in range(2))
    followed = curve.curve_of(position, velocity)
    samples = np.abs(position - followed(time))
    errors = np.stack(
        [
            np.abs(_going_on(plan, curve.grid - start, order) - followed(curve.grid, order))
            for order in range(ORDERS)
        ]
    )
    # knots that suit the log but not the plan show that the log is of another motion there
    own = _by_piece(curve, np.abs(curve.residuals) + curve.sigma)
    share = np.minimum(1.0, own / np.maximum(_by_piece(curve, samples), np.finfo(float).tiny))
    piece = np.minimum(np.arange(curve.grid.size) // 2, len(share) - 1)
    ends = np.stack(
        [
            [np.abs(plan(at, order) - continued(followed, at + start, order)) for order in range(4)]
            for at in (plan.start_time, plan.end_time)
        ]
    )
    beyond = np.array([-plan.start_time - start, plan.end_time + start - time[-1]])
    ends[(beyond <= 0.0) | (beyond > CONTINUED * curve.log.period)] = 0.0
    return LeftOfPlan(samples.max(axis=0), share[piece] * _with_neighbours(errors, axis=1), ends)


def continued(curve: PiecewisePolynomial, time: float, order: int) -> FloatArray:
    """A curve of cubics or its derivative; before and after its time its end pieces go on."""
    border = min(max(time, float(curve.x[0])), float(curve.x[-1]))
    terms = (
        curve(border, order + k) * (time - border) ** k / factorial(k) for k in range(4 - order)
    )
    return np.asarray(sum(terms))


def _going_on(plan: JointTrajectory, time: FloatArray, order: int) -> FloatArray:
    """A plan that goes on before and after its time, so that its velocity does not jump there."""
    inside = np.clip(time, plan.start_time, plan.end_time)
    beyond = (time - inside)[:, None]
    values = plan(inside, order)
    if order == 0:
        return np.asarray(values + plan.velocity(inside) * beyond)
    return values if order == 1 else np.where(beyond == 0.0, values, 0.0)


def _by_piece(curve: Smoothed, values: FloatArray) -> FloatArray:
    """The largest of samples in each piece and next to it, shape (pieces, d)."""
    first = np.searchsorted(curve.log.time, curve.trajectory.breaks[:-1])
    return _with_neighbours(np.maximum.reduceat(values, first, axis=0), axis=0)


def _with_neighbours(values: FloatArray, axis: int) -> FloatArray:
    """The largest of each value, the one before and the one after."""
    padded = np.moveaxis(values, axis, 0)
    padded = np.concatenate((padded[:1], padded, padded[-1:]))
    most = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.asarray(np.moveaxis(most, 0, axis))
