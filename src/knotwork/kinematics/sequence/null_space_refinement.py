"""Null-space refinement: self-motion at the waypoints for a better motion between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import difference, limits_of
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.sequence.cost import Cost
from knotwork.kinematics.sequence.nearness import weights
from knotwork.kinematics.sequence.step_costs import AT_LIMIT, Layer, Rules, step_costs
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import CartesianWaypoint, FloatArray

SWEEPS = 12
# Steps tried along the self-motion [rad or m], either way, besides those towards the neighbours.
STEPS = (0.3, 0.08, 0.02)
# Smaller moves end the refinement [rad or m].
SMALLEST_MOVE = 1e-3


@dataclass(frozen=True, eq=False)
class Given:
    """The task of a refinement.

    Attributes:
        times: Times of the waypoints [s], shape (n,).
        rules: Rules for the cost of steps.
        waypoints: Waypoints that self-motion may move; `None` for fixed ones.
        near: Preferred configuration at all waypoints, shape (d,), or `None` for minimum travel.
        origin: Configuration before the first waypoint for its travel, shape (d,), or `None`.
        free_velocity: Waypoints whose speed is chosen later, by index.
    """

    times: FloatArray
    rules: Rules
    waypoints: Sequence[CartesianWaypoint | None]
    near: FloatArray | None = None
    origin: FloatArray | None = None
    free_velocity: frozenset[int] = frozenset()


def refine_sequence(
    robot: Robot, given: Given, positions: FloatArray, velocities: FloatArray
) -> FloatArray:
    """Move waypoints along their self-motion to improve the whole motion.

    Alternately every other waypoint and the rest try steps along their self-motion and towards
    their neighbours. Each takes the best one, by the cost of the steps from and to its neighbours.

    Args:
        robot: The robot.
        given: The data of the task.
        positions: Joint positions at all waypoints [rad or m], shape (n, d).
        velocities: Joint velocities at the waypoints [rad/s or m/s], shape (n, d).

    Returns:
        Joint positions with the same tool poses, shape (n, d).
    """
    refinement = _Refinement(robot, given, positions, velocities)
    movable = [i for i, waypoint in enumerate(given.waypoints) if waypoint is not None]
    for _ in range(SWEEPS):
        moved = [refinement.improve([i for i in movable if i % 2 == odd]) for odd in (0, 1)]
        if max(moved) < SMALLEST_MOVE:
            break
    return refinement.q


class _Refinement:
    """State of the waypoints during refinement."""

    def __init__(
        self, robot: Robot, given: Given, positions: FloatArray, velocities: FloatArray
    ) -> None:
        self.robot, self.given = robot, given
        self.chain = joint_axes(robot)
        self.q, self.v = positions.copy(), velocities.copy()
        self.limit, self.rules = robot.velocity_limit, given.rules
        self.durations = np.diff(given.times)
        posed = [w for w in given.waypoints if w is not None]
        self.targets = Targets.of([w.pose for w in posed])
        self.twists = np.array([np.concatenate([w.linear, w.angular]) for w in posed])
        numbers = np.cumsum([w is not None for w in given.waypoints]) - 1
        self.number = numbers  # of each waypoint among those that may be moved
        # Rounds in which each waypoint was last moved and last tried.
        self.count = 1
        self.changed, self.tried = np.ones(len(positions), int), np.zeros(len(positions), int)

    def improve(self, chosen: list[int]) -> float:
        """Move some waypoints, no two of them neighbours, and give the largest move [rad or m]."""
        chosen = [i for i in chosen if self._since_moved(i)]
        if not chosen:
            return 0.0
        self.tried[chosen], self.count = self.count, self.count + 1
        owner, starts = self._starts(chosen)
        found = solve_batch(
            self.robot,
            self.targets.take(self.number[owner]),
            starts,
            tolerance=1e-10,
            limits=limits_of(self.robot),
            max_iterations=12,
        )
        # The present configuration comes first, and ties keep it.
        owner = np.concatenate([np.array(chosen), owner[found.converged]])
        q = np.vstack([self.q[chosen], found.q[found.converged]])
        J = self.chain.jacobians(q)
        v, _ = solve_velocities(self.robot, J, self.twists[self.number[owner]])
        v[np.isin(owner, list(self.given.free_velocity))] = 0.0
        moved = 0.0
        for i in chosen:
            rows = np.flatnonzero(owner == i)
            best = rows[int(self._costs(i, q[rows], v[rows], J[rows]).first_least())]
            if best != rows[0]:
                moved = max(moved, float(np.abs(q[best] - self.q[i]).max()))
                self.q[i], self.v[i] = q[best], v[best]
                self.changed[i] = self.count
        return moved

    def _since_moved(self, i: int) -> bool:
        """Whether a waypoint or a neighbour has moved since it was tried last."""
        return bool(self.changed[max(i - 1, 0) : i + 2].max() > self.tried[i])

    def _starts(self, chosen: list[int]) -> tuple[Any, FloatArray]:
        """Trial steps: along the self-motion of each waypoint, and towards its neighbours."""
        _, _, Vt = np.linalg.svd(self.chain.jacobians(self.q[chosen]))
        owner: list[int] = []
        starts: list[FloatArray] = []
        for i, rows in zip(chosen, Vt[:, 6:], strict=True):
            free = [row / np.abs(row).max() for row in rows]
            tries = [sign * step * row for row in free for step in STEPS for sign in (1, -1)]
            towards = rows.T @ (rows @ self._to_goal(i))
            tries += [towards, 0.5 * towards]
            starts += [self.q[i] + step for step in tries]
            owner += [i] * len(tries)
        return np.array(owner), np.array(starts)

    def _to_goal(self, i: int) -> FloatArray:
        """Difference from a waypoint to `near`, whole turns aside, or to its neighbours' middle."""
        if self.given.near is not None:
            return difference(self.given.near, self.q[i], self.chain.revolute)
        beside = [self.q[k] for k in (i - 1, i + 1) if 0 <= k < len(self.q)]
        if i == 0 and self.given.origin is not None:
            beside.append(self.given.origin)
        return np.asarray(np.mean(beside, axis=0) - self.q[i])

    def _costs(self, i: int, q: FloatArray, v: FloatArray, J: FloatArray) -> Cost:
        """Cost of candidates at a waypoint with its neighbours fixed, shape (m,) each."""
        speed = (np.abs(v) / self.limit).max(axis=1)
        weight, away = weights(self.robot, q, J), np.zeros(len(q))
        if self.given.near is not None:
            away = difference(q, self.given.near, self.chain.revolute)
            away = np.linalg.norm(away / self.rules.scale, axis=1)
        elif self.given.origin is not None and i == 0:
            away = np.linalg.norm((q - self.given.origin) / self.rules.scale, axis=1)
        excess = np.where(speed > AT_LIMIT, speed, 0.0)
        cost = Cost(infeasible=excess, travel=0.5 * (1.0 + weight) * away)
        if self.given.near is not None:
            return cost
        own = self._layer(q, v, weight)
        for k in (i - 1, i):
            if 0 <= k < len(self.durations):
                end = k if k < i else i + 1
                beside = self._layer(self.q[end, None], self.v[end, None])
                ends = (beside, own) if k < i else (own, beside)
                steps, _ = step_costs(self.rules, *ends, float(self.durations[k]), k)
                cost = cost.plus(steps.take((0,) if k < i else (slice(None), 0)))
        return cost

    def _layer(self, q: FloatArray, v: FloatArray, weight: FloatArray | None = None) -> Layer:
        """Configurations as a layer of a sequence, at their present turns."""
        weight = weights(self.robot, q) if weight is None else weight
        return Layer(q, Cost(), weight, np.empty((len(q), 0)), fixed=True, velocity=v)
