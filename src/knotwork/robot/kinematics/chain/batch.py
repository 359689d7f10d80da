"""Damped least squares for many poses and starts at once, for `solve_pose_ik_batch`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.robot.kinematics.chain.joint_ranges import (
    Limits,
    clip_to_limits,
    find_blocked_joints,
    infinite_limits,
)
from knotwork.robot.kinematics.chain.levenberg_marquardt import (
    FIRST_FACTOR,
    HALVED_SQUARE,
    HASTY_BUDGET,
    MAX_FACTOR,
    MAX_STEP,
    SearchBudget,
)

BATCH_BUDGET = SearchBudget(patience=16)
"""Budget of a search for all solutions, more patient than a single search.

With a patience of twelve, one of three solutions of an arm without a closed form was missed.
"""
STRAGGLER_ITERATIONS = 20
"""Number of iterations after which a search is stopped if its error is not below `STRAGGLER_ERROR`.

Few such searches succeed, and they take as long as two new starts.
"""
STRAGGLER_ERROR = 0.03
"""Pose error [m, rad]; see `STRAGGLER_ITERATIONS`."""


@dataclass(frozen=True, eq=False)
class Targets:
    """Poses in the base frame.

    Attributes:
        position: Positions [m], shape (3, n).
        rotation: Rotation matrices, indices column, row, pose, shape (3, 3, n).
    """

    position: FloatArray
    rotation: FloatArray

    @classmethod
    def from_poses(cls, poses: Any) -> Targets:
        """Collect the positions and orientations of `pin.SE3` poses."""
        # One array per pose, because these arrays take longer than a step of a search.
        matrices = np.array([pose.homogeneous for pose in poses]).reshape(-1, 4, 4)
        matrices = np.ascontiguousarray(matrices.transpose(2, 1, 0))
        return cls(matrices[3, :3], matrices[:3, :3])

    def take(self, index: Any) -> Targets:
        """The targets at the given indices."""
        return Targets(self.position[:, index], self.rotation[:, :, index])

    def __len__(self) -> int:
        return int(self.position.shape[1])


@dataclass(frozen=True, eq=False)
class BatchSolution:
    """The ends of a batch of local searches.

    >>> robot = kw.load_robot("ur5")
    >>> home = robot.configurations["home"]
    >>> found = kw.kinematics.solve_pose_ik_batch(robot, [robot.forward(home)], home)
    >>> type(found).__name__, found.q.shape, found.converged
    ('BatchSolution', (1, 6), array([ True]))

    Attributes:
        q: Joint positions [rad or m], shape (n, d).
        position_error: Distance of the TCP from the pose [m], shape (n,).
        orientation_error: Angle from the pose [rad], shape (n,).
        converged: Whether each search ended within the tolerances, shape (n,).
        iterations: Steps of the longest search, without those of restarts.
    """

    q: FloatArray
    position_error: FloatArray
    orientation_error: FloatArray
    converged: Any
    iterations: int


def solve_batch(
    robot: Robot,
    targets: Targets,
    start: FloatArray,
    *,
    tolerance: float = 1e-9,
    limits: Limits | None = None,
    max_iterations: int = 60,
    hasty: bool = False,
) -> BatchSolution:
    """Search from each start for joints at a pose, by Levenberg–Marquardt as in `PoseSearch`.

    Args:
        robot: The arm.
        targets: n poses, or one for all starts.
        start: Joint positions, shape (n, d); clipped to the limits, by default none.
        tolerance: Tolerance of distance [m] and angle [rad].
        limits: Joint limits.
        max_iterations: Maximum number of steps.
        hasty: Whether searches give up early, because others may find a solution.
    """
    budget = HASTY_BUDGET if hasty else BATCH_BUDGET
    n, limits = len(start), infinite_limits(robot) if limits is None else limits
    q = clip_to_limits(start, limits)
    position, orientation = np.full((2, n), np.inf)
    index, factor, iterations = np.arange(n), np.full(n, FIRST_FACTOR), 0
    if len(targets) < n:
        targets = targets.take(np.zeros(n, dtype=int))
    box = limits[0][:, None], limits[1][:, None]
    states = _evaluate(robot, q.T, targets)
    checkpoint = states.square
    while True:
        converged = np.maximum(states.distance, states.angle) <= tolerance
        leaving = converged | (factor > MAX_FACTOR) | (iterations >= max_iterations)
        if iterations % budget.patience == budget.patience - 1:
            leaving |= states.square > HALVED_SQUARE * checkpoint
            checkpoint = states.square
        if iterations == STRAGGLER_ITERATIONS:
            leaving |= states.square > STRAGGLER_ERROR**2
        rows, staying = index[leaving], ~leaving
        q[rows] = states.q[:, leaving].T
        position[rows], orientation[rows] = states.distance[leaving], states.angle[leaving]
        if leaving.all():
            break
        if leaving.any():
            index, factor, checkpoint = index[staying], factor[staying], checkpoint[staying]
            targets = targets.take(staying)
            states = _SearchStates(*(values[..., staying] for values in states))
        iterations += 1
        trial = _evaluate(
            robot, clip_to_limits(states.q + _solve_steps(states, box, factor), box), targets
        )
        better = trial.square < states.square
        states = states.replace_where(better, trial)
        factor = np.where(better, np.maximum(0.2 * factor, budget.min_factor), 8 * factor)
    converged = np.maximum(position, orientation) <= tolerance
    return BatchSolution(q, position, orientation, converged=converged, iterations=iterations)


class _SearchStates(NamedTuple):
    """States of the searches of a batch; the last axis is the search, as in `JointAxes`."""

    q: FloatArray
    error: FloatArray
    J: FloatArray
    distance: FloatArray
    angle: FloatArray
    square: FloatArray

    def replace_where(self, better: Any, trial: _SearchStates) -> _SearchStates:
        """The states of `trial` where it is better, shape (n,)."""
        columns: Any = map(partial(np.where, better), trial, self)
        return _SearchStates(*columns)


def _evaluate(robot: Robot, q: FloatArray, targets: Targets) -> _SearchStates:
    tip, rotation, J = joint_axes(robot).compute_poses_and_jacobians(q.T)
    error, distance, angle = pose_errors(tip, rotation, targets.position, targets.rotation)
    return _SearchStates(q, error, J, distance, angle, np.einsum("in,in->n", error, error))


def _solve_steps(states: _SearchStates, limits: Limits, factor: FloatArray) -> FloatArray:
    """Solve (JᵀJ + λ² I) Δq = Jᵀe for each search, with joints fixed at limits, shape (d, n)."""
    gradient = np.einsum("kin,kn->in", states.J, states.error)
    blocked = find_blocked_joints(states.q, gradient, limits)
    gradient[blocked] = 0.0
    J = np.where(blocked, 0.0, states.J) if blocked.any() else states.J
    jacobians = np.ascontiguousarray(J.transpose(2, 0, 1))
    H = jacobians.transpose(0, 2, 1) @ jacobians
    # A singular matrix is not an error here. Entries are about 1, so 1e-13 is at the level of
    # rounding.
    H[:, range(len(gradient)), range(len(gradient))] += (factor * states.square + 1e-13)[:, None]
    step = np.ascontiguousarray(np.linalg.solve(H, gradient.T[:, :, None])[:, :, 0].T)
    return np.asarray(step * (MAX_STEP / np.maximum(np.abs(step).max(axis=0), MAX_STEP)))
