"""All configurations of an arm of up to six joints for a pose, without their turns."""

from __future__ import annotations

import itertools

import numpy as np

from knotwork.kinematics.chain.batch import BatchSolution, Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import (
    BoolArray,
    Limits,
    difference,
    joint_distances,
    limits_of,
    no_limits,
    spread_starts,
)
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.kinematics.geometry.closed_form import SOLUTION_ERROR, closed_form
from knotwork.kinematics.geometry.configuration_flags import all_branches
from knotwork.kinematics.solutions.near_singular import (
    MAX_RESIDUAL,
    near_singular_solutions,
    singular_solutions,
)
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.waypoints import FloatArray

# Number of starts. About the same number of searches ends at each branch, an eighth for a UR5. A
# step of a batch of this size takes hardly longer than one of half the size.
FIRST_STARTS = 64
MORE_STARTS = 32
SEARCH_ROUNDS = 6
# Steps of the first round, in which half of the searches converge, and of later rounds.
FIRST_ITERATIONS = 12
SEARCH_ITERATIONS = 72
# Distance within which solutions are equal [rad or m]. The remaining pose error moves no joint by
# more, except where two branches meet.
SAME_SOLUTION = 1e-5
# Two solutions within `JOINED_DISTANCE` are equal if the pose error between them is below
# `JOINED_ERROR` [m, rad].
JOINED_DISTANCE = 1e-2
JOINED_ERROR = 1e-9
NEWTON_POLISH_STEPS = 8
# Near a singularity solutions lie along a curve, and small pose errors move joints.
NEAR_SINGULAR_VALUE = 3e-3
# An arm with more solutions than any six-joint arm (16) is redundant at the pose.
MAX_BRANCHES = 16


class _PoseSolutions:
    """The solutions found for one pose.

    Attributes:
        solutions: Distinct solutions, shape (b, d).
        hits: Number of searches that ended at each, shape (b,).
        unfinished: Configurations at which searches ended with a small error, shape (k, d).
    """

    def __init__(self, dof: int) -> None:
        self.solutions, self.hits = np.empty((0, dof)), np.zeros(0, dtype=int)
        self.unfinished = np.empty((0, dof))

    def add(self, ended: BatchSolution, rows: BoolArray, revolute: BoolArray) -> FloatArray:
        """Add the results of a round of searches, and give the new solutions."""
        solved, known = ended.q[rows & ended.converged], len(self.solutions)
        for i in itertools.count():
            if i == len(self.solutions):
                if not len(solved):
                    break
                self.solutions = np.vstack([self.solutions, solved[:1]])
                self.hits = np.append(self.hits, 0)
            same = joint_distances(solved, self.solutions[i], revolute) <= SAME_SOLUTION
            self.hits[i] += same.sum()
            solved = solved[~same]
        near = ended.position_error + ended.orientation_error < MAX_RESIDUAL
        self.unfinished = ended.q[rows & near & ~ended.converged]
        return self.solutions[known:]


def find_branches(robot: Robot, targets: Targets) -> list[FloatArray]:
    """Find all solutions for each pose, and ignore position limits of revolute joints.

    The closed form is used if its result is certain, otherwise searches.

    Args:
        robot: An arm of up to six joints.
        targets: n poses in the base frame.

    Returns:
        For each pose the solutions, revolute joints within half a turn of zero, shape (b, d).
    """
    exact = closed_form(robot, targets)
    unsolved = [i for i, solutions in enumerate(exact) if solutions is None]
    searched = iter(search_branches(robot, targets.take(unsolved)) if unsolved else [])
    return [next(searched) if solutions is None else solutions for solutions in exact]


def search_branches(robot: Robot, targets: Targets) -> list[FloatArray]:
    """Find all solutions for each pose by searches.

    Rounds of searches are repeated for a pose until all solutions that its configuration flags
    allow are found, or each has been found twice. If one is then missing, few searches end at it,
    if any (Good, 1953). Near a singularity the last round must find no new solution. Starts are a
    low-discrepancy sequence, and configurations at which searches stopped with a small error.

    Args and returns as of `find_branches`.
    """
    revolute, n, d = joint_axes(robot).revolute, len(targets), robot.dof
    box, used = _slide_limits(robot), FIRST_STARTS
    begin = [spread_starts(robot, box, used)] * n
    poses, stuck = [_PoseSolutions(d) for _ in range(n)], [np.empty((0, d))] * n
    active = list(range(n))
    for round_ in range(SEARCH_ROUNDS):
        owner = np.repeat(active, [len(start) for start in begin])
        ended = solve_batch(
            robot,
            targets.take(owner),
            np.concatenate(begin),
            tolerance=SOLUTION_ERROR,
            max_iterations=FIRST_ITERATIONS if round_ == 0 else SEARCH_ITERATIONS,
            hasty=round_ == 0,
        )
        common, used = spread_starts(robot, box, MORE_STARTS, skip=used), used + MORE_STARTS
        unfinished_poses, begin = [], []
        for i in active:
            new = poses[i].add(ended, owner == i, revolute)
            complete = all_branches(robot, poses[i].solutions)
            if complete or len(poses[i].solutions) > MAX_BRANCHES:
                stuck[i] = stuck[i][:0]
                continue
            unfinished = poses[i].unfinished
            if round_ > 0 and d == 6:
                stuck[i] = np.vstack([stuck[i], unfinished])
                unfinished = unfinished[:0]
            twice = len(poses[i].hits) > 0 and bool((poses[i].hits > 1).all())
            calm = twice and not len(stuck[i])
            if complete is None and (not len(unfinished) if calm else round_ and not len(new)):
                continue
            unfinished_poses.append(i)
            begin.append(np.vstack([common, unfinished]))
        active = unfinished_poses
        if not active:
            break
    return [
        _with_near_singular(robot, targets.take([i]), poses[i].solutions, stuck[i])
        for i in range(n)
    ]


