"""Limits and costs of joint efforts, and limits of the tool's speed: as kernels, and on a curve.

The solver limits them at the breaks. Between these they are looked at afterwards, and where they
are exceeded the breaks beside are given less.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.problem import TimingProblem
from knotwork.timing.program import Kernel
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.timing.dynamics import Dynamics

PLACES = 16
"""Times looked at in each piece, its end left out."""


TOOL_PARTS = (0.25, 0.5, 0.75)
"""Where in each piece the solver limits the tool's speed: it may vary much faster than efforts."""


def _at_break(d: int) -> tuple[Any, Any, tuple[Any, ...]]:
    """Scaled variables at a break, the units of a state, and the state in SI units."""
    import casadi as ca

    state, units = ca.SX.sym("state", 3 * d), ca.SX.sym("units", 3 * d)
    return state, units, tuple(ca.vertsplit(state * units, d))


def _inside(d: int, parts: Sequence[float] = (0.5,)) -> tuple[Any, Any, list[tuple[Any, ...]]]:
    """Scaled variables of a piece, units of a state, and states inside the piece in SI units."""
    import casadi as ca

    tau, states = ca.SX.sym("tau"), ca.SX.sym("states", 6 * d)
    units = ca.SX.sym("units", 3 * d)
    ends = ca.vertsplit(states, d)
    inside = [ca.vertcat(*inner_state(tau, ends, part)) * units for part in parts]
    return ca.vertcat(tau, states), units, [tuple(ca.vertsplit(state, d)) for state in inside]


def inner_state(tau: Any, states: Any, part: float = 0.5) -> tuple[Any, Any, Any]:
    """State after a part of a piece, from its duration and the states at its ends."""
    q0, v0, a0, _, _, a1 = states
    t = part * tau
    return (
        q0 + t * v0 + t**2 * ((3 - part) * a0 + part * a1) / 6,
        v0 + t * ((2 - part) * a0 + part * a1) / 2,
        (1 - part) * a0 + part * a1,
    )


@lru_cache(maxsize=16)
def effort_kernel(dynamics: Dynamics, *, middle: bool) -> Kernel:
    """Efforts at a break or in the middle of a piece, over their limits.

    Parameters: units of the state, inverse limits.
    """
    import casadi as ca

    d = len(dynamics.links)
    if middle:
        variables, units, (state,) = _inside(d)
    else:
        variables, units, state = _at_break(d)
    inverse = ca.SX.sym("inverse", d)
    effort = dynamics.symbolic_effort(*state) * inverse
    return Kernel(variables, ca.vertcat(units, inverse), effort)


@lru_cache(maxsize=16)
def tool_kernel(dynamics: Dynamics, *, middle: bool) -> Kernel:
    """Square of the tool's speed at a break, or at `TOOL_PARTS` of a piece, over that of its limit.

    Parameters: units of the state, inverse limit.
    """
    import casadi as ca

    d = len(dynamics.links)
    if middle:
        variables, units, states = _inside(d, TOOL_PARTS)
    else:
        variables, units, state = _at_break(d)
        states = [state]
    inverse = ca.SX.sym("inverse")
    speeds = [dynamics.symbolic_tool_velocity(*state[:2]) * inverse for state in states]
    return Kernel(variables, ca.vertcat(units, inverse), ca.vertcat(*map(ca.sumsqr, speeds)))


@lru_cache(maxsize=8)
def work_kernel(dynamics: Dynamics) -> Kernel:
    """Integral of effort squared over a piece (Simpson's rule). Parameters: units, weight."""
    import casadi as ca

    d = len(dynamics.links)
    tau, state = ca.SX.sym("tau"), ca.SX.sym("state", 6 * d)
    units, weight = ca.SX.sym("units", 3 * d), ca.SX.sym("weight")
    q0, v0, a0, q1, v1, a1 = ca.vertsplit(state, d)
    inside = inner_state(tau, (q0, v0, a0, q1, v1, a1))
    one = ca.SX.sym("one", 3 * d)
    at = ca.Function("at", [one], [ca.sumsqr(dynamics.symbolic_effort(*ca.vertsplit(one, d)))])
    start, middle, end = (
        at(ca.vertcat(*part) * units) for part in ((q0, v0, a0), inside, (q1, v1, a1))
    )
    cost = weight * tau * (start + 4 * middle + end) / 6
    return Kernel(ca.vertcat(tau, state), ca.vertcat(units, weight), ca.SX(0, 1), cost)


def _states(curve: PiecewisePolynomial) -> tuple[FloatArray, ...]:
    """Positions, velocities and accelerations at places in each piece, shape (pieces, k, d)."""
    span = np.diff(curve.x)[:, None]
    times = curve.x[:-1, None] + np.arange(PLACES) / PLACES * span
    last = np.full((len(times), 1), curve.x[-1])
    times = np.minimum(np.hstack((times, curve.x[1:, None])), last)
    return tuple(curve(times, order) for order in range(3))


def effort_shares(problem: TimingProblem, curve: PiecewisePolynomial) -> FloatArray:
    """Largest effort in each piece over its limit, shape (pieces, d)."""
    q, v, a = _states(curve)
    effort = np.abs(problem.arm.effort(q, v, a))
    return np.asarray((effort / problem.limits.effort).max(axis=1))


def tool_shares(problem: TimingProblem, curve: PiecewisePolynomial) -> FloatArray:
    """Largest speed of the tool in each piece over its limit, shape (pieces, 1)."""
    q, v, _ = _states(curve)
    speed = problem.arm.tool_speed(q, v)
    return np.asarray(speed.max(axis=1, keepdims=True) / problem.limits.tool_speed)


def proved_efforts(problem: TimingProblem, curve: PiecewisePolynomial) -> FloatArray:
    """Efforts that are not proved to be below their limits, over these, shape (pieces, d).

    Only the worst of each joint, in the piece where it is.
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
    """The tool's speed over its limit, if it is not proved to be below, shape (pieces, 1)."""
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
    weights = np.array([1.0, *[4.0, 2.0] * (PLACES // 2 - 1), 4.0, 1.0]) / (3.0 * PLACES)
    return float((squares @ weights) @ np.diff(curve.x))


def likely_accelerations(problem: TimingProblem) -> FloatArray:
    """Accelerations that the efforts are likely to allow at the waypoints, shape (d,)."""
    if problem.dynamics is None or np.isinf(problem.limits.effort).all():
        return problem.limits.acceleration
    still = np.zeros_like(problem.position)
    weight = problem.arm.effort(problem.position, still, still)
    inertia = np.stack(
        [
            problem.arm.effort(problem.position, still, still + one)[:, k] - weight[:, k]
            for k, one in enumerate(np.eye(problem.position.shape[1]))
        ],
        axis=1,
    )
    left = np.maximum(problem.limits.effort - np.abs(weight), 0.05 * problem.limits.effort)
    found = 0.5 * (left / np.maximum(inertia, 1e-9)).min(axis=0)
    return np.asarray(np.minimum(problem.limits.acceleration, found))
