"""The cost of each step from one waypoint to the next."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.robot.kinematics.chain.joint_ranges import whole_turns
from knotwork.robot.kinematics.sequence.cost import COST_TIE, CostLevel, make_cost

OVERSPEED_FACTOR = 1.0 + 1e-9
"""Factor on the limit above which a speed is too high, so that rounding does not decide at the
limit.
"""
STEP_TOLERANCE = 1e-6
"""Distance of joint positions within which steps are the same [rad or m]."""
CUBIC_SAMPLES = (0.25, 0.5, 0.75)
"""Fractions of an interval at which cubics are compared with position limits."""
TRAVEL_WEIGHT = 0.1
"""Weight of the travel of all joints next to the time of the slowest joint."""


class Layer(NamedTuple):
    """Candidates at one waypoint, with what the cost of steps depends on.

    Attributes:
        q: Joint positions [rad or m], shape (m, d). Unbounded joints may differ by any number of
            turns, unless the layer is `fixed`.
        velocity: Joint velocities at each candidate [rad/s or m/s], shape (m, d).
        cost: Cost of each candidate, one row per `CostLevel`, m columns.
        weight: Factor on the travel from and to each candidate, shape (m,).
        flags: Configuration flags, shape (m, k); 0 for either.
        fixed: Whether the positions are given, including turns.
        group_row: In a group of dependent waypoints, the group row of each candidate, shape (m,).
        previous_q: The only previous configuration of each candidate [rad or m], shape (m, d);
            `None` where any may precede it.
    """

    q: FloatArray
    velocity: FloatArray
    cost: FloatArray
    weight: FloatArray
    flags: FloatArray
    fixed: bool = False
    group_row: IndexArray | None = None
    previous_q: FloatArray | None = None

    def select(self, index: Any) -> Layer:
        """The candidates at the given indices."""
        columns = self._replace(cost=self.cost.T)
        parts = (part[index] if isinstance(part, np.ndarray) else part for part in columns)
        return Layer._make(parts)._replace(cost=self.cost[:, index])


class BlockedStep(NamedTuple):
    """A step whose motion collides, or that has none.

    Attributes:
        start, end: Joint positions at its ends [rad or m], shape (d,).
        tolerance: Distance of other steps that count as this one [rad or m], shape (d,).
    """

    start: FloatArray
    end: FloatArray
    tolerance: FloatArray

    def matches(self, start: FloatArray, end: FloatArray, unbounded: BoolArray) -> BoolArray:
        """Whether each step from l to m candidates is this one; shape (l, m).

        Args:
            start: Joint positions of l candidates, shape (l, d).
            end: Joint positions of m candidates, shape (m, d).
            unbounded: Whether whole turns of each joint are ignored, shape (d,).
        """
        near: list[BoolArray] = []
        for q, blocked in ((start, self.start), (end, self.end)):
            difference = q - blocked
            difference -= np.where(unbounded, whole_turns(difference), 0.0)
            near.append(np.asarray((np.abs(difference) < self.tolerance).all(axis=1)))
        return near[0][:, None] & near[1][None, :]


class JointRules(NamedTuple):
    """Scales and limits of the joints for the cost of steps; arrays of shape (d,).

    Attributes:
        speed: Reference joint speeds [rad/s or m/s]: the velocity limits where given.
        limit: Velocity limits [rad/s or m/s], infinite where not given.
        lower, upper: Position limits [rad or m], infinite where not given.
        unbounded: Whether each joint is unbounded.
        weights: Weight of the travel of each joint.
        ramp: Time in which each joint reaches its reference speed [s].
    """

    speed: FloatArray
    limit: FloatArray
    lower: FloatArray
    upper: FloatArray
    unbounded: BoolArray
    weights: FloatArray
    ramp: FloatArray

    @property
    def scale(self) -> FloatArray:
        """Scale of travel [rad/s or m/s], shape (d,)."""
        return np.asarray(self.speed / self.weights)

    def travel(self, moves: FloatArray, rest_to_rest: bool) -> FloatArray:
        """Travel of moves (d, l, m) [s], shape (l, m).

        From rest to rest it is the time of the slowest joint, regardless of its weight, plus a
        fraction of the travel of all joints.
        """
        duration = np.abs(moves) / self.speed[:, None, None]
        travel: FloatArray = np.sqrt(np.einsum("jlm,j->lm", duration**2, self.weights**2))
        if not rest_to_rest:
            return travel
        ramp = self.ramp[:, None, None]
        longer = duration + ramp * (duration > 0.0)
        time = np.where(duration < ramp, 2.0 * np.sqrt(duration * ramp), longer).max(axis=0)
        return np.asarray(time + TRAVEL_WEIGHT / max(1.0, self.weights.max()) * travel)


class StepRules(NamedTuple):
    """Rules for the cost of the steps in one interval.

    Attributes:
        duration: Time for the step [s].
        branch_change: Whether the branch may change.
        is_timed: Whether the duration and the speeds at both ends are given. If one is chosen
            later, velocity limits do not restrict the step.
        rest_to_rest: Whether it is from rest to rest with a duration chosen later.
        blocked_steps: Steps that count as collisions.
    """

    duration: float
    branch_change: Literal["allowed", "avoided", "forbidden"] = "allowed"
    is_timed: bool = True
    rest_to_rest: bool = False
    blocked_steps: tuple[BlockedStep, ...] = ()


def compute_step_costs(
    joints: JointRules, rules: StepRules, start: Layer, end: Layer
) -> tuple[FloatArray, FloatArray]:
    """Compute the cost of each step between two waypoints, and the motion of the joints.

    Args:
        joints: Rules for the joints.
        rules: Rules for the interval.
        start: The l candidates at which steps start.
        end: The m candidates at which steps end.

    Returns:
        Costs, one (l, m) array per `CostLevel`, and the motion of the joints, shape (d, l, m).
    """
    shape = len(start.q), len(end.q)
    if end.previous_q is not None and start.group_row is not None and end.group_row is not None:
        moves = np.broadcast_to((end.q - end.previous_q).T[:, None, :], (end.q.shape[1], *shape))
        different = start.group_row[:, None] != end.group_row[None, :]
        travel = end.weight * joints.travel(moves[:, :1], rest_to_rest=False)
        cost = make_cost(*shape, impossible=np.where(different, np.inf, 0.0), travel=travel)
    else:
        moves = end.q.T[:, None, :] - start.q.T[:, :, None]
        if not end.fixed:
            moves[joints.unbounded] -= whole_turns(moves[joints.unbounded])
        weight = 0.5 * (start.weight[:, None] + end.weight[None, :])
        cost = make_cost(*shape, travel=weight * joints.travel(moves, rules.rest_to_rest))
        if rules.is_timed:
            utilisation = _utilisation(joints, moves / rules.duration)
            cost[CostLevel.OVERSPEED] = np.where(utilisation > OVERSPEED_FACTOR, utilisation, 0.0)
            cost[CostLevel.CUBIC_EXCESS] = _halfway_overspeed(
                joints, rules.duration, moves, start, end
            )
            cost[CostLevel.CUBIC_EXCESS] += _position_excess(joints, rules.duration, start, end)
        if rules.branch_change != "allowed":
            changed = (start.flags[:, None, :] * end.flags[None, :, :] < 0).any(axis=2)
            if rules.branch_change == "avoided":
                cost[CostLevel.CHANGES] = changed
            else:
                cost[CostLevel.IMPOSSIBLE] = np.where(changed, np.inf, 0.0)
    for step in rules.blocked_steps:
        cost[CostLevel.COLLISIONS] += step.matches(start.q, end.q, joints.unbounded)
    return cost, moves


def _utilisation(joints: JointRules, velocity: FloatArray) -> FloatArray:
    """Maximum utilisation of the velocity limits by velocities (d, l, m), shape (l, m)."""
    return np.asarray((np.abs(velocity) / joints.limit[:, None, None]).max(axis=0))


def _halfway_overspeed(
    joints: JointRules, duration: float, moves: FloatArray, start: Layer, end: Layer
) -> FloatArray:
    """Cost of cubics that are too fast halfway, shape (l, m)."""
    ends = start.velocity.T[:, :, None] + end.velocity.T[:, None, :]
    utilisation = _utilisation(joints, 1.5 / duration * moves - 0.25 * ends)
    return np.where(utilisation > OVERSPEED_FACTOR, 2.0 - 1.0 / np.maximum(utilisation, 1.0), 0.0)


def _position_excess(joints: JointRules, duration: float, start: Layer, end: Layer) -> FloatArray:
    """Cost of cubics beyond a position limit between waypoints, shape (l, m)."""
    # a cubic at rest at both ends stays between them
    moving = start.velocity.any(axis=0) | end.velocity.any(axis=0)
    rows = np.flatnonzero(moving & np.isfinite(joints.lower) & np.isfinite(joints.upper))
    outside = np.zeros((len(start.q), len(end.q)))
    lower, upper = (limit[rows, None, None] for limit in (joints.lower, joints.upper))
    if not rows.size:
        return outside
    for s in CUBIC_SAMPLES:
        r, h = 1.0 - s, duration * s * (1.0 - s)
        before = (1.0 + 2.0 * s) * r**2 * start.q[:, rows] + h * r * start.velocity[:, rows]
        after = (1.0 + 2.0 * r) * s**2 * end.q[:, rows] - h * s * end.velocity[:, rows]
        q = before.T[:, :, None] + after.T[:, None, :]
        np.maximum(outside, np.maximum(q - upper, lower - q).max(axis=0), out=outside)
    return np.where(outside > COST_TIE, 1.0 + outside, 0.0)