def _slide_limits(robot: Robot) -> Limits:
    """Position limits of prismatic joints alone."""
    revolute = joint_axes(robot).revolute
    (lower, upper), (low, high) = no_limits(robot), limits_of(robot)
    return np.where(revolute, lower, low), np.where(revolute, upper, high)


def _with_near_singular(
    robot: Robot, target: Targets, solutions: FloatArray, stuck: FloatArray
) -> FloatArray:
    """Distinct solutions for one pose, with those found by continuation.

    Args:
        robot: The robot.
        target: The pose.
        solutions: Solutions found by searches, shape (b, d).
        stuck: Configurations at which other searches stopped, shape (k, d).
    """
    d = robot.dof
    search = PoseSearch(robot, target.pose(0), SOLUTION_ERROR, SOLUTION_ERROR)
    if d == 6 and len(solutions) > MAX_BRANCHES:
        more = singular_solutions(search, solutions)
        solutions = np.vstack([*more, solutions])
    else:
        near = _near_singular_rows(robot, solutions)
        if len(near) or len(stuck):
            solutions = _without_duplicates(search, target, solutions)
            if d == 6 and not all_branches(robot, solutions):
                more = near_singular_solutions(search, np.vstack([near, stuck]))
                solutions = _without_duplicates(search, target, np.vstack([*more, solutions]))
    return difference(solutions, np.zeros(d), joint_axes(robot).revolute)


def _without_duplicates(search: PoseSearch, target: Targets, solutions: FloatArray) -> FloatArray:
    """Distinct solutions, polished near a singularity."""
    polished = [_polish(search, q) for q in _near_singular_rows(search.robot, solutions)]
    return distinct_solutions(search.robot, target, np.vstack([*polished, solutions]))


def _near_singular_rows(robot: Robot, q: FloatArray) -> FloatArray:
    """Configurations with a small smallest singular value, shape (k, d)."""
    s = np.linalg.svd(joint_axes(robot).jacobians(q), compute_uv=False)
    return np.asarray(q[s[:, -1] < NEAR_SINGULAR_VALUE])


def _polish(search: PoseSearch, solution: FloatArray) -> FloatArray:
    """Polish a solution by Newton steps, because near a singularity small errors move joints.

    A step along the smallest right-singular vector may increase the error before the next one
    reduces it.
    """
    q, best, least = solution, solution, np.inf
    for _ in range(NEWTON_POLISH_STEPS + 1):
        e = search.error(q)
        if e @ e < least and np.abs(q - solution).max() < JOINED_DISTANCE:
            best, least = q, float(e @ e)
        q = q + np.linalg.lstsq(search.jacobian(q), e)[0]
    return best


def distinct_solutions(robot: Robot, target: Targets, solutions: FloatArray) -> FloatArray:
    """Solutions without those connected to an earlier one by a self-motion.

    Where two branches meet, searches end on both sides of that point. Near a singularity they end
    anywhere near the solution.
    """
    chain = joint_axes(robot)
    result: list[FloatArray] = []
    for q in solutions:
        gaps = difference(q, np.array(result).reshape(-1, len(q)), chain.revolute)
        sizes = np.abs(gaps).max(axis=1)
        if (sizes <= SAME_SOLUTION).any():
            continue
        between = q - 0.5 * gaps[sizes < JOINED_DISTANCE]
        if len(between):
            tip, rotation, *_ = chain.forward(between)
            poses = target.take(np.zeros(len(between), dtype=int))
            _, distance, angle = pose_errors(tip, rotation, poses.position, poses.rotation)
            if (np.maximum(distance, angle) < JOINED_ERROR).any():
                continue
        result.append(q)
    return np.array(result).reshape(-1, solutions.shape[1])
