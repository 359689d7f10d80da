"""The motion as a nonlinear program: cubic pieces, their equations, limits and costs.

With the states (q, v, a) at the breaks and the duration τ of each piece, shared by all joints,

    v' = v + τ (a + a')/2        q' = q + τ v + τ² (2 a + a')/6        |a' - a| <= J τ

and |a| <= A, |v| <= V at the breaks. A velocity is quadratic in each piece, so it is below V if the
Bézier points of both halves of the piece, which are close to the curve, are. Likewise positions.

The program uses the time unit and the position units of a `Scale`, so that all its numbers are of
order one, independent of units and limits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from knotwork.planning.timing.efforts import work_kernel
from knotwork.planning.timing.problem import TimingProblem
from knotwork.planning.timing.program import Block, Kernel
from knotwork.waypoints import FloatArray, IndexArray

if TYPE_CHECKING:
    from knotwork.planning.timing.dynamics import Dynamics

PIECES = 5
"""Cubic pieces per interval. More pieces gain less than 1 % of the duration."""

ALONE = 12
"""Cubic pieces of a single interval. A joint between two stops has seven phases, and joints that
share the pieces need more: with twelve, six joints are as fast as the slowest of them."""


def pieces_each(intervals: int) -> int:
    """Cubic pieces of each interval in a section of n intervals."""
    return ALONE if intervals == 1 else PIECES


@dataclass(frozen=True)
class Form:
    """Structure of the program of a motion; motions of equal structure share a program.

    Attributes:
        intervals: Number of intervals.
        each: Number of pieces of each interval.
        joints: Number of joints.
        along: Waypoints with a velocity of known direction and unknown factor.
        timed: Intervals with a given duration or a lower bound.
        total: Whether the sum of the durations is given.
        jerk: Whether jerk is limited.
        position: Whether positions between the breaks are limited.
        smooth: Whether the objective has jerk.
        dynamics: Dynamics, if efforts or tool speed are needed.
        held: Names of the limited ones of effort and tool speed.
        work: Whether the objective has efforts.
    """

    intervals: int
    each: int
    joints: int
    along: tuple[int, ...] = ()
    timed: tuple[int, ...] = ()
    total: bool = False
    jerk: bool = True
    position: bool = False
    smooth: bool = False
    dynamics: Dynamics | None = None
    held: tuple[str, ...] = ()
    work: bool = False

    @property
    def pieces(self) -> int:
        """Number of pieces of the whole motion."""
        return self.each * self.intervals


def form_of(
    problem: TimingProblem, each: int, held: tuple[str, ...] = (), *, position: bool = False
) -> Form:
    """Find the structure of a problem."""
    timed = ~problem.free | (problem.at_least > 0.0)
    return Form(
        len(problem.position) - 1,
        each,
        len(problem.joint_names),
        along=tuple(np.flatnonzero(problem.along).tolist()),
        timed=tuple(np.flatnonzero(timed).tolist()),
        total=problem.total is not None,
        jerk=bool(np.isfinite(problem.limits.jerk).any()),
        position=position,
        smooth=problem.objective.jerk > 0.0,
        dynamics=problem.dynamics if held or problem.objective.effort else None,
        held=held,
        work=problem.objective.effort > 0.0,
    )


@dataclass(frozen=True, eq=False)
class Layout:
    """Indices of the variables of a motion: for each break its state, then the next piece.

    Attributes:
        tau: Durations of the pieces, shape (pieces,).
        q, v, a: States at the breaks, shape (pieces + 1, joints) each.
        factor: Factors of the velocities along directions, shape (len(along),).
        size: Number of variables.
    """

    tau: IndexArray
    q: IndexArray
    v: IndexArray
    a: IndexArray
    factor: IndexArray
    size: int

    @property
    def state(self) -> IndexArray:
        """Indices of the state of each break, one per column."""
        return np.concatenate((self.q, self.v, self.a), axis=1).T

    @property
    def piece(self) -> IndexArray:
        """Indices of the duration and the end states of each piece, one per column."""
        return np.vstack((self.tau, self.state[:, :-1], self.state[:, 1:]))


@lru_cache(maxsize=64)
def layout(form: Form) -> Layout:
    """Assign indices to the variables of pieces, then to factors of velocities."""
    joints, factors = form.joints, len(form.along)
    start = (3 * joints + 1) * np.arange(form.pieces + 1)
    q, v, a = ((start + k * joints)[:, None] + np.arange(joints) for k in range(3))
    end = int(start[-1]) + 3 * joints
    return Layout(start[:-1] + 3 * joints, q, v, a, end + np.arange(factors), end + factors)


@lru_cache(maxsize=64)
def blocks(form: Form) -> tuple[Block, ...]:
    """Equations and costs of a motion, as repeated kernels.

    In this order: one for each piece; one for each interval in `timed`; one for each waypoint in
    `along`; the total, if given; one for each piece if the objective has efforts.
    """
    at, d = layout(form), form.joints
    parts = at.tau.reshape(form.intervals, form.each)
    found = [
        Block(piece_kernel(d, form.jerk, form.position, form.smooth), at.piece),
        Block(_sum_kernel(form.each), parts[list(form.timed)].T),
        Block(
            _direction_kernel(d),
            np.concatenate(
                (at.v[form.each * np.array(form.along, dtype=np.intp)], at.factor[:, None]), axis=1
            ).T,
        ),
    ]
    if form.total:
        found.append(Block(_sum_kernel(form.pieces), at.tau[:, None]))
    if form.dynamics is not None and form.work:
        found.append(Block(work_kernel(form.dynamics), at.piece))
    return tuple(found)


@lru_cache(maxsize=64)
def piece_kernel(d: int, jerk: bool, position: bool, smooth: bool) -> Kernel:
    """Equations of one piece. Parameters: scales of the equations, inverse jerk limits, weights.

    Constraints, d each: the velocity's equation and the position's; the velocity at two Bézier
    points; change of acceleration within the jerk limit, upwards and downwards; four Bézier points
    of the position.
    """
    import casadi as ca

    tau, state = ca.SX.sym("tau"), ca.SX.sym("state", 6 * d)
    q0, v0, a0, q1, v1, a1 = ca.vertsplit(state, d)
    scale, inverse_jerk = ca.SX.sym("scale", 2), ca.SX.sym("jerk", d if jerk else 0)
    weight = ca.SX.sym("weight", 2 + d + (d if smooth else 0))
    rows = [
        (v1 - v0 - tau * (a0 + a1) / 2) * scale[0],
        (q1 - q0 - tau * v0 - tau**2 * (2 * a0 + a1) / 6) * scale[1],
        v0 + tau * a0 / 4,  # the point between these is their mean
        v1 - tau * a1 / 4,
    ]
    if jerk:
        change = (a1 - a0) * inverse_jerk
        rows += [change - tau, -change - tau]
    if position:
        half = q0 + tau * v0 / 2 + tau**2 * (5 * a0 + a1) / 48
        bend = tau * (v0 + tau * (3 * a0 + a1) / 8) / 6
        rows += [q0 + tau * v0 / 6, half - bend, half + bend, q1 - tau * v1 / 6]
    cost = weight[0] * tau + weight[1] * tau**2
    cost += ca.dot(weight[2 : 2 + d], a0**2 + a0 * a1 + a1**2) * tau / 3
    if smooth:
        cost += ca.dot(weight[2 + d :], (a1 - a0) ** 2) / tau
    return Kernel(
        ca.vertcat(tau, state), ca.vertcat(scale, inverse_jerk, weight), ca.vertcat(*rows), cost
    )


@lru_cache(maxsize=64)
def _sum_kernel(count: int) -> Kernel:
    import casadi as ca

    tau = ca.SX.sym("tau", count)
    return Kernel(tau, ca.SX(0, 1), ca.sum1(tau))


@lru_cache(maxsize=64)
def _direction_kernel(d: int) -> Kernel:
    """Velocity of a waypoint = factor times direction."""
    import casadi as ca

    v, factor, direction = ca.SX.sym("v", d), ca.SX.sym("s"), ca.SX.sym("u", d)
    return Kernel(ca.vertcat(v, factor), direction, v - factor * direction)


@dataclass(frozen=True, eq=False)
class Scale:
    """Units of a program.

    Attributes:
        time: Unit of time [s].
        position: Unit of each joint's position [rad or m], shape (d,).
    """

    time: float
    position: FloatArray

    def unit(self, order: int) -> FloatArray:
        """Unit of the derivative of a position, shape (d,)."""
        return np.asarray(self.position / self.time**order)
