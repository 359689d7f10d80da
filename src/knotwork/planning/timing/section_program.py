"""The nonlinear program of a section, and the curve of its solution."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.timing.long_intervals import (
    MIDDLE_BREAKS,
    max_middle_velocities,
    stop_times,
)
from knotwork.planning.timing.motion_curves import exact_curve
from knotwork.planning.timing.motion_states import States
from knotwork.planning.timing.nonlinear_program import Block, Solution, solve_program
from knotwork.planning.timing.robot_limits import robot_limit_blocks, work_kernel
from knotwork.planning.timing.spline import (
    Layout,
    Scale,
    direction_kernel,
    piece_kernel,
    sum_kernel,
)
from knotwork.planning.timing.tightening import Tightening
from knotwork.planning.timing.timing_problem import TimingProblem

EVENNESS_WEIGHT = 3e-4
"""Weight of the differences between the pieces of an interval, for durations that are not
determined otherwise.
"""

CALMNESS_WEIGHT = 1e-4
"""Weight of accelerations, which avoids needless motion of joints that do not limit the duration.

It makes a motion longer by at most this fraction.
"""

MIN_PIECE_SHARE = 1e-4
"""Minimum duration of a piece, relative to its first guess."""

MIN_SOLVER_TIME = 1e-3
"""Minimum time limit of the solver [s]."""

WARM_START_OPTIONS: dict[str, Any] = {
    "ipopt.mu_init": 1e-9,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_bound_frac": 1e-8,
    "ipopt.warm_start_slack_bound_push": 1e-8,
    "ipopt.warm_start_slack_bound_frac": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
}
"""IPOPT options for a start from the solution of a problem with slightly different limits."""


class SectionProgram:
    """The nonlinear program of a problem; IPOPT solves it.

    Args:
        problem: The problem.
        guess: Initial guess, which also sets the pieces and the units.
        tightening: Margins of the limits.
    """

    def __init__(self, problem: TimingProblem, guess: States, tightening: Tightening) -> None:
        self.problem, self.guess, self.tightening = problem, guess, tightening
        self.margin = tightening.margin
        self.along = np.flatnonzero(problem.along)
        intervals, joints = len(problem.duration), len(problem.joint_names)
        each = len(guess.span) // intervals
        self.layout = Layout(intervals, each, joints, len(self.along))
        # of the intervals in the guess
        self.duration = guess.span.reshape(intervals, each).sum(axis=1)
        usual = np.isnan(stop_times(problem))
        self.scale = _scale(problem, guess, float(np.median(self.duration[usual])))

    def solve(self, start: Solution | None = None, seconds: float = np.inf) -> Solution:
        """Run the solver from an earlier solution or the guess, with a time limit [s]."""
        options = {} if start is None else dict(WARM_START_OPTIONS)
        if np.isfinite(seconds):
            options["ipopt.max_wall_time"] = max(seconds, MIN_SOLVER_TIME)
        initial = self.variables_of(self.guess) if start is None else start
        reusable = bool(np.isinf(seconds))
        return solve_program(self.blocks(), initial, self.bounds(), options, reusable=reusable)

    def variables_of(self, states: States) -> FloatArray:
        """Variables of the program at a motion with the pieces of the guess."""
        at, scale = self.layout, self.scale
        x = np.zeros(at.size)
        limit = self.problem.limits.acceleration
        x[at.tau] = states.span / scale.time
        x[at.q] = states.q / scale.unit(0)
        x[at.v] = states.v / scale.unit(1)
        x[at.a] = np.clip(states.a, -limit, limit) / scale.unit(2)
        for column, i in zip(at.factor, self.along, strict=True):
            direction = self.problem.velocity[i]
            length = float(direction @ direction)
            x[column] = float(states.v[at.each * i] @ direction) / length if length else 0.0
        return x

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the variables, equal where a variable is known."""
        at, problem, scale = self.layout, self.problem, self.scale
        each = at.each
        low, high = np.full(at.size, -np.inf), np.full(at.size, np.inf)
        low[at.tau] = MIN_PIECE_SHARE * self.guess.span / scale.time
        inner = 1.0 - self.margin
        V, A = (inner * problem.limits[name] for name in ("velocity", "acceleration"))
        V = np.tile(V, (at.pieces + 1, 1))
        for k in MIDDLE_BREAKS:
            V[k::each] = np.minimum(V[k::each], max_middle_velocities(problem))
        low[at.v], high[at.v] = -V / scale.unit(1), V / scale.unit(1)
        low[at.a], high[at.a] = -A / scale.unit(2), A / scale.unit(2)
        lower, upper = self._position_range()
        of_intervals = (slice(each * i, each * (i + 1)) for i in range(at.intervals))
        for breaks, lowest, highest in zip(of_intervals, lower, upper, strict=True):
            low[at.q[breaks]], high[at.q[breaks]] = lowest / scale.unit(0), highest / scale.unit(0)
        waypoints = slice(None, None, each)
        low[at.q[waypoints]] = high[at.q[waypoints]] = problem.position / scale.unit(0)
        for columns, values, known, order in (
            (at.v, problem.velocity, problem.velocity_known, 1),
            (at.a, problem.acceleration, problem.acceleration_known, 2),
        ):
            fixed = columns[waypoints][known]
            low[fixed] = high[fixed] = values[known] / scale.unit(order)
        unaccelerated = at.a[waypoints][self._has_zero_acceleration()]
        low[unaccelerated] = high[unaccelerated] = 0.0
        low[at.factor] = 0.0
        high[at.factor] = problem.max_factor[self.along]
        return low, high

    def _position_range(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of positions at the breaks in each interval, shape (n-1, d).

        They are slightly inside the limits, except for a joint that starts on one.
        """
        limits, q = self.problem.limits, self.problem.position
        width = limits.upper - limits.lower
        gap = self.margin * np.where(np.isfinite(width), width, 1.0)
        unmoved = q[:-1] == q[1:]
        lower, upper = limits.lower + gap, limits.upper - gap
        return (
            np.where(unmoved, np.minimum(lower, q[1:]), lower),
            np.where(unmoved, np.maximum(upper, q[1:]), upper),
        )

    def _positions_between(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of positions at four points of each piece, shape (4, d, pieces).

        Two bounds are relaxed, because IPOPT cannot satisfy them strictly: of a piece that ends on
        a position limit, and of points that are constant because the waypoint is at rest.
        """
        problem, each = self.problem, self.layout.each
        q, at_rest = problem.position, ~problem.along & (problem.velocity == 0.0).all(axis=1)
        still = at_rest & (problem.acceleration == 0.0).all(axis=1)
        ranges = []
        for edge, extreme, none in zip(
            self._position_range(), (np.minimum, np.maximum), (-np.inf, np.inf), strict=True
        ):
            points = np.broadcast_to(edge[:, None], (4, len(edge), each, self.layout.joints)).copy()
            points[:, :, 0] = extreme(points[:, :, 0], q[:-1])
            points[:, :, -1] = extreme(points[:, :, -1], q[1:])
            for k, constant in enumerate((at_rest, still)):
                points[k, constant[:-1], 0] = none
                points[3 - k, constant[1:], -1] = none
            ranges.append(points.reshape(4, self.layout.pieces, -1).transpose(0, 2, 1))
        return ranges[0], ranges[1]

    def blocks(self) -> list[Block]:
        """Constraints and costs of the program."""
        problem, scale, at = self.problem, self.scale, self.layout
        timed = np.flatnonzero(~problem.free | (problem.at_least > 0.0))
        free = problem.free[timed]
        bound = np.where(free, problem.at_least[timed], problem.duration[timed]) / scale.time
        durations = at.tau.reshape(at.intervals, at.each)[timed].T
        directed = np.concatenate((at.v[at.each * self.along], at.factor[:, None]), axis=1).T
        directions = problem.velocity[self.along].T / scale.unit(1)[:, None]
        empty = np.zeros((0, 1))
        blocks = [
            self._piece_block(),
            Block(sum_kernel(at.each), durations, empty, bound, np.where(free, np.inf, bound)),
            Block(direction_kernel(at.joints), directed, directions),
        ]
        if problem.total is not None:
            total = problem.total / scale.time
            blocks.append(Block(sum_kernel(at.pieces), at.tau[:, None], empty, total, total))
        if problem.objective.effort:
            weight = problem.objective.effort * scale.time / self.typical_cost()
            parameters = np.append(scale.state, weight)[:, None]
            blocks.append(Block(work_kernel(problem.required_dynamics), at.piece, parameters))
        fractions = self.tightening.fractions
        return [*blocks, *robot_limit_blocks(problem, fractions, self.margin, scale, at)]

    def _piece_block(self) -> Block:
        """Constraints and costs of the pieces."""
        problem, scale, at = self.problem, self.scale, self.layout
        d, row = at.joints, np.ones(at.pieces)
        jerk = bool(np.isfinite(problem.limits.jerk).any())
        position, smooth = self.tightening.position, problem.objective.jerk > 0.0
        h = at.each * self.guess.span / scale.time
        rows, max_velocities = [1.0 / h, 1.0 / (h * h)], self._velocity_bounds()
        low = [np.zeros((2 * d, at.pieces)), *(-limit for limit in max_velocities)]
        high = [np.zeros((2 * d, at.pieces)), *max_velocities]
        if jerk:
            limit = (1.0 - self.margin) * problem.limits.jerk / scale.unit(3)
            rows.append(row / limit[:, None])
            low.append(np.full((2 * d, at.pieces), -np.inf))
            high.append(np.zeros((2 * d, at.pieces)))
        if position:
            lower, upper = self._positions_between()
            low += list(lower / scale.unit(0)[:, None])
            high += list(upper / scale.unit(0)[:, None])
        weights = self._weights()[:, None] * row
        weights[1] = EVENNESS_WEIGHT * scale.time**2 / (self.guess.span * self.duration.sum())
        kernel = piece_kernel(d, jerk, position, smooth)
        return Block(kernel, at.piece, np.vstack((*rows, weights)), np.vstack(low), np.vstack(high))

    def _weights(self) -> FloatArray:
        objective, scale = self.problem.objective, self.scale
        cost = self.typical_cost()
        limit = np.minimum(self.problem.limits.acceleration, scale.unit(2))
        calm = CALMNESS_WEIGHT * cost / (limit**2 * self.duration.sum() * len(limit))
        weights = [np.array([objective.time * scale.time, 0.0])]
        weights.append((objective.acceleration + calm) * scale.unit(2) ** 2 * scale.time)
        if objective.jerk:
            weights.append(objective.jerk * scale.unit(3) ** 2 * scale.time)
        return np.asarray(np.concatenate(weights) / cost)

    def typical_cost(self) -> float:
        """Typical value of the objective, by which it is divided to be of order one."""
        objective, scale = self.problem.objective, self.scale
        h = self.duration
        cost = objective.time * float(h.sum())
        for weight, order in ((objective.jerk, 3), (objective.acceleration, 2)):
            cost += weight * float(np.sum((scale.unit(order)) ** 2) * h.sum())
        if objective.effort:
            q = self.problem.position
            still = np.zeros_like(q)
            squares = self.problem.required_dynamics.effort(q, still, still) ** 2
            cost += objective.effort * float(squares.sum(axis=1).mean() * h.sum())
        return cost or 1.0

    def _velocity_bounds(self) -> list[FloatArray]:
        """Maximum velocities at two points of each piece, scaled, shape (d, pieces) each."""
        limit = (1.0 - self.margin) * self.problem.limits.velocity
        shape = (self.layout.intervals, self.layout.each, self.layout.joints)
        start, end = (np.broadcast_to(limit, shape).copy() for _ in range(2))
        # with zero acceleration, the point next to the waypoint has its velocity
        passed = np.where(self._passes_at_limit(), 1.001 * self.problem.limits.velocity, 0.0)
        start[:, 0] = np.maximum(start[:, 0], passed[:-1])
        end[:, -1] = np.maximum(end[:, -1], passed[1:])
        unit = self.scale.unit(1)
        return [(v.reshape(self.layout.pieces, -1) / unit).T for v in (start, end)]

    def _passes_at_limit(self) -> BoolArray:
        """Whether each joint passes each waypoint at its velocity limit, without acceleration."""
        problem = self.problem
        limit = (1.0 - 2.0 * self.margin) * problem.limits.velocity
        return problem.velocity_known[:, None] & (np.abs(problem.velocity) >= limit)

    def _has_zero_acceleration(self) -> BoolArray:
        """Whether each joint gets zero acceleration at each waypoint where none is given."""
        problem = self.problem
        at_rest = problem.velocity_known[:, None] & (problem.velocity == 0.0)
        unmoved = at_rest[:-1] & at_rest[1:] & (np.diff(problem.position, axis=0) == 0.0)
        constant = self._passes_at_limit()
        constant[:-1] |= unmoved  # otherwise it would oscillate between them
        constant[1:] |= unmoved
        return constant & ~problem.acceleration_known[:, None]

    def motion_of(self, x: FloatArray) -> tuple[FloatArray, PiecewisePolynomial]:
        """Times of the waypoints from 0 on [s], and the curve, from the variables."""
        problem, at, scale = self.problem, self.layout, self.scale
        v, a = x[at.v] * scale.unit(1), x[at.a] * scale.unit(2)
        spans = (x[at.tau] * scale.time).reshape(at.intervals, at.each)
        duration = np.where(problem.free, spans.sum(axis=1), problem.duration)
        if problem.total is not None:
            free = problem.free
            free_time = problem.total - duration[~free].sum()
            duration[free] *= free_time / duration[free].sum()
        duration = np.where(problem.free, np.maximum(duration, problem.at_least), duration)
        velocity = np.where(problem.velocity_known[:, None], problem.velocity, v[:: at.each])
        for column, i in zip(at.factor, self.along, strict=True):
            velocity[i] = max(float(x[column]), 0.0) * problem.velocity[i]
        known = problem.acceleration_known
        a[:: at.each][known] = problem.acceleration[known]
        a[:: at.each][self._has_zero_acceleration()] = 0.0
        ends = np.arange(at.intervals)[:, None] * at.each + np.arange(at.each + 1)
        time = np.concatenate(([0.0], np.cumsum(duration)))
        share = spans / spans.sum(axis=1)[:, None]
        return time, exact_curve(time, share, problem.position, velocity, a[ends])


def _scale(problem: TimingProblem, guess: States, time: float) -> Scale:
    """Units of a program with a unit of time [s]."""
    limits = problem.limits
    with np.errstate(invalid="ignore"):
        unit = np.minimum(limits.velocity * time, limits.acceleration * time**2)
        unit = np.minimum(unit, limits.jerk * time**3)
    span = np.ptp(problem.position, axis=0)
    largest = float(span.max()) or 1.0
    typical = np.maximum(span, 1e-3 * largest)
    if problem.objective.jerk and not problem.free.any():
        # given times set the scale of the motion, even if the limits are loose
        peak = np.abs(guess.a).max(axis=0)
        unit = np.minimum(unit, np.maximum(typical, peak * time**2))
    return Scale(time, np.where(np.isfinite(unit), unit, typical))
