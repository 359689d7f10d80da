"""The motion as a nonlinear program: cubic pieces, their equations, limits and costs.

With the states (q, v, a) at the breaks and the duration τ of each piece, shared by all joints,

    v' = v + τ (a + a')/2        q' = q + τ v + τ² (2 a + a')/6        |a' - a| <= J τ

and |a| <= A, |v| <= V at the breaks. A velocity is quadratic in each piece. It is below V if the
Bézier points of both halves of the piece are, and these are close to the curve. The same holds for
positions.

The program uses the time unit and the position units of a `Scale`, so that all its numbers are of
order one, independent of units and limits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.planning.timing.nonlinear_program import Kernel

INTERVAL_PIECES = 5
"""Cubic pieces per interval. More pieces gain less than 1 % of the duration."""

SINGLE_INTERVAL_PIECES = 12
"""Cubic pieces of a single interval.

A joint between two stops has seven phases. Joints that share the pieces need more: with twelve
pieces, six joints are as fast as the slowest of them alone.
"""


def pieces_each(intervals: int) -> int:
    """Number of cubic pieces for each of the intervals of a section."""
    return SINGLE_INTERVAL_PIECES if intervals == 1 else INTERVAL_PIECES


@dataclass(frozen=True, eq=False)
class Layout:
    """Indices of the variables: state and next piece of each break in turn, then the factors.

    Attributes:
        intervals: Number of intervals.
        each: Number of pieces of each interval.
        joints: Number of joints.
        factors: Number of velocities along directions.
    """

    intervals: int
    each: int
    joints: int
    factors: int

    @property
    def pieces(self) -> int:
        """Number of pieces of the whole motion."""
        return self.each * self.intervals

    @property
    def size(self) -> int:
        """Number of variables."""
        return (3 * self.joints + 1) * self.pieces + 3 * self.joints + self.factors

    @property
    def factor(self) -> IndexArray:
        """Factors of the velocities along directions, shape (factors,)."""
        return np.arange(self.size - self.factors, self.size)

    @cached_property
    def state(self) -> IndexArray:
        """States of the breaks, one per column: positions, velocities and accelerations."""
        starts = (3 * self.joints + 1) * np.arange(self.pieces + 1)
        return starts + np.arange(3 * self.joints)[:, None]

    @property
    def q(self) -> IndexArray:
        """Positions at the breaks, shape (pieces + 1, joints)."""
        return self.state[: self.joints].T

    @property
    def v(self) -> IndexArray:
        """Velocities at the breaks, shape (pieces + 1, joints)."""
        return self.state[self.joints : 2 * self.joints].T

    @property
    def a(self) -> IndexArray:
        """Accelerations at the breaks, shape (pieces + 1, joints)."""
        return self.state[2 * self.joints :].T

    @property
    def tau(self) -> IndexArray:
        """Durations of the pieces, shape (pieces,)."""
        return self.state[-1, :-1] + 1

    @property
    def piece(self) -> IndexArray:
        """Duration and states at both ends of each piece, one per column."""
        return np.vstack((self.tau, self.state[:, :-1], self.state[:, 1:]))


@lru_cache(maxsize=64)
def piece_kernel(d: int, jerk: bool, position: bool, smooth: bool) -> Kernel:
    """Kernel of one piece. Parameters: scales of the equations, inverse jerk limits, weights.

    The constraints, d of each, are in this order: the equations of velocity and position; the
    velocity at two Bézier points; the increase and the decrease of the acceleration within the jerk
    limit; four Bézier points of the position.
    """
    import casadi as ca

    tau, state = ca.SX.sym("tau"), ca.SX.sym("state", 6 * d)
    q0, v0, a0, q1, v1, a1 = ca.vertsplit(state, d)
    scale, inverse_jerk = ca.SX.sym("scale", 2), ca.SX.sym("jerk", d if jerk else 0)
    weight = ca.SX.sym("weight", 2 + d + (d if smooth else 0))
    rows = [
        (v1 - v0 - tau * (a0 + a1) / 2) * scale[0],
        (q1 - q0 - tau * v0 - tau**2 * (2 * a0 + a1) / 6) * scale[1],
        v0 + tau * a0 / 4,  # the point between the two is their mean
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
def sum_kernel(count: int) -> Kernel:
    """Kernel for the sum of durations."""
    import casadi as ca

    tau = ca.SX.sym("tau", count)
    return Kernel(tau, ca.SX(0, 1), ca.sum1(tau))


@lru_cache(maxsize=64)
def direction_kernel(d: int) -> Kernel:
    """Kernel for the velocity of a waypoint that is a factor times a direction."""
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

    @property
    def state(self) -> FloatArray:
        """Units of a state: positions, velocities, accelerations, shape (3 d,)."""
        return np.concatenate([self.unit(order) for order in range(3)])
