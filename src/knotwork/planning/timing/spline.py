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
from knotwork.planning.timing.nonlinear_program import Kernel, symbols

INTERVAL_PIECES = 5
"""Cubic pieces per interval. More pieces gain less than 1 % of the duration."""

SINGLE_INTERVAL_PIECES = 12
"""Cubic pieces of a single interval.

A joint between two stops has seven phases. Joints that share the pieces need more: with twelve
pieces, six joints are as fast as the slowest of them alone.
"""


def pieces_per_interval(intervals: int) -> int:
    """Number of cubic pieces in each interval of a motion."""
    return SINGLE_INTERVAL_PIECES if intervals == 1 else INTERVAL_PIECES


@dataclass(frozen=True, eq=False)
class Layout:
    """Indices of the variables: state and next piece of each break in turn, then the factors.

    Attributes:
        interval_count: Number of intervals.
        interval_pieces: Number of pieces of each interval.
        joint_count: Number of joints.
        factor_count: Number of velocities along directions.
    """

    interval_count: int
    interval_pieces: int
    joint_count: int
    factor_count: int

    @property
    def piece_count(self) -> int:
        """Number of pieces of the whole motion."""
        return self.interval_pieces * self.interval_count

    @property
    def size(self) -> int:
        """Number of variables."""
        d = self.joint_count
        return (3 * d + 1) * self.piece_count + 3 * d + self.factor_count

    @property
    def waypoint_breaks(self) -> slice:
        """The waypoints among the breaks."""
        return slice(None, None, self.interval_pieces)

    @property
    def factor_columns(self) -> IndexArray:
        """Factors of the velocities along directions, shape (factor_count,)."""
        return np.arange(self.size - self.factor_count, self.size)

    @cached_property
    def state_columns(self) -> IndexArray:
        """States of the breaks, one per column: positions, velocities and accelerations."""
        starts = (3 * self.joint_count + 1) * np.arange(self.piece_count + 1)
        return starts + np.arange(3 * self.joint_count)[:, None]

    @property
    def q(self) -> IndexArray:
        """Positions at the breaks, shape (piece_count + 1, joint_count)."""
        return self.state_columns[: self.joint_count].T

    @property
    def v(self) -> IndexArray:
        """Velocities at the breaks, shape (piece_count + 1, joint_count)."""
        return self.state_columns[self.joint_count : 2 * self.joint_count].T

    @property
    def a(self) -> IndexArray:
        """Accelerations at the breaks, shape (piece_count + 1, joint_count)."""
        return self.state_columns[2 * self.joint_count :].T

    @property
    def tau(self) -> IndexArray:
        """Durations of the pieces, shape (piece_count,)."""
        return self.state_columns[-1, :-1] + 1

    @property
    def piece_columns(self) -> IndexArray:
        """Duration and states at both ends of each piece, one per column."""
        return np.vstack((self.tau, self.state_columns[:, :-1], self.state_columns[:, 1:]))


@lru_cache(maxsize=64)
def piece_kernel(d: int, jerk: bool, position: bool) -> Kernel:
    """Kernel of the equations, limits and costs of one piece, see `Layout.piece_columns`.

    Args:
        d: Number of joints.
        jerk: Whether jerks are limited.
        position: Whether positions are limited between the breaks.
    """
    import casadi as ca

    tau, states = ca.SX.sym("tau"), ca.SX.sym("states", 6 * d)
    q0, v0, a0, q1, v1, a1 = ca.vertsplit(states, d)
    given = symbols(velocity_scale=1, position_scale=1, inverse_jerk=d)
    weights = symbols(time_weight=1, evenness_weight=1, acceleration_weight=d, jerk_weight=d)
    constraints = {
        "velocity_equation": (v1 - v0 - tau * (a0 + a1) / 2) * given["velocity_scale"],
        "position_equation": (q1 - q0 - tau * v0 - tau**2 * (2 * a0 + a1) / 6)
        * given["position_scale"],
        # Bézier points; the one between the two is their mean
        "velocity_points": ca.vertcat(v0 + tau * a0 / 4, v1 - tau * a1 / 4),
    }
    if jerk:
        change = (a1 - a0) * given["inverse_jerk"]
        constraints["jerk"] = ca.vertcat(change - tau, -change - tau)
    if position:
        half = q0 + tau * v0 / 2 + tau**2 * (5 * a0 + a1) / 48
        bend = tau * (v0 + tau * (3 * a0 + a1) / 8) / 6
        constraints["position_points"] = ca.vertcat(
            q0 + tau * v0 / 6, half - bend, half + bend, q1 - tau * v1 / 6
        )
    cost = weights["time_weight"] * tau + weights["evenness_weight"] * tau**2
    cost += ca.dot(weights["acceleration_weight"], a0**2 + a0 * a1 + a1**2) * tau / 3
    cost += ca.dot(weights["jerk_weight"], (a1 - a0) ** 2) / tau
    return Kernel(ca.vertcat(tau, states), {**given, **weights}, constraints, cost)


@lru_cache(maxsize=64)
def sum_kernel(count: int) -> Kernel:
    """Kernel of the sum of a number of durations."""
    import casadi as ca

    tau = ca.SX.sym("tau", count)
    return Kernel(tau, {}, {"sum": ca.sum1(tau)})


@lru_cache(maxsize=64)
def direction_kernel(d: int) -> Kernel:
    """Kernel of the equation of a velocity that is a factor times a direction."""
    import casadi as ca

    v, factor, given = ca.SX.sym("v", d), ca.SX.sym("factor"), symbols(direction=d)
    return Kernel(ca.vertcat(v, factor), given, {"equation": v - factor * given["direction"]})


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
