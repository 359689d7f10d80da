"""Null-space refinement: self-motion at the waypoints for a better motion between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import difference, limits_of
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.sequence.cost import least_index, make_cost
from knotwork.kinematics.sequence.nearness import weights
from knotwork.kinematics.sequence.step_costs import (
    OVERSPEED_FACTOR,
    JointRules,
    Layer,
    StepRules,
    step_costs,
)
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import CartesianWaypoint, FloatArray, IndexArray

REFINEMENT_SWEEPS = 12
# Lengths of candidate steps along the self-motion in both directions [rad or m].
SELF_MOTION_STEPS = (0.3, 0.08, 0.02)
# Move below which the refinement ends [rad or m].
SMALLEST_MOVE = 1e-3


@dataclass(frozen=True, eq=False)
class RefinementTask:
    """The task of a refinement.

    Attributes:
        joints: Rules for the joints.
        steps: Rules for each of the n - 1 intervals.
        waypoints: Waypoints that self-motion may move; `None` for fixed ones.
        near: Preferred configuration at all waypoints, shape (d,), or `None` for minimum travel.
        origin: Configuration before the first waypoint for its travel, shape (d,), or `None`.
        free_velocity: Waypoints whose speed is chosen later, by index.
    """

    joints: JointRules
    steps: Sequence[StepRules]
    waypoints: Sequence[CartesianWaypoint | None]
    near: FloatArray | None = None
    origin: FloatArray | None = None
    free_velocity: frozenset[int] = frozenset()


def refine_sequence(
    robot: Robot, task: RefinementTask, positions: FloatArray, velocities: FloatArray
) -> FloatArray:
    """Move waypoints along their self-motion to improve the whole motion.

    Waypoints with even and with odd indices move alternately. Candidates are steps along the
    self-motion and towards the neighbours. Each waypoint takes the one with the minimum cost of the
    steps from and to its neighbours.

    Args:
        robot: The robot.
        task: The data of the task.
        positions: Joint positions at all waypoints [rad or m], shape (n, d).
        velocities: Joint velocities at the waypoints [rad/s or m/s], shape (n, d).

    Returns:
        Joint positions with the same tool poses, shape (n, d).
    """
    refinement = _Refinement(robot, task, positions, velocities)
    movable = [i for i, waypoint in enumerate(task.waypoints) if waypoint is not None]
    for _ in range(REFINEMENT_SWEEPS):
        moves = [refinement.improve([i for i in movable if i % 2 == odd]) for odd in (0, 1)]
        if max(moves) < SMALLEST_MOVE:
            break
    return refinement.q


class _Refinement:
    """State of the waypoints during refinement."""

    def __init__(
        self, robot: Robot, task: RefinementTask, positions: FloatArray, velocities: FloatArray
    ) -> None:
        self.robot, self.task, self.axes = robot, task, joint_axes(robot)
        self.q, self.v = positions.copy(), velocities.copy()
        movable = [w for w in task.waypoints if w is not None]
        self.targets = Targets.from_poses([w.pose for w in movable])
        self.twists = np.array([np.concatenate([w.linear, w.angular]) for w in movable])
        # index of each waypoint among those that may be moved
        self.number = np.cumsum([w is not None for w in task.waypoints]) - 1
        # Rounds in which each waypoint last moved, and was last a candidate for a move.
        self.count = 1
        self.changed, self.tried = np.ones(len(positions), int), np.zeros(len(positions), int)

    def improve(self, chosen: list[int]) -> float:
        """Move some waypoints, no two of them neighbours, and give the largest move [rad or m]."""
        # only if the waypoint or a neighbour has moved since its last round
        chosen = [i for i in chosen if self.changed[max(i - 1, 0) : i + 2].max() > self.tried[i]]
        if not chosen:
            return 0.0
        self.tried[chosen], self.count = self.count, self.count + 1
        owner, starts = self._starts(chosen)
        trials = solve_batch(
            self.robot,
            self.targets.take(self.number[owner]),
            starts,
            tolerance=1e-10,
            limits=limits_of(self.robot),
            max_iterations=12,
        )
        # The present configuration is the first candidate, so a tie keeps it.
        owner = np.concatenate([np.array(chosen), owner[trials.converged]])
        q = np.vstack([self.q[chosen], trials.q[trials.converged]])
        J = self.axes.jacobians(q)
        v, _ = solve_velocities(self.robot, J, self.twists[self.number[owner]])
        v[np.isin(owner, list(self.task.free_velocity))] = 0.0
        largest = 0.0
        for i in chosen:
            rows = np.flatnonzero(owner == i)
            best = rows[least_index(self._costs(i, q[rows], v[rows], J[rows]))]
            if best != rows[0]:
                largest = max(largest, float(np.abs(q[best] - self.q[i]).max()))
                self.q[i], self.v[i] = q[best], v[best]
                self.changed[i] = self.count
        return largest

    def _starts(self, chosen: list[int]) -> tuple[IndexArray, FloatArray]:
        """Trial steps: along the self-motion of each waypoint, and towards its neighbours."""
        _, _, Vt = np.linalg.svd(self.axes.jacobians(self.q[chosen]))
        owner: list[int] = []
        starts: list[FloatArray] = []
        for i, rows in zip(chosen, Vt[:, 6:], strict=True):
            directions = [row / np.abs(row).max() for row in rows]
            trials = [k * d for d in directions for h in SELF_MOTION_STEPS for k in (h, -h)]
            towards = rows.T @ (rows @ self._to_goal(i))
            trials += [towards, 0.5 * towards]
            starts += [self.q[i] + step for step in trials]
            owner += [i] * len(trials)
        return np.array(owner), np.array(starts)

    def _to_goal(self, i: int) -> FloatArray:
        """Difference from a waypoint to `near`, whole turns aside, or to its neighbours' middle."""
        if self.task.near is not None:
            return difference(self.task.near, self.q[i], self.axes.revolute)
        neighbours = [self.q[k] for k in (i - 1, i + 1) if 0 <= k < len(self.q)]
        if i == 0 and self.task.origin is not None:
            neighbours.append(self.task.origin)
        return np.asarray(np.mean(neighbours, axis=0) - self.q[i])

    def _costs(self, i: int, q: FloatArray, v: FloatArray, J: FloatArray) -> FloatArray:
        """Cost of candidates at a waypoint with its neighbours fixed, shape (7, m)."""
        task = self.task
        use = (np.abs(v) / self.robot.velocity_limit).max(axis=1)
        weight, away = weights(self.robot, q, J), np.zeros_like(q)
        if task.near is not None:
            away = difference(q, task.near, self.axes.revolute)
        elif task.origin is not None and i == 0:
            away = q - task.origin
        cost = make_cost(
            len(q),
            infeasible=np.where(use > OVERSPEED_FACTOR, use, 0.0),
            travel=0.5 * (1.0 + weight) * np.linalg.norm(away / task.joints.scale, axis=1),
        )
        if task.near is not None:
            return cost
        layer = self._layer(q, v, weight)
        if i > 0:
            before = self._layer(self.q[i - 1, None], self.v[i - 1, None])
            cost = cost + step_costs(task.joints, task.steps[i - 1], before, layer)[0][:, 0]
        if i < len(task.steps):
            after = self._layer(self.q[i + 1, None], self.v[i + 1, None])
            cost = cost + step_costs(task.joints, task.steps[i], layer, after)[0][:, :, 0]
        return cost

    def _layer(self, q: FloatArray, v: FloatArray, weight: FloatArray | None = None) -> Layer:
        """Configurations as a layer of a sequence, at their present turns."""
        weight = weights(self.robot, q) if weight is None else weight
        return Layer(q, v, make_cost(len(q)), weight, np.empty((len(q), 0)), fixed=True)
