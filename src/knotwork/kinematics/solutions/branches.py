"""All solutions of a pose: every branch with its turns, or a spread of the free motion."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.kinematics.arguments import check_count, check_distance, check_pose, check_tolerance
from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import FULL_TURN, difference, low_discrepancy
from knotwork.kinematics.solutions.configuration_flags import (
    all_branches,
    branch_signs,
    describe_branch,
)
from knotwork.kinematics.solutions.enumeration import (
    MOST_BRANCHES,
    find_branches,
    joint_axes,
)
from knotwork.kinematics.solutions.pose import solve_pose_ik
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray, read_only

# Configurations that stand for the free motion of an arm with joints to spare.
SPREAD = 32
SPREAD_STARTS = 96
# A joint may be this far outside a limit [rad or m] before a solution counts as outside: rounding.
AT_LIMIT = 1e-9
# Turns of one branch that are kept; six joints of two turns each make 64.
MOST_TURNS = 1024


@dataclass(frozen=True, eq=False)
class Branch:
    """One way for an arm to take a pose.

    Attributes:
        q: Joint positions inside the limits [rad or m], shape (d,), read-only: of the turns the
            one nearest the middle of the limits, and nearest zero where there are none.
        turns: All copies inside the limits, joints whole turns apart, shape (k, d), read-only. A
            joint without limits is within half a turn of zero in all of them. Of more than
            1024 those are left out that are farthest from the middle of the limits.
        words: What the branch is called: see `knotwork.kinematics.solutions.configuration_flags`; empty where it has no
            name.
        smallest_singular_value: Of the Jacobian: zero at a singularity.
        position_error: Distance of the TCP from the pose, by `Robot.forward` [m].
        orientation_error: Angle from it, likewise [rad].
        sampled: The arm moves freely at the pose, and this is one of the samples of that motion.
    """

    q: FloatArray
    turns: FloatArray
    words: str
    smallest_singular_value: float
    position_error: float
    orientation_error: float
    sampled: bool = False


def solve_all(
    robot: Robot,
    pose: Any,
    *,
    position_tolerance: float = 1e-8,
    orientation_tolerance: float = 1e-8,
    spread: int = SPREAD,
    waypoint: str = "",
    where: str = "",
) -> tuple[Branch, ...]:
    """Find every branch that takes the TCP to a pose inside the joint limits, with its turns.

    The search is numerical and the same for every arm. For an arm of up to six joints it goes on
    until a round of searches brings nothing new; closed-form solutions confirm it for a UR5 and an
    arm with a spherical wrist. An arm with joints to spare, or one that moves freely at the pose
    because it is singular there, gets a spread of configurations along its free motion instead.
    The same arguments always give the same answer. `robot.solve_all(pose)` is the same.

    Args:
        robot: The robot.
        pose: Pose of the TCP in the base frame, `pin.SE3`.
        position_tolerance: [m].
        orientation_tolerance: [rad].
        spread: How many configurations stand for a free motion.
        waypoint: Name of the waypoint, for errors.
        where: Where it is defined, for errors.

    Returns:
        The branches in an order of their own, at least one.

    Raises:
        OutsideLimitsError, UnreachablePoseError, WaypointDataError, RobotError: As `solve_pose_ik`.
    """
    check_pose(pose)
    check_distance(pose)
    check_count(spread, "spread", 1)
    check_tolerance(position_tolerance, "position_tolerance")
    check_tolerance(orientation_tolerance, "orientation_tolerance")
    tolerances = position_tolerance, orientation_tolerance
    targets = Targets.of([pose])
    if robot.dof > 6:
        found, free = spread_free_motion(robot, targets, spread)[0], True
    else:
        found = find_branches(robot, targets, complete=partial(all_branches, robot))[0]
        free = len(found) > MOST_BRANCHES
    kept = inside_limits(robot, found)
    if free and robot.dof <= 6:
        kept = list(farthest_apart(robot, np.array(kept).reshape(-1, robot.dof), spread))
    branches = [_branch(robot, pose, q, free) for q in sorted(kept, key=in_order)]
    branches = [
        branch
        for branch in branches
        if branch.position_error <= tolerances[0] and branch.orientation_error <= tolerances[1]
    ]
    if not branches:
        # Finds what lies exactly at limits or singularities, or says why there is nothing.
        start = middle_of_limits(robot)
        solution = solve_pose_ik(
            robot,
            pose,
            start,
            position_tolerance=position_tolerance,
            orientation_tolerance=orientation_tolerance,
            waypoint=waypoint,
            where=where,
        )
        branches = [_branch(robot, pose, solution.q, free)]
    return tuple(branches)


def in_order(q: FloatArray) -> tuple[float, ...]:
    """Key that sorts configurations alike on every machine."""
    return tuple((np.round(q, 5) + 0.0).tolist())


def _branch(robot: Robot, pose: Any, q: FloatArray, sampled: bool) -> Branch:
    copies = turns_inside(robot, q)
    middle = middle_of_limits(robot)
    nearest = copies[int(np.argmin(np.round(np.abs(copies - middle).sum(axis=1), 6)))]
    error = robot.forward(nearest).actInv(pose)
    signs = branch_signs(robot, nearest[None])[0]
    return Branch(
        q=read_only(nearest, nearest.shape, "q"),
        turns=read_only(copies, copies.shape, "turns"),
        words=describe_branch(robot, signs),
        smallest_singular_value=float(np.linalg.svd(robot.jacobian(nearest), compute_uv=False)[-1]),
        position_error=float(np.linalg.norm(error.translation)),
        orientation_error=float(np.linalg.norm(pin.log3(error.rotation))),
        sampled=sampled,
    )


def middle_of_limits(robot: Robot) -> FloatArray:
    """Middle of each joint's range [rad or m], zero where it has none, shape (d,)."""
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    bounded = np.isfinite(lower) & np.isfinite(upper)
    middle = np.zeros(robot.dof)
    middle[bounded] = 0.5 * (lower[bounded] + upper[bounded])
    return middle


