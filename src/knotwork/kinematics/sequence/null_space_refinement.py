"""Using the free motion of an arm with joints to spare, at its waypoints and between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.sequence.costs import AT_LIMIT
from knotwork.kinematics.sequence.nearness import SAMPLES, passage_nearness, weights
from knotwork.kinematics.solutions.enumeration import joint_axes
from knotwork.robot import Robot
from knotwork.waypoints import CartesianWaypoint, FloatArray

SWEEPS = 12
# Steps tried along the free motion [rad or m], either way, besides those towards the neighbours.
STEPS = (0.3, 0.08, 0.02)
# What is gained or moved by less ends it [s], [rad or m].
SMALLEST_GAIN = 1e-6
SMALLEST_MOVE = 1e-3
# What speeds beyond their limits cost at a waypoint and on average, and halfway between [s].
INFEASIBLE = 1e6
STRAINED = 1e5


@dataclass(frozen=True, eq=False)
class Way:
    """What is given of the way: where and when the arm has to be, and where it comes from.

    Attributes:
        times: Of the waypoints [s], shape (n,).
        waypoints: Those that may be moved along their free motion; `None` for those that may not.
        near: Configuration to be near at all of them, shape (d,), or `None` for least travel.
        origin: Configuration that the way to the first counts from, shape (d,), or `None`.
        samples: Times between two waypoints at which the way is looked at.
    """

    times: FloatArray
    waypoints: Sequence[CartesianWaypoint | None]
    near: FloatArray | None = None
    origin: FloatArray | None = None
    samples: int = SAMPLES


def settle_sequence(
    robot: Robot, way: Way, positions: FloatArray, velocities: FloatArray
) -> FloatArray:
    """Move each waypoint along its free motion to where the way through is better.

    Every other waypoint, then the others, and again: each tries steps along its free motion, and
    towards its neighbours, and takes the best. What is best is told by the cubics to and from the
    neighbours, looked at `samples` times each: with travel T, time h, and the mean n and the most
    m of the nearness to limits and singularities on the way, T (1 + n) + h m. Joint speeds beyond
    their limits count as in the choice of the sequence.

    Args:
        robot: The robot.
        way: What is given.
        positions: Joint positions at all waypoints [rad or m], shape (n, d).
        velocities: Joint velocities there [rad/s or m/s], shape (n, d).

    Returns:
        Joint positions with the same tool poses, shape (n, d).
    """
    settling = _Settling(robot, way, positions, velocities)
    movable = [i for i, waypoint in enumerate(way.waypoints) if waypoint is not None]
    for _ in range(SWEEPS):
        moved = [settling.improve([i for i in movable if i % 2 == odd]) for odd in (0, 1)]
        if max(moved) < SMALLEST_MOVE:
            break
    return settling.q


class _Settling:
    """The state of the waypoints while they are moved."""

    def __init__(
        self, robot: Robot, way: Way, positions: FloatArray, velocities: FloatArray
    ) -> None:
        self.robot, self.way = robot, way
        self.chain = joint_axes(robot)
        self.q, self.v = positions.copy(), velocities.copy()
        self.limit = robot.velocity_limit
        self.speed = np.where(np.isfinite(self.limit), self.limit, 1.0)
        self.durations = np.diff(way.times)
        posed = [w for w in way.waypoints if w is not None]
        self.targets = Targets.of([w.pose for w in posed])
        self.twists = np.array([np.concatenate([w.linear, w.angular]) for w in posed])
        numbers = np.cumsum([w is not None for w in way.waypoints]) - 1
        self.number = numbers  # of each waypoint among those that may be moved

    def improve(self, chosen: list[int]) -> float:
        """Move some waypoints, none beside another; how far the farthest went [rad or m]."""
        if not chosen:
            return 0.0
        owner, starts = self._starts(chosen)
        lower, upper = self.robot.lower_position_limit, self.robot.upper_position_limit
        targets = self.targets.take(self.number[owner])
        inside = np.minimum(np.maximum(starts, lower), upper)
        found = solve_batch(
            self.chain,
            targets,
            inside,
            tolerance=1e-10,
            lower=lower,
            upper=upper,
            max_iterations=12,
        )
        # Where it is now comes first, and ties leave it there.
        owner = np.concatenate([np.array(chosen), owner[found.converged]])
        q = np.vstack([self.q[chosen], found.q[found.converged]])
        v = solve_velocities(self.robot, q, self.twists[self.number[owner]])[0]
        cost = self._costs(owner, q, v)
        moved = 0.0
        for i in chosen:
            rows = np.flatnonzero(owner == i)
            best = rows[int(np.argmin(np.round(cost[rows], 9)))]
            if cost[best] < cost[rows[0]] - SMALLEST_GAIN:
                moved = max(moved, float(np.abs(q[best] - self.q[i]).max()))
                self.q[i], self.v[i] = q[best], v[best]
        return moved

    def _starts(self, chosen: list[int]) -> tuple[Any, FloatArray]:
        """Where to look: steps along the free motion of each waypoint, and towards neighbours."""
        _, _, Vt = np.linalg.svd(self.chain.jacobians(self.q[chosen]))
        owner: list[int] = []
        starts: list[FloatArray] = []
        for i, rows in zip(chosen, Vt[:, 6:], strict=True):
            free = [row / np.abs(row).max() for row in rows]
            tries = [sign * step * row for row in free for step in STEPS for sign in (1, -1)]
            towards = rows.T @ (rows @ (self._goal(i) - self.q[i]))
            tries += [towards, 0.5 * towards]
            starts += [self.q[i] + step for step in tries]
            owner += [i] * len(tries)
        return np.array(owner), np.array(starts)

    def _goal(self, i: int) -> FloatArray:
        if self.way.near is not None:
            return self.way.near
        beside = [self.q[k] for k in (i - 1, i + 1) if 0 <= k < len(self.q)]
        if i == 0 and self.way.origin is not None:
            beside.append(self.way.origin)
        return np.asarray(np.mean(beside, axis=0))

    def _costs(self, owner: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """What the way to each candidate and on from it costs [s], the neighbours as they are."""
        fastest = (np.abs(v) / self.limit).max(axis=1)
        cost = np.where(fastest > AT_LIMIT, INFEASIBLE * fastest, 0.0)
        nearness = 0.5 * (1.0 + weights(self.robot, q))
        if self.way.near is not None:
            cost += np.linalg.norm((q - self.way.near) / self.speed, axis=1) * nearness
            return cost
        if self.way.origin is not None:
            away = np.linalg.norm((q - self.way.origin) / self.speed, axis=1)
            cost += np.where(owner == 0, away * nearness, 0.0)
        for side in (-1, 1):
            beside = owner + side
            rows = np.flatnonzero((beside >= 0) & (beside < len(self.q)))
            if not rows.size:
                continue
            other = beside[rows]
            h = self.durations[np.minimum(owner[rows], other)]
            here, there = (q[rows], v[rows]), (self.q[other], self.v[other])
            (q0, v0), (q1, v1) = (here, there) if side > 0 else (there, here)
            move = np.abs(q1 - q0) / self.speed
            mean, most = passage_nearness(self.robot, q0, v0, q1, v1, h, self.way.samples)
            cost[rows] += np.linalg.norm(move, axis=1) * (1.0 + mean) + h * most
            fastest = (np.abs(q1 - q0) / self.limit).max(axis=1) / h
            middle = 1.5 * (q1 - q0) / h[:, None] - 0.25 * (v0 + v1)
            strain = (np.abs(middle) / self.limit).max(axis=1)
            for use, price in ((fastest, INFEASIBLE), (strain, STRAINED)):
                cost[rows] += np.where(use > AT_LIMIT, price * use, 0.0)
        return cost
