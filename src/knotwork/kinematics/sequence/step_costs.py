"""The cost of each step from one waypoint to the next."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from knotwork.kinematics.chain.joint_ranges import BoolArray, whole_turns
from knotwork.kinematics.sequence.cost import TIE, Cost
from knotwork.waypoints import FloatArray

# A speed is too high above this factor on the limit: at the limit rounding must not decide.
AT_LIMIT = 1.0 + 1e-9
# Joint positions within this distance belong to the same step [rad or m].
SAME_STEP = 1e-6
# Fractions of an interval at which cubics are compared with position limits.
PLACES = (0.25, 0.5, 0.75)
# Weight of the travel of all joints next to the time of the slowest joint.
BESIDE = 0.1


class Layer(NamedTuple):
    """The candidates at one waypoint.

    Attributes:
        q: Joint positions [rad or m], shape (m, d). Unbounded joints may differ by any number of
            turns, unless the layer is `fixed`.
        cost: Cost of each candidate; its travel of shape (m,).
        weight: Factor on the travel from and to each candidate, shape (m,).
        flags: Configuration flags, shape (m, k); 0 for either.
        fixed: The positions are given, including turns.
        velocity: Joint velocities at each candidate [rad/s or m/s], shape (m, d), or `None` to
            ignore joint speeds between waypoints.
        way: In a group of dependent waypoints, the group row of each candidate, shape (m,).
        before: The only previous configuration of each candidate [rad or m], shape (m, d); `None`
            where any may precede it.
    """

    q: FloatArray
    cost: Cost
    weight: FloatArray
    flags: FloatArray
    fixed: bool = False
    velocity: FloatArray | None = None
    way: Any = None
    before: FloatArray | None = None

    def take(self, index: Any) -> Layer:
        """The candidates at the given indices."""
        parts = (one[index] if isinstance(one, np.ndarray) else one for one in self)
        return Layer._make(parts)._replace(cost=self.cost.take(index).without_zeros())


class CollidingStep(NamedTuple):
    """A step whose motion collided.

    Attributes:
        interval: Index of the interval.
        start, end: Joint positions at its ends [rad or m], shape (d,).
    """

    interval: int
    start: FloatArray
    end: FloatArray

    def among(
        self, start: FloatArray, end: FloatArray, unbounded: BoolArray, apart: Any = SAME_STEP
    ) -> BoolArray:
        """Whether each step from l to m candidates is this one; shape (l, m).

        Args:
            start: Joint positions of l candidates, shape (l, d).
            end: Joint positions of m candidates, shape (m, d).
            unbounded: Whether whole turns of each joint are ignored, shape (d,).
            apart: Distance within which joint positions are equal [rad or m].
        """
        near = []
        for q, own in ((start, self.start), (end, self.end)):
            gap = q - own
            gap -= np.where(unbounded, whole_turns(gap), 0.0)
            near.append((np.abs(gap) < apart).all(axis=1))
        return np.asarray(near[0][:, None] & near[1][None, :])


class Rules(NamedTuple):
    """Rules for the cost of a step from one waypoint to the next.

    Attributes:
        speed: Reference joint speeds [rad/s or m/s], shape (d,): the velocity limits where given.
        limit: Velocity limits [rad/s or m/s], shape (d,), infinite where not given.
        lower, upper: Position limits [rad or m], likewise.
        unbounded: Whether each joint is unbounded, shape (d,).
        avoided: Whether a change of branch is to be avoided in each interval, shape (n - 1,), or
            one value for all.
        forbidden: Whether a change of branch is forbidden.
        colliding: Steps whose motion collided.
        apart: Distance within which a step counts as a colliding one [rad or m], shape (d,) or a
            number.
        untimed: Whether the duration or end speeds of each interval are chosen later, shape
            (n - 1,), so that no joint is too fast; `None` for none.
        weights: Weight of the travel of each joint, shape (d,) or a number.
        resting: Whether each interval is from rest to rest with a duration chosen later, shape
            (n - 1,), or `None`: its travel is the time of the slowest joint, whatever its weight.
        ramp: Time of each joint to its speed [s], shape (d,), or a number.
    """

    speed: FloatArray
    limit: FloatArray
    unbounded: BoolArray
    lower: Any = -np.inf
    upper: Any = np.inf
    avoided: bool | BoolArray = False
    forbidden: bool = False
    colliding: tuple[CollidingStep, ...] = ()
    untimed: BoolArray | None = None
    weights: Any = 1.0
    resting: BoolArray | None = None
    ramp: Any = 0.0
    apart: Any = SAME_STEP

    @property
    def scale(self) -> FloatArray:
        """Scale of travel [rad/s or m/s], shape (d,)."""
        return np.asarray(self.speed / self.weights)

    @property
    def beside(self) -> float:
        """Weight of travel next to time, normalised by the largest joint weight."""
        return BESIDE / float(max(1.0, np.max(self.weights)))

    def of(self, joints: Any) -> Rules:
        """Rules for some of the joints, by index."""
        keys = ("speed", "limit", "unbounded", "lower", "upper", "weights", "ramp")
        values = np.broadcast_arrays(*(getattr(self, key) for key in keys))
        return self._replace(**{k: one[joints] for k, one in zip(keys, values, strict=True)})

    def travel(self, interval: Any, move: FloatArray) -> FloatArray:
        """Travel in intervals [s] of joints that move by `move`, shape (..., d)."""
        share = np.abs(move) / self.speed
        travel = np.asarray(np.linalg.norm(share * self.weights, axis=-1))
        if self.resting is None:
            return travel
        slowest = least_time(share, self.ramp).max(axis=-1)
        return np.asarray(np.where(self.resting[interval], slowest + self.beside * travel, travel))


def least_time(share: FloatArray, ramp: Any) -> FloatArray:
    """Minimum time from rest to rest [s], from distance over maximum speed and ramp time [s]."""
    longer = share + ramp * (share > 0.0)
    return np.asarray(np.where(share < ramp, 2.0 * np.sqrt(share * ramp), longer))


class Reached(NamedTuple):
    """The candidates of a layer that are kept, and the cheapest sequence to each.

    Attributes:
        layer: The candidates kept, at the turns that they reach; their cost includes the sequence.
        index: Indices of these candidates in the whole layer, shape (m,).
        came: Indices of their predecessors among those kept of the previous layer, shape (m,).
    """

    layer: Layer
    index: Any
    came: Any


def step_costs(
    rules: Rules, start: Layer, layer: Layer, duration: float, interval: int
) -> tuple[Cost, FloatArray]:
    """Cost of each step between two waypoints, and the motion of unbounded joints.

    Args:
        rules: Rules for the cost of steps.
        start: The l candidates at which steps start.
        layer: The m candidates at which steps end.
        duration: Time for the step [s].
        interval: Index of the interval.

    Returns:
        Costs, shape (l, m), and the motion of the unbounded joints, shape (u, l, m).
    """
    cost, turns = _step_costs(rules, start, layer, duration, interval)
    for step in rules.colliding:
        if step.interval == interval:
            found = step.among(start.q, layer.q, rules.unbounded, rules.apart)
            cost = cost._replace(collisions=cost.collisions + found.astype(float))
    return cost, turns


def _step_costs(
    rules: Rules, start: Layer, layer: Layer, duration: float, interval: int
) -> tuple[Cost, FloatArray]:
    if layer.before is not None:
        return _steps_along(rules, start, layer, layer.before)
    shape = len(start.q), len(layer.q)
    fastest, halfway, square, slowest = np.zeros((4, *shape))
    resting = rules.resting is not None and bool(rules.resting[interval])
    move, size = np.empty((2, *shape))
    free = rules.unbounded & (not layer.fixed)
    turns = np.empty((int(free.sum()), *shape))
    row = iter(turns)
    # Joint by joint, so that the data stay in the processor's cache.
    weights, ramp = (np.broadcast_to(one, rules.speed.shape) for one in (rules.weights, rules.ramp))
    for j, speed in enumerate(rules.speed.tolist()):
        np.subtract.outer(start.q[:, j], layer.q[:, j], out=move)
        if free[j]:
            turn = next(row)
            np.subtract(whole_turns(move), move, out=turn)
            np.negative(turn, out=move)
        move *= 1.0 / speed
        if np.isfinite(rules.limit[j]):
            np.maximum(fastest, np.abs(move, out=size), out=fastest)
            if start.velocity is not None and layer.velocity is not None:
                # Speed of the cubic at its midpoint: 3/2 Δq/h − (v₀ + v₁)/4.
                v0, v1 = start.velocity[:, j], layer.velocity[:, j]
                np.multiply(move, 1.5 / duration, out=size)
                size += np.add.outer((0.25 / speed) * v0, (0.25 / speed) * v1)
                np.maximum(halfway, np.abs(size, out=size), out=halfway)
        if resting:
            np.maximum(slowest, least_time(np.abs(move), ramp[j]), out=slowest)
        if weights[j] != 1.0:
            move *= weights[j]
        move *= move
        square += move
    fastest /= duration
    travel = np.sqrt(square)
    if resting:
        travel = slowest + rules.beside * travel
    travel *= 0.5 * (start.weight[:, None] + layer.weight[None, :])
    infeasible: Any = 0.0
    violation: Any = 0.0
    untimed = rules.untimed is not None and bool(rules.untimed[interval])
    if untimed:
        fastest[:] = halfway[:] = 0.0
    if (beyond := fastest > AT_LIMIT).any():
        infeasible = np.where(beyond, fastest, 0.0)
    if (beyond := halfway > AT_LIMIT).any():
        violation = np.where(beyond, 2.0 - 1.0 / np.maximum(halfway, 1.0), 0.0)
    if not untimed:
        violation = violation + _outside_between(rules, start, layer, duration)
    avoided = bool(np.ravel(rules.avoided)[interval if np.ndim(rules.avoided) else 0])
    cost = Cost(infeasible=infeasible, violation=violation, travel=travel)
    if avoided or rules.forbidden:
        cost = _with_changes(cost, rules, start, layer)
    return cost, turns


def _with_changes(cost: Cost, rules: Rules, start: Layer, layer: Layer) -> Cost:
    """Cost of steps with that of changes of branch."""
    product = start.flags[:, None, :] * layer.flags[None, :, :]
    changed = (product < 0).any(axis=2)
    if not changed.any():
        return cost
    if rules.forbidden:
        return cost._replace(impossible=np.where(changed, np.inf, 0.0))
    return cost._replace(changes=changed.astype(float))


def _outside_between(rules: Rules, start: Layer, layer: Layer, duration: float) -> Any:
    """Cost of cubics beyond a position limit between waypoints; 0 or shape (l, m)."""
    v0, v1 = start.velocity, layer.velocity
    if v0 is None or v1 is None:
        return 0.0
    outside = np.zeros((len(start.q), len(layer.q)))
    _, lower, upper = np.broadcast_arrays(rules.speed, rules.lower, rules.upper)
    # a cubic at rest at both ends stays between them
    moving = v0.any(axis=0) | v1.any(axis=0)
    for j in np.flatnonzero(moving & np.isfinite(lower) & np.isfinite(upper)):
        for s in PLACES:
            r, h = 1.0 - s, duration * s * (1.0 - s)
            before = (1.0 + 2.0 * s) * r**2 * start.q[:, j] + h * r * v0[:, j]
            after = (1.0 + 2.0 * r) * s**2 * layer.q[:, j] - h * s * v1[:, j]
            q = np.add.outer(before, after)
            np.maximum(outside, np.maximum(q - upper[j], lower[j] - q), out=outside)
    return np.where(outside > TIE, 1.0 + outside, 0.0) if outside.any() else 0.0


def _steps_along(
    rules: Rules, start: Layer, layer: Layer, before: FloatArray
) -> tuple[Cost, FloatArray]:
    """Steps where each candidate has exactly one predecessor."""
    shape = len(start.q), len(layer.q)
    move = layer.q - before
    travel = layer.weight * np.linalg.norm(move / rules.scale, axis=1)
    other = start.way[:, None] != layer.way[None, :]
    turns = np.broadcast_to(move.T[rules.unbounded][:, None, :], (rules.unbounded.sum(), *shape))
    cost = Cost(
        impossible=np.where(other, np.inf, 0.0), travel=np.broadcast_to(travel, shape).copy()
    )
    return cost, turns
