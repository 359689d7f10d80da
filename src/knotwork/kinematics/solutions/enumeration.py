"""Every configuration of a six-joint arm for a pose, turns of 2π apart counted once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from weakref import WeakKeyDictionary

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_axes import JointAxes, pose_errors
from knotwork.kinematics.chain.joint_ranges import BoolArray, difference, low_discrepancy
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.kinematics.solutions.near_singular import (
    DEEP,
    VALLEY_RESIDUAL,
    floors_of_valleys,
    solutions_in_valleys,
)
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# Branches attract about equal shares of the starts: each of a UR5's gets an eighth. Of 32 starts
# four in five converge, which leaves a branch out in 2 % of cases; as many again, in none of 2,000.
FIRST_STARTS = 32
MORE_STARTS = 32
# Starts besides the solutions of a pose nearby, where those are known.
BESIDE_KNOWN = 8
MAX_ROUNDS = 6
MAX_ITERATIONS = 72
# Searches end this near the pose [m, rad], so near that what is left of the error moves no joint
# by more than `SAME`, but where two branches meet.
RESIDUAL = 1e-11
SAME = 1e-5
# Two solutions this near are one if the pose is met to this between them, too [m, rad].
BESIDE = 1e-2
JOINED = 1e-9
# Near a singularity two branches lie close, and one may get next to none of the starts.
NEAR_SINGULAR = 0.03
# An arm with more solutions than any six-joint arm has (16) moves freely at the pose.
MOST_BRANCHES = 16

_CHAINS: WeakKeyDictionary[Robot, JointAxes] = WeakKeyDictionary()


def joint_axes(robot: Robot) -> JointAxes:
    """The axes of a robot, kept for as long as the robot is."""
    if robot not in _CHAINS:
        _CHAINS[robot] = JointAxes(robot)
    return _CHAINS[robot]


def starts_box(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Where starts are taken from: one turn of every joint that turns, the range of a slide."""
    revolute = joint_axes(robot).revolute
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    reach = joint_axes(robot).reach
    low = np.where(revolute, -np.pi, np.where(np.isfinite(lower), lower, -reach))
    high = np.where(revolute, np.pi, np.where(np.isfinite(upper), upper, reach))
    return low, high


def find_branches(
    robot: Robot,
    targets: Targets,
    known: Sequence[FloatArray] | None = None,
    complete: Callable[[FloatArray], bool | None] | None = None,
) -> list[FloatArray]:
    """Find all solutions for each pose, without regard to position limits of joints that turn.

    Rounds of starts go on for a pose until one brings nothing new. Starts are the points of a
    low-discrepancy sequence and, near singularities, the mirror images of what has been found.

    Args:
        robot: An arm of up to six joints.
        targets: n poses in the base frame.
        known: Configurations that may be near solutions of each pose, n arrays (k, d).
        complete: Says whether solutions of a pose, shape (b, d), are all there are: `None` where
            that is not known, which is also the default.

    Returns:
        For each pose the solutions in the order they were found, revolute joints within half a
        turn of zero, shape (b, d).
    """
    chain, n, d = joint_axes(robot), len(targets), robot.dof
    low, high = starts_box(robot)
    points = low_discrepancy(d)

    def fresh(count: int) -> FloatArray:
        return low + np.array([next(points) for _ in range(count)]) * (high - low)

    found = [np.empty((0, d)) for _ in range(n)]
    deep = [np.empty((0, d)) for _ in range(n)]  # where searches ended without getting there
    first = fresh(FIRST_STARTS if known is None else BESIDE_KNOWN)
    starts = [first if known is None else np.vstack([known[i], first]) for i in range(n)]
    active = list(range(n))
    for round_ in range(MAX_ROUNDS):
        owner = np.repeat(active, [len(start) for start in starts])
        solution = solve_batch(
            chain,
            targets.take(owner),
            np.concatenate(starts),
            tolerance=RESIDUAL,
            max_iterations=MAX_ITERATIONS,
        )
        common = fresh(MORE_STARTS)
        again: list[int] = []
        starts = []
        for i in active:
            own = owner == i
            solved = solution.q[own & solution.converged]
            if d == 6:
                near = solution.position_error + solution.orientation_error < DEEP
                deep[i] = np.vstack([deep[i], solution.q[own & near & ~solution.converged]])
            new = _not_yet(found[i], solved, chain.revolute)
            found[i] = np.vstack([found[i], new])
            all_there = complete(found[i]) if complete is not None else None
            if all_there:  # where searches ended besides does not matter
                deep[i] = deep[i][:0]
            settled = len(new) == 0 and round_ > 0 if all_there is None else all_there
            if settled or len(found[i]) > MOST_BRANCHES:
                continue
            again.append(i)
            starts.append(np.vstack([common, _mirrored(robot, new)]))
        active = again
        if not active:
            break
    return [
        _with_valleys(robot, targets.take([i]), one, beside)
        for i, (one, beside) in enumerate(zip(found, deep, strict=True))
    ]


