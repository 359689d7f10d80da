"""Null-space refinement: self-motion at the waypoints for a better motion between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import difference, limits_of
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.sequence.nearness import SAMPLES, interval_nearness, weights
from knotwork.kinematics.sequence.step_costs import AT_LIMIT, Rules, likely_durations
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import CartesianWaypoint, FloatArray

SWEEPS = 12
# Steps tried along the self-motion [rad or m], either way, besides those towards the neighbours.
STEPS = (0.3, 0.08, 0.02)
# Smaller gains and moves end it [s], [rad or m].
SMALLEST_GAIN = 1e-6
SMALLEST_MOVE = 1e-3


@dataclass(frozen=True, eq=False)
class Given:
    """The task: where and when the arm has to be, and where it comes from.

    Attributes:
        times: Of the waypoints [s], shape (n,).
        rules: What steps cost.
        waypoints: Those that may be moved by self-motion; `None` for those that may not.
        near: Configuration to be near at all of them, shape (d,), or `None` for least travel.
        origin: Configuration that the travel to the first counts from, shape (d,), or `None`.
        samples: Times between two waypoints at which intervals are evaluated.
        free_velocity: Waypoints whose speed is chosen later, by index.
    """

    times: FloatArray
    rules: Rules
    waypoints: Sequence[CartesianWaypoint | None]
    near: FloatArray | None = None
    origin: FloatArray | None = None
    samples: int = SAMPLES
    free_velocity: frozenset[int] = frozenset()


def refine_sequence(
    robot: Robot, given: Given, positions: FloatArray, velocities: FloatArray
) -> FloatArray:
    """Move each waypoint along its self-motion to where the whole motion is better.

    Every other waypoint, then the others, and again: each tries steps along its self-motion, and
    towards its neighbours, and takes the best. The cubics to and from the neighbours, evaluated at
    `samples` times each, are compared: with travel T, time h, and the mean n and the most m of
    the nearness to limits and singularities on the way, T (1 + n) + h m. As in the choice of the
    sequence, joint speeds beyond their limits count before that, then violations halfway, then
    positions beyond limits.

    Args:
        robot: The robot.
        given: The data of the task.
        positions: Joint positions at all waypoints [rad or m], shape (n, d).
        velocities: Joint velocities there [rad/s or m/s], shape (n, d).

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
    """The state of the waypoints while they are moved."""

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
        # When each waypoint was moved and when it was tried last, in rounds.
        self.count = 1
        self.changed, self.tried = np.ones(len(positions), int), np.zeros(len(positions), int)

    def improve(self, chosen: list[int]) -> float:
        """Move some waypoints, no two of them neighbours; how far the farthest went [rad or m]."""
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
        # Where it is now comes first, and ties leave it there.
        owner = np.concatenate([np.array(chosen), owner[found.converged]])
        q = np.vstack([self.q[chosen], found.q[found.converged]])
        J = self.chain.jacobians(q)
        v, _ = solve_velocities(self.robot, J, self.twists[self.number[owner]])
        v[np.isin(owner, list(self.given.free_velocity))] = 0.0
        *before, travel = self._costs(owner, q, v, J)
        moved = 0.0
        for i in chosen:
            rows = np.flatnonzero(owner == i)
            keys = [np.round(level[rows], 9) for level in (travel, *reversed(before))]
            best = rows[int(np.lexsort(keys)[0])]
            better = any(level[best] < level[rows[0]] - 1e-9 for level in before)
            if better or travel[best] < travel[rows[0]] - SMALLEST_GAIN:
                moved = max(moved, float(np.abs(q[best] - self.q[i]).max()))
                self.q[i], self.v[i] = q[best], v[best]
                self.changed[i] = self.count
        return moved

    def _since_moved(self, i: int) -> bool:
        """Whether a waypoint or a neighbour has moved since it was tried last."""
        return bool(self.changed[max(i - 1, 0) : i + 2].max() > self.tried[i])

    def _starts(self, chosen: list[int]) -> tuple[Any, FloatArray]:
        """Where to look: steps along the self-motion of each waypoint, and towards neighbours."""
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
        """From a waypoint to `near`, whole turns aside, or to the middle of its neighbours."""
        if self.given.near is not None:
            return difference(self.given.near, self.q[i], self.chain.revolute)
        beside = [self.q[k] for k in (i - 1, i + 1) if 0 <= k < len(self.q)]
        if i == 0 and self.given.origin is not None:
            beside.append(self.given.origin)
        return np.asarray(np.mean(beside, axis=0) - self.q[i])

    def _costs(
        self, owner: Any, q: FloatArray, v: FloatArray, J: FloatArray
    ) -> tuple[FloatArray, ...]:
        """Cost of each candidate, its neighbours as they are.

        Returns:
            How much is infeasible, mid-interval violations, positions beyond limits [rad or m] and
            weighted travel [s], shape (n,) each, the first to count before the others.
        """
        at_waypoint = (np.abs(v) / self.limit).max(axis=1)
        infeasible = np.where(at_waypoint > AT_LIMIT, at_waypoint, 0.0)
        violation, outside, travel = np.zeros((3, len(q)))
        weight = weights(self.robot, q, J)
        nearness = 0.5 * (1.0 + weight)
        if self.given.near is not None:
            gap = difference(q, self.given.near, self.chain.revolute)
            away = np.linalg.norm(gap / self.rules.scale, axis=1)
            return infeasible, violation, outside, away * nearness
        if self.given.origin is not None:
            away = np.linalg.norm((q - self.given.origin) / self.rules.scale, axis=1)
            travel += np.where(owner == 0, away * nearness, 0.0)
        # Intervals to both neighbours at once.
        owners = np.tile(np.arange(len(q)), 2)
        beside = np.concatenate([owner - 1, owner + 1])
        there = np.flatnonzero((beside >= 0) & (beside < len(self.q)))
        rows, other = owners[there], beside[there]
        first = np.minimum(owner[rows], other)
        onward = (other > owner[rows])[:, None]
        ends = (q[rows], self.q[other]), (v[rows], self.v[other])
        (q0, q1), (v0, v1) = ((np.where(onward, a, b), np.where(onward, b, a)) for a, b in ends)
        move = q1 - q0
        h = likely_durations(self.rules, self.durations[first], first, move)
        at_ends = weight[rows], weights(self.robot, self.q)[other]
        mean, most, off = interval_nearness(
            self.robot, (q0, v0), (q1, v1), h, self.given.samples, at_ends
        )
        way = self.rules.travel(first, move) * (1.0 + mean) + h * most
        fastest = (np.abs(move) / self.limit).max(axis=1) / h
        middle = 1.5 * move / h[:, None] - 0.25 * (v0 + v1)
        halfway = (np.abs(middle) / self.limit).max(axis=1)
        if self.rules.untimed is not None:
            fastest[self.rules.untimed[first]] = halfway[self.rules.untimed[first]] = 0.0
        np.add.at(outside, rows, off)
        np.add.at(travel, rows, way)
        np.add.at(infeasible, rows, np.where(fastest > AT_LIMIT, fastest, 0.0))
        np.add.at(violation, rows, np.where(halfway > AT_LIMIT, halfway, 0.0))
        return infeasible, violation, outside, travel
