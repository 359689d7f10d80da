"""Damped least squares for many poses and starts at once, for `solve_pose_ik_batch`."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import Any, TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from knotwork.kinematics.chain.joint_ranges import BoolArray, Limits, clipped, held_joints
from knotwork.kinematics.chain.levenberg_marquardt import (
    FIRST_FACTOR,
    HASTY,
    MAX_FACTOR,
    MAX_STEP,
    USUAL,
)
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.waypoints import FloatArray

IntArray: TypeAlias = NDArray[np.intp]

# Every few iterations, searches that are not down to this part of their error are given up.
CHECK_EVERY = 8
FALLEN_TO = 0.5
# Most searches that succeed are within `CLOSE` after `PATIENCE` iterations; to wait for
# the others takes as long as two new starts.
PATIENCE = 20
NEAR = 0.03
# The same for searches for any solution, which others follow.
HASTY_CHECK_EVERY = 5
HASTY_FALLEN_TO = 0.25
# Fewer searches than these are stepped one matrix after the other.
FEW = 150
SMALLEST_PIVOT = 1e-15


@dataclass(frozen=True, eq=False)
class Targets:
    """Poses in the base frame.

    Attributes:
        position: [m], shape (3, n).
        rotation: Column, row, pose: shape (3, 3, n).
    """

    position: FloatArray
    rotation: FloatArray

    @classmethod
    def of(cls, poses: Any) -> Targets:
        """Collect the positions and orientations of `pin.SE3` poses."""
        # One array a pose: to make them takes longer than a step of a search.
        matrices = np.array([pose.homogeneous for pose in poses]).reshape(-1, 4, 4)
        matrices = np.ascontiguousarray(matrices.transpose(2, 1, 0))
        return cls(matrices[3, :3], matrices[:3, :3])

    def take(self, index: Any) -> Targets:
        """The targets of the given indices."""
        return Targets(self.position[:, index], self.rotation[:, :, index])

    def pose(self, index: int) -> Any:
        """One of them as `pin.SE3`."""
        return pin.SE3(self.rotation[:, :, index].T.copy(), self.position[:, index].copy())

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
        orientation_error: Angle from it [rad], shape (n,).
        converged: Which ended within the tolerances, shape (n,).
        iterations: Steps of the longest search.
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
    group: IntArray | None = None,
) -> BatchSolution:
    """Search from each start for the joint positions that bring the TCP to its pose.

    Levenberg–Marquardt with damping in proportion to the squared error, as in `PoseSearch`, for
    all searches in step; those that have ended or stalled leave the batch.

    Args:
        robot: The arm.
        targets: n poses, or one for all starts.
        start: Joint positions, shape (n, d); brought inside the limits.
        tolerance: Of distance [m] and angle [rad].
        limits: To stay within; by default none.
        max_iterations: Steps at most.
        hasty: Give up soon: there are other searches for a solution, whichever it is.
        group: Number of the group that each search belongs to, shape (n,): once one of a group
            has converged, the others are given up.
    """
    check_every, fallen_to = (
        (HASTY_CHECK_EVERY, HASTY_FALLEN_TO) if hasty else (CHECK_EVERY, FALLEN_TO)
    )
    n = len(start)
    q = np.array(start) if limits is None else clipped(start, limits)
    best_position, best_angle = np.full(n, np.inf), np.full(n, np.inf)
    if n == 0:
        return BatchSolution(q, best_position, best_angle, best_position < 0, 0)
    if len(targets) < n:
        targets = targets.take(np.zeros(n, dtype=int))
    index = np.arange(n)
    state = _State(robot, targets, q, limits, (HASTY if hasty else USUAL).least_factor)
    checkpoint = state.square.copy()
    for iteration in count():
        leaving = state.ended(tolerance, None if group is None else group[index])
        if iteration % check_every == check_every - 1:
            leaving |= state.square > fallen_to * checkpoint
            checkpoint = state.square.copy()
        if iteration == PATIENCE:
            leaving |= state.square > NEAR**2
        leaving |= iteration >= max_iterations
        if leaving.any():
            rows = index[leaving]
            q[rows] = state.q[:, leaving].T
            best_position[rows], best_angle[rows] = state.distance[leaving], state.angle[leaving]
            staying = ~leaving
            index, checkpoint = index[staying], checkpoint[staying]
            if not index.size:
                break
            state.keep(staying)
        state.step()
    converged = np.maximum(best_position, best_angle) <= tolerance
    return BatchSolution(q, best_position, best_angle, converged, iteration)


class _State:
    """The searches that still go on; arrays over them have them last, as in `JointAxes`."""

    def __init__(
        self,
        robot: Robot,
        targets: Targets,
        q: FloatArray,
        limits: Limits | None,
        least_factor: float,
    ) -> None:
        self.chain, self.targets, self.q = joint_axes(robot), targets, np.array(q.T, order="C")
        self.limits = None if limits is None else (limits[0][:, None], limits[1][:, None])
        self._least_factor = least_factor
        self.error, self.J, self.distance, self.angle = self._evaluate(self.q)
        self.square = np.einsum("in,in->n", self.error, self.error)
        self.factor = np.full(len(q), FIRST_FACTOR)

    def _evaluate(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        tip, rotation, J = self.chain.placed(q.T)
        error, distance, angle = pose_errors(
            tip, rotation, self.targets.position, self.targets.rotation
        )
        return error, J, distance, angle

    def keep(self, rows: Any) -> None:
        """Drop all other searches."""
        self.q, self.factor, self.square = self.q[:, rows], self.factor[rows], self.square[rows]
        self.distance, self.angle = self.distance[rows], self.angle[rows]
        self.error, self.J = self.error[:, rows], self.J[:, :, rows]
        self.targets = self.targets.take(rows)

    def ended(self, tolerance: float, group: IntArray | None) -> BoolArray:
        """Which searches have converged, are hopeless, or are of a group that has a solution."""
        done: BoolArray = np.maximum(self.distance, self.angle) <= tolerance
        ended = done | (self.factor > MAX_FACTOR)
        if group is not None and done.any():
            ended |= np.isin(group, group[done])
        return ended

    def step(self) -> None:
        """Try a step of every search, and keep those that bring it nearer."""
        J, gradient = self.J, np.einsum("kin,kn->in", self.J, self.error)
        if self.limits is not None:
            held = held_joints(self.q, gradient, self.limits)
            if held.any():
                gradient[held] = 0.0
                J = np.where(held, 0.0, J)
        # A singular matrix is no error here: 1e-13 is rounding next to entries of about 1.
        damping = self.factor * self.square + 1e-13
        few = self.q.shape[1] < FEW
        solve = _steps_by_lapack if few else _steps_by_cholesky
        step = solve(J, gradient, damping)
        longest = np.abs(step).max(axis=0)
        step *= MAX_STEP / np.maximum(longest, MAX_STEP)
        trial = self.q + step
        if self.limits is not None:
            trial = clipped(trial, self.limits)
        error, J, distance, angle = self._evaluate(trial)
        square = np.einsum("in,in->n", error, error)
        better = square < self.square
        if not better.all():
            worse = ~better
            trial[:, worse], square[worse] = self.q[:, worse], self.square[worse]
            error[:, worse], J[:, :, worse] = self.error[:, worse], self.J[:, :, worse]
            distance[worse], angle[worse] = self.distance[worse], self.angle[worse]
        self.q, self.error, self.J, self.square = trial, error, J, square
        self.distance, self.angle = distance, angle
        reduced = np.maximum(0.2 * self.factor, self._least_factor)
        self.factor = np.where(better, reduced, 8 * self.factor)


def _steps_by_lapack(J: FloatArray, gradient: FloatArray, damping: FloatArray) -> FloatArray:
    """Solve (JᵀJ + λ² I) Δq = Jᵀe for each search; arguments as of `_steps_by_cholesky`."""
    each = np.ascontiguousarray(J.transpose(2, 0, 1))
    H = each.transpose(0, 2, 1) @ each
    diagonal = np.arange(H.shape[1])
    H[:, diagonal, diagonal] += damping[:, None]
    return np.ascontiguousarray(np.linalg.solve(H, gradient.T[:, :, None])[:, :, 0].T)


def _steps_by_cholesky(J: FloatArray, gradient: FloatArray, damping: FloatArray) -> FloatArray:
    """Solve (JᵀJ + λ² I) Δq = Jᵀe for all searches in step.

    Each operation on an entry runs over all searches, for many of them several times faster than
    one matrix after the other.

    Args:
        J: Jacobians, zero for joints that are held, shape (6, d, n).
        gradient: Jᵀe, shape (d, n).
        damping: λ², shape (n,).
    """
    d, n = gradient.shape
    L = np.empty((d, d, n))
    for j in range(d):
        column = L[j:, j]
        np.einsum("kin,kn->in", J[:, j:], J[:, j], out=column)
        column[0] += damping
        column -= np.einsum("ikn,kn->in", L[j:, :j], L[j, :j])
        # Rounding must not take the pivot of a singular matrix below zero.
        np.sqrt(np.maximum(column[0], SMALLEST_PIVOT), out=column[0])
        column[1:] /= column[0]
    step = gradient.copy()
    for j in range(d):
        step[j] -= np.einsum("kn,kn->n", L[j, :j], step[:j])
        step[j] /= L[j, j]
    for j in reversed(range(d)):
        step[j] -= np.einsum("kn,kn->n", L[j + 1 :, j], step[j + 1 :])
        step[j] /= L[j, j]
    return step