def _with_valleys(
    robot: Robot, target: Targets, found: FloatArray, beside: FloatArray
) -> FloatArray:
    """Solutions for one pose, each once, with those next to singularities, or along the motion.

    Args:
        robot: The robot.
        target: The pose.
        found: Solutions that searches have found, shape (b, d).
        beside: Where searches have ended on the way to others, shape (k, d).
    """
    chain, d = joint_axes(robot), robot.dof
    singular = d == 6 and len(found) > MOST_BRANCHES
    if singular or len(beside):
        search = PoseSearch(robot, target.pose(0), RESIDUAL, RESIDUAL)
        follow = floors_of_valleys if singular else solutions_in_valleys
        starts = found if singular else beside
        more = follow(search, starts, chain.revolute, VALLEY_RESIDUAL)
        found = np.vstack([np.array(more).reshape(-1, d), found])
    if not singular:
        found = told_apart(chain, target, found)
    return difference(found, np.zeros(d), chain.revolute)


def told_apart(chain: JointAxes, target: Targets, solutions: FloatArray) -> FloatArray:
    """Those solutions that no motion joins which leaves the tool where it is: the first of each.

    Where two branches meet, searches end on both sides of the point where they do, and in a valley
    anywhere near the solution.
    """
    kept: list[FloatArray] = []
    for q in solutions:
        apart = [difference(q, other, chain.revolute) for other in kept]
        sizes = [np.abs(gap).max() for gap in apart]
        if any(size <= SAME for size in sizes):
            continue
        middles = [q - 0.5 * gap for gap, size in zip(apart, sizes, strict=True) if size < BESIDE]
        if middles:
            between = np.array(middles)
            tip, rotation, *_ = chain.forward(between)
            one = target.take(np.zeros(len(between), dtype=int))
            _, distance, angle = pose_errors(tip, rotation, one.position, one.rotation)
            if (np.maximum(distance, angle) < JOINED).any():
                continue
        kept.append(q)
    return np.array(kept).reshape(-1, solutions.shape[1])


def _not_yet(found: FloatArray, solved: FloatArray, revolute: BoolArray) -> FloatArray:
    """Those solutions that are not among the ones found, each once."""
    new: list[FloatArray] = []
    rest = solved
    for q in found:
        rest = rest[np.abs(difference(rest, q, revolute)).max(axis=1) > SAME]
    while len(rest):
        new.append(rest[0])
        rest = rest[np.abs(difference(rest, rest[0], revolute)).max(axis=1) > SAME]
    return np.array(new).reshape(-1, found.shape[1])


def _mirrored(robot: Robot, solutions: FloatArray) -> FloatArray:
    """Starts across the singularity, for the solutions that are near one.

    Two branches meet at a singularity: along the joint motion that the tool does not feel, and,
    where the axes of joints i and i + 2 line up, by half a turn of both.
    """
    d = robot.dof
    starts: list[FloatArray] = []
    if d < 3 or not len(solutions):
        return np.empty((0, d))
    chain = joint_axes(robot)
    _, s, Vt = np.linalg.svd(chain.jacobians(solutions))
    for q, smallest, v in zip(solutions, s[:, -1], Vt[:, -1], strict=True):
        if smallest < NEAR_SINGULAR:
            unit = v / np.abs(v).max()
            starts += [q + step * unit for step in (0.1, -0.1, 0.6, -0.6)]
            for i in range(d - 2):
                turned = q.copy()
                turned[[i, i + 2]] += np.pi * chain.revolute[[i, i + 2]]
                starts.append(turned)
    return np.array(starts).reshape(-1, d)
