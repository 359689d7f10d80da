"""The nonlinear program of a timing problem, and the curve of its solution."""

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


class TimingProgram:
    """The nonlinear program of a timing problem; IPOPT solves it.

    Args:
        problem: The timing problem, or a part of it.
        guess: Initial guess, which also sets the pieces and the units.
        tightening: Margins of the limits.

    Attributes:
        layout: Indices of the variables.
        scale: Units of the variables.
        margin: Relative margin to each limit.
        durations: Durations of the intervals in the guess [s], shape (n-1,).
        directed: Indices of the waypoints whose velocity is a direction with an unknown factor.
    """

    def __init__(self, problem: TimingProblem, guess: States, tightening: Tightening) -> None:
        self.problem = problem
        self.guess = guess
        self.tightening = tightening
        self.margin = tightening.margin
        self.directed = np.flatnonzero(problem.is_direction)
        intervals = len(problem.duration)
        pieces = len(guess.span) // intervals
        self.layout = Layout(intervals, pieces, len(problem.joint_names), len(self.directed))
        self.durations = guess.span.reshape(intervals, pieces).sum(axis=1)
        is_short = np.isnan(stop_times(problem))
        self.scale = _scale(problem, guess, float(np.median(self.durations[is_short])))

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
        layout, scale = self.layout, self.scale
        x = np.zeros(layout.size)
        limit = self.problem.limits.acceleration
        x[layout.tau] = states.span / scale.time
        x[layout.q] = states.q / scale.unit(0)
        x[layout.v] = states.v / scale.unit(1)
        x[layout.a] = np.clip(states.a, -limit, limit) / scale.unit(2)
        at_waypoints = states.v[layout.waypoint_breaks]
        for column, i in zip(layout.factor_columns, self.directed, strict=True):
            direction = self.problem.velocity[i]
            length = float(direction @ direction)
            x[column] = float(at_waypoints[i] @ direction) / length if length else 0.0
        return x

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the variables, equal where a variable is known."""
        layout, problem, scale = self.layout, self.problem, self.scale
        low, high = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
        low[layout.tau] = MIN_PIECE_SHARE * self.guess.span / scale.time
        low[layout.factor_columns] = 0.0
        high[layout.factor_columns] = problem.max_factor[self.directed]
        for side, edge in zip((low, high), self._position_range(), strict=True):
            at_breaks = np.repeat(edge, layout.interval_pieces, axis=0)
            side[layout.q[:-1]] = at_breaks / scale.unit(0)
        max_velocity = np.tile(problem.limits.velocity, (layout.piece_count + 1, 1))
        max_velocity *= 1.0 - self.margin
        for k in MIDDLE_BREAKS:
            middle = max_velocity[k :: layout.interval_pieces]
            np.minimum(middle, max_middle_velocities(problem), out=middle)
        high[layout.v] = max_velocity / scale.unit(1)
        high[layout.a] = (1.0 - self.margin) * problem.limits.acceleration / scale.unit(2)
        for columns in (layout.v, layout.a):
            low[columns] = -high[columns]
        for columns, values, known, order in (
            (layout.q, problem.position, np.full(len(problem.position), True), 0),
            (layout.v, problem.velocity, problem.velocity_known, 1),
            (layout.a, problem.acceleration, problem.acceleration_known, 2),
        ):
            fixed = columns[layout.waypoint_breaks][known]
            low[fixed] = high[fixed] = values[known] / scale.unit(order)
        unaccelerated = layout.a[layout.waypoint_breaks][self._has_zero_acceleration()]
        low[unaccelerated] = high[unaccelerated] = 0.0
        return low, high

    def _position_range(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of positions at the breaks in each interval, shape (n-1, d).

        They are slightly inside the limits, except for a joint that starts on one.
        """
        limits, q = self.problem.limits, self.problem.position
        width = limits.upper - limits.lower
        inset = self.margin * np.where(np.isfinite(width), width, 1.0)
        unmoved = q[:-1] == q[1:]
        lower, upper = limits.lower + inset, limits.upper - inset
        return (
            np.where(unmoved, np.minimum(lower, q[1:]), lower),
            np.where(unmoved, np.maximum(upper, q[1:]), upper),
        )

    def _positions_between(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of positions at the four Bézier points, shape (4 d, pieces).

        Bounds are relaxed where IPOPT cannot satisfy them strictly: in a piece that ends on a
        position limit, and at points that are constant because the waypoint is at rest.
        """
        problem, layout = self.problem, self.layout
        shape = (4, layout.interval_count, layout.interval_pieces, layout.joint_count)
        q = problem.position
        at_rest = ~problem.is_direction & (problem.velocity == 0.0).all(axis=1)
        still = at_rest & (problem.acceleration == 0.0).all(axis=1)
        ranges = []
        for edge, farther, unbounded in zip(
            self._position_range(), (np.minimum, np.maximum), (-np.inf, np.inf), strict=True
        ):
            points = np.broadcast_to(edge[:, None], shape).copy()
            points[:, :, 0] = farther(points[:, :, 0], q[:-1])
            points[:, :, -1] = farther(points[:, :, -1], q[1:])
            for k, is_constant in enumerate((at_rest, still)):
                points[k, is_constant[:-1], 0] = unbounded
                points[3 - k, is_constant[1:], -1] = unbounded
            points /= self.scale.unit(0)
            ranges.append(points.transpose(0, 3, 1, 2).reshape(-1, layout.piece_count))
        return ranges[0], ranges[1]

    def blocks(self) -> list[Block]:
        """Constraints and costs of the program."""
        problem, scale, layout = self.problem, self.scale, self.layout
        blocks = [self._piece_block(), self._duration_block(), self._direction_block()]
        if problem.total is not None:
            total = problem.total / scale.time
            all_pieces = layout.tau[:, None]
            blocks.append(
                Block(sum_kernel(layout.piece_count), all_pieces, bounds={"sum": (total, total)})
            )
        if problem.objective.effort:
            weight = problem.objective.effort * scale.time / self.typical_cost()
            parameters = {"units": scale.state[:, None], "weight": weight}
            kernel = work_kernel(problem.required_dynamics)
            blocks.append(Block(kernel, layout.piece_columns, parameters))
        allowed = self.tightening.allowed_utilisation
        return [*blocks, *robot_limit_blocks(problem, allowed, self.margin, scale, layout)]

    def _duration_block(self) -> Block:
        """Given durations of intervals, and lower bounds of unknown ones."""
        problem, layout = self.problem, self.layout
        is_unknown = problem.duration_is_unknown
        bounded = ~is_unknown | (problem.min_duration > 0.0)
        lower = np.where(is_unknown, problem.min_duration, problem.duration)[bounded]
        lower = lower / self.scale.time
        upper = np.where(is_unknown[bounded], np.inf, lower)
        pieces = layout.tau.reshape(layout.interval_count, -1)[bounded].T
        return Block(sum_kernel(layout.interval_pieces), pieces, bounds={"sum": (lower, upper)})

    def _direction_block(self) -> Block:
        """Velocities that are a direction with an unknown factor."""
        layout = self.layout
        v = layout.v[layout.waypoint_breaks][self.directed]
        directions = self.problem.velocity[self.directed] / self.scale.unit(1)
        columns = np.concatenate((v, layout.factor_columns[:, None]), axis=1).T
        return Block(direction_kernel(layout.joint_count), columns, {"direction": directions.T})

    def _piece_block(self) -> Block:
        """Equations, limits and costs of the pieces."""
        problem, scale, layout = self.problem, self.scale, self.layout
        objective, cost, total = problem.objective, self.typical_cost(), self.durations.sum()
        span = layout.interval_pieces * self.guess.span / scale.time
        max_jerk = (1.0 - self.margin) * problem.limits.jerk / scale.unit(3)
        usual_acceleration = np.minimum(problem.limits.acceleration, scale.unit(2))
        calmness = CALMNESS_WEIGHT * cost / (usual_acceleration**2 * total * layout.joint_count)
        weights = {
            "time_weight": objective.time * np.ones(1),
            "acceleration_weight": (objective.acceleration + calmness) * scale.unit(2) ** 2,
            "jerk_weight": objective.jerk * scale.unit(3) ** 2,
        }
        parameters = {
            "velocity_scale": 1.0 / span,
            "position_scale": 1.0 / span**2,
            "inverse_jerk": 1.0 / max_jerk[:, None],
            "evenness_weight": EVENNESS_WEIGHT * scale.time**2 / (self.guess.span * total),
            **{name: (weight * scale.time / cost)[:, None] for name, weight in weights.items()},
        }
        max_velocity = self._max_velocities()
        bounds = {"velocity_points": (-max_velocity, max_velocity), "jerk": (-np.inf, 0.0)}
        if self.tightening.limits_positions:
            bounds["position_points"] = self._positions_between()
        limits_jerk = bool(np.isfinite(problem.limits.jerk).any())
        kernel = piece_kernel(layout.joint_count, limits_jerk, self.tightening.limits_positions)
        return Block(kernel, layout.piece_columns, parameters, bounds)

    def typical_cost(self) -> float:
        """Typical value of the objective, by which it is divided to be of order one."""
        objective, total = self.problem.objective, float(self.durations.sum())
        cost = objective.time * total
        for weight, order in ((objective.jerk, 3), (objective.acceleration, 2)):
            cost += weight * float(np.sum((self.scale.unit(order)) ** 2) * total)
        if objective.effort:
            q = self.problem.position
            still = np.zeros_like(q)
            squares = self.problem.required_dynamics.effort(q, still, still) ** 2
            cost += objective.effort * float(squares.sum(axis=1).mean() * total)
        return cost or 1.0

    def _max_velocities(self) -> FloatArray:
        """Maximum velocities at two Bézier points of each piece, scaled, shape (2 d, pieces)."""
        layout, limit = self.layout, self.problem.limits.velocity
        shape = (2, layout.interval_count, layout.interval_pieces, layout.joint_count)
        points = np.broadcast_to((1.0 - self.margin) * limit, shape).copy()
        # with zero acceleration, the point next to the waypoint has its velocity
        passed = np.where(self._passes_at_limit(), 1.001 * limit, 0.0)
        points[0, :, 0] = np.maximum(points[0, :, 0], passed[:-1])
        points[1, :, -1] = np.maximum(points[1, :, -1], passed[1:])
        points /= self.scale.unit(1)
        return points.transpose(0, 3, 1, 2).reshape(-1, layout.piece_count)

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
        problem, layout, scale = self.problem, self.layout, self.scale
        v, a = x[layout.v] * scale.unit(1), x[layout.a] * scale.unit(2)
        spans = (x[layout.tau] * scale.time).reshape(layout.interval_count, -1)
        time = np.append(0.0, np.cumsum(self._exact_durations(spans.sum(axis=1))))
        share = spans / spans.sum(axis=1)[:, None]
        velocity_known = problem.velocity_known[:, None]
        velocity = np.where(velocity_known, problem.velocity, v[layout.waypoint_breaks])
        for column, i in zip(layout.factor_columns, self.directed, strict=True):
            velocity[i] = max(float(x[column]), 0.0) * problem.velocity[i]
        at_waypoints, acceleration_known = a[layout.waypoint_breaks], problem.acceleration_known
        at_waypoints[acceleration_known] = problem.acceleration[acceleration_known]
        at_waypoints[self._has_zero_acceleration()] = 0.0
        starts = np.arange(layout.interval_count)[:, None] * layout.interval_pieces
        acceleration = a[starts + np.arange(layout.interval_pieces + 1)]
        return time, exact_curve(time, share, problem.position, velocity, acceleration)

    def _exact_durations(self, durations: FloatArray) -> FloatArray:
        """Durations of the intervals [s] that meet the given ones to rounding, shape (n-1,)."""
        problem, is_unknown = self.problem, self.problem.duration_is_unknown
        durations = np.where(is_unknown, durations, problem.duration)
        if problem.total is not None:
            unknown_time = problem.total - durations[~is_unknown].sum()
            durations[is_unknown] *= unknown_time / durations[is_unknown].sum()
        return np.where(is_unknown, np.maximum(durations, problem.min_duration), durations)


def _scale(problem: TimingProblem, guess: States, time: float) -> Scale:
    """Units of a program with a unit of time [s]."""
    limits = problem.limits
    with np.errstate(invalid="ignore"):
        unit = np.minimum(limits.velocity * time, limits.acceleration * time**2)
        unit = np.minimum(unit, limits.jerk * time**3)
    travel = np.ptp(problem.position, axis=0)
    largest = float(travel.max()) or 1.0
    typical = np.maximum(travel, 1e-3 * largest)
    if problem.objective.jerk and not problem.duration_is_unknown.any():
        # given times set the scale of the motion, even if the limits are loose
        peak = np.abs(guess.a).max(axis=0)
        unit = np.minimum(unit, np.maximum(typical, peak * time**2))
    return Scale(time, np.where(np.isfinite(unit), unit, typical))
