"""Limits and costs of joint efforts, and limits of tool speed: kernels, and values on a curve.

The solver applies them at the breaks. Between these they are sampled afterwards, and where they are
exceeded the limits at the adjoining breaks are tightened.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.planning.timing.nonlinear_program import Kernel
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.planning.timing.symbolic_dynamics import Dynamics

SAMPLES_EACH = 16
"""Samples in each piece, without its end."""


EFFORT_PARTS = (0.5,)
"""Positions in each piece at which the solver limits efforts."""

TOOL_PARTS = (0.25, 0.5, 0.75)
"""Positions in each piece at which the solver limits tool speed, which may vary much faster."""


@dataclass(frozen=True, eq=False)
class _Inside:
    """Symbols of a piece.

    Attributes:
        tau: Duration of the piece.
        variables: Scaled variables of the piece.
        units: Units of a state.
        states: Positions, velocities and accelerations within the piece, in SI units.
        inner: Symbols of these states, and their expressions in the variables.
    """

    tau: Any
    variables: Any
    units: Any
    states: list[tuple[Any, ...]]
    inner: tuple[Any, Any]


def _inside(d: int, parts: Sequence[float]) -> _Inside:
    import casadi as ca

    tau, ends = ca.SX.sym("tau"), ca.SX.sym("ends", 6 * d)
    units = ca.SX.sym("units", 3 * d)
    split = ca.vertsplit(ends, d)
    at = [inner_state(tau, split, part) for part in parts]
    meant = [ca.vertcat(*state) * units for state in at]
    symbols = [ca.SX.sym(f"state{k}", 3 * d) for k in range(len(parts))]
    return _Inside(
        tau,
        ca.vertcat(tau, ends),
        units,
        [tuple(ca.vertsplit(state, d)) for state in symbols],
        (ca.vertcat(*symbols), ca.vertcat(*meant)),
    )


def inner_state(tau: Any, states: Any, part: Any) -> tuple[Any, Any, Any]:
    """State after a fraction of a piece, from its duration and the states at its ends."""
    q0, v0, a0, _, _, a1 = states
    t = part * tau
    return (
        q0 + t * v0 + t**2 * ((3 - part) * a0 + part * a1) / 6,
        v0 + t * ((2 - part) * a0 + part * a1) / 2,
        (1 - part) * a0 + part * a1,
    )


@lru_cache(maxsize=16)
def effort_kernel(dynamics: Dynamics, *, inside: bool) -> Kernel:
    """Efforts at a break, or at `EFFORT_PARTS` of a piece, relative to their limits.

    Parameters: units of the state, inverse limits.
    """
    import casadi as ca

    inverse = ca.SX.sym("inverse", dynamics.robot.dof)
    return _limit_kernel(
        dynamics,
        inverse,
        lambda q, v, a: dynamics.symbolic_effort(q, v, a) * inverse,
        EFFORT_PARTS if inside else (),
    )


@lru_cache(maxsize=16)
def tool_kernel(dynamics: Dynamics, *, inside: bool) -> Kernel:
    """Squared tool speed at a break, or at `TOOL_PARTS` of a piece, relative to its limit squared.

    Parameters: units of the state, inverse limit.
    """
    import casadi as ca

    inverse = ca.SX.sym("inverse")
    return _limit_kernel(
        dynamics,
        inverse,
        lambda q, v, _: ca.sumsqr(dynamics.symbolic_tool_velocity(q, v) * inverse),
        TOOL_PARTS if inside else (),
    )


def _limit_kernel(
    dynamics: Dynamics, inverse: Any, use: Callable[..., Any], parts: tuple[float, ...]
) -> Kernel:
    """Use of a limit at fractions of a piece, or without any at a break."""
    import casadi as ca

    d = dynamics.robot.dof
    if parts:
        piece = _inside(d, parts)
        rows = ca.vertcat(*(use(*state) for state in piece.states))
        return Kernel(piece.variables, ca.vertcat(piece.units, inverse), rows, inner=piece.inner)
    state, units = ca.SX.sym("state", 3 * d), ca.SX.sym("units", 3 * d)
    return Kernel(state, ca.vertcat(units, inverse), use(*ca.vertsplit(state * units, d)))


@lru_cache(maxsize=8)
def work_kernel(dynamics: Dynamics) -> Kernel:
    """Integral of effort squared over a piece (Simpson's rule). Parameters: units, weight."""
    import casadi as ca

    piece = _inside(dynamics.robot.dof, (0.0, 0.5, 1.0))
    weight = ca.SX.sym("weight")
    start, middle, end = (ca.sumsqr(dynamics.symbolic_effort(*state)) for state in piece.states)
    cost = weight * piece.tau * (start + 4 * middle + end) / 6
    units = ca.vertcat(piece.units, weight)
    return Kernel(piece.variables, units, ca.SX(0, 1), cost, piece.inner)


def _states(curve: PiecewisePolynomial) -> tuple[FloatArray, ...]:
    """Positions, velocities and accelerations at samples of each piece, shape (pieces, k, d)."""
    span = np.diff(curve.x)[:, None]
    times = curve.x[:-1, None] + np.arange(SAMPLES_EACH) / SAMPLES_EACH * span
    last = np.full((len(times), 1), curve.x[-1])
    times = np.minimum(np.hstack((times, curve.x[1:, None])), last)
    return tuple(curve(times, order) for order in range(3))


def effort_shares(problem: TimingProblem, curve: PiecewisePolynomial) -> FloatArray:
    """Largest effort in each piece relative to its limit, shape (pieces, d)."""
    q, v, a = _states(curve)
    effort = np.abs(problem.arm.effort(q, v, a))
    return np.asarray((effort / problem.limits.effort).max(axis=1))


def tool_shares(problem: TimingProblem, curve: PiecewisePolynomial) -> FloatArray:
    """Largest tool speed in each piece relative to its limit, shape (pieces, 1)."""
    q, v, _ = _states(curve)
    speed = problem.arm.tool_speed(q, v)
    return np.asarray(speed.max(axis=1, keepdims=True) / problem.limits.tool_speed)


def proved_efforts(problem: TimingProblem, curve: PiecewisePolynomial) -> FloatArray:
    """Efforts not proved to be below their limits, relative to these, shape (pieces, d).

    Only the worst of each joint, in its piece.
    """
    from knotwork.verification.bounds import torque_bound

    found = torque_bound(problem.arm.robot, _motion(problem, curve), limit=problem.limits.effort)
    shares = np.zeros((curve.x.size - 1, len(found)))
    for k, bound in enumerate(found):
        if not (bound.ok and bound.proved):
            worst = max(abs(bound.bound), abs(bound.value))
            shares[_piece(curve, bound.time), k] = worst / problem.limits.effort[k]
    return shares


def proved_tool(problem: TimingProblem, curve: PiecewisePolynomial) -> FloatArray:
    """Tool speed relative to its limit, if not proved to be below, shape (pieces, 1)."""
    from knotwork.verification.bounds import tool_speed_bound

    limit = problem.limits.tool_speed
    bound = tool_speed_bound(problem.arm.robot, _motion(problem, curve), limit=limit)
    shares = np.zeros((curve.x.size - 1, 1))
    if not (bound.ok and bound.proved):
        shares[_piece(curve, bound.time)] = max(bound.bound, bound.value) / limit
    return shares


def _motion(problem: TimingProblem, curve: PiecewisePolynomial) -> JointTrajectory:
    return JointTrajectory(
        problem.arm.robot.joint_names, curve, joint_units=problem.arm.robot.joint_units
    )


def _piece(curve: PiecewisePolynomial, time: float) -> int:
    return min(int(np.searchsorted(curve.x, time, side="right")) - 1, curve.x.size - 2)


def effort_integral(problem: TimingProblem, curve: PiecewisePolynomial) -> float:
    """Integral of effort squared over the motion, summed over the joints, by Simpson's rule."""
    q, v, a = _states(curve)
    squares = (problem.arm.effort(q, v, a) ** 2).sum(axis=-1)
    weights = np.array([1.0, *[4.0, 2.0] * (SAMPLES_EACH // 2 - 1), 4.0, 1.0]) / (
        3.0 * SAMPLES_EACH
    )
    return float((squares @ weights) @ np.diff(curve.x))