def inside_limits(robot: Robot, solutions: FloatArray) -> list[FloatArray]:
    """Those solutions that some turn brings inside the limits, at that turn."""
    return [copies[0] for q in solutions if len(copies := turns_inside(robot, np.array(q)))]


def turns_inside(robot: Robot, q: FloatArray) -> FloatArray:
    """Copies of a configuration inside the limits, joints whole turns apart, shape (k, d).

    All of them, or of more than `MOST_TURNS` those nearest the middle of the limits.
    """
    choices: list[FloatArray] = []
    revolute, middle = joint_axes(robot).revolute, middle_of_limits(robot)
    limits = zip(robot.lower_position_limit, robot.upper_position_limit, strict=True)
    for i, (lower, upper) in enumerate(limits):
        value = q[i]
        copies = np.array([value])
        if revolute[i] and np.isfinite(lower) and np.isfinite(upper):
            nearest = np.round((middle[i] - value) / FULL_TURN)
            least = np.ceil((lower - AT_LIMIT - value) / FULL_TURN)
            most = np.floor((upper + AT_LIMIT - value) / FULL_TURN)
            least, most = max(least, nearest - MOST_TURNS), min(most, nearest + MOST_TURNS)
            copies = value + FULL_TURN * np.arange(least, most + 1)
        fits = (copies >= lower - AT_LIMIT) & (copies <= upper + AT_LIMIT)
        choices.append(np.minimum(np.maximum(copies[fits], lower), upper))
    while math.prod(len(copies) for copies in choices) > MOST_TURNS:
        i = max(range(len(choices)), key=lambda k: len(choices[k]))
        choices[i] = np.delete(choices[i], int(np.argmax(np.abs(choices[i] - middle[i]))))
    return np.array(list(itertools.product(*choices))).reshape(-1, len(q))


def spread_free_motion(
    robot: Robot, targets: Targets, count: int, known: Sequence[FloatArray] | None = None
) -> list[FloatArray]:
    """Spread configurations over the free motion of an arm with joints to spare.

    Args:
        robot: The robot.
        targets: n poses.
        count: Configurations for each pose at most.
        known: Configurations that may be near solutions of each pose, n arrays (k, d).

    Returns:
        For each pose solutions inside the limits, shape (b, d).
    """
    chain, n = joint_axes(robot), len(targets)
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    low = np.where(np.isfinite(lower), np.maximum(lower, -np.pi), -np.pi)
    high = np.where(np.isfinite(upper), np.minimum(upper, low + FULL_TURN), low + FULL_TURN)
    points = low_discrepancy(robot.dof)
    first = low + np.array([next(points) for _ in range(SPREAD_STARTS)]) * (high - low)
    starts = [first if known is None else np.vstack([known[i], first]) for i in range(n)]
    owner = np.repeat(np.arange(n), [len(start) for start in starts])
    solution = solve_batch(
        chain,
        targets.take(owner),
        np.concatenate(starts),
        tolerance=1e-10,
        lower=lower,
        upper=upper,
        max_iterations=30,
    )
    return [
        farthest_apart(robot, solution.q[(owner == i) & solution.converged], count)
        for i in range(n)
    ]


def farthest_apart(robot: Robot, solutions: FloatArray, count: int) -> FloatArray:
    """Choose configurations one by one, each as far as can be from those chosen before.

    Args:
        robot: The robot.
        solutions: To choose from, shape (n, d); the first is chosen first.
        count: How many at most.
    """
    if len(solutions) <= 1:
        return solutions
    revolute = joint_axes(robot).revolute
    chosen = [0]
    distance = np.abs(difference(solutions, solutions[0], revolute)).max(axis=1)
    while len(chosen) < count and distance.max() > 1e-4:
        chosen.append(int(np.argmax(np.round(distance, 9))))
        gap = np.abs(difference(solutions, solutions[chosen[-1]], revolute)).max(axis=1)
        distance = np.minimum(distance, gap)
    return np.asarray(solutions[chosen])
