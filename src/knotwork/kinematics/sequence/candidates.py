"""The candidates at each waypoint of a task: all solutions of its pose, and what each is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.sequence.costs import AT_LIMIT
from knotwork.kinematics.sequence.nearness import limit_nearness, singular_nearness
from knotwork.kinematics.solutions.branches import (
    farthest_apart,
    in_order,
    inside_limits,
    spread_free_motion,
    turns_inside,
)
from knotwork.kinematics.solutions.configuration_flags import all_branches, branch_signs
from knotwork.kinematics.solutions.enumeration import (
    MOST_BRANCHES,
    find_branches,
    joint_axes,
    told_apart,
)
from knotwork.kinematics.solutions.pose import IKSolution, solve_pose_ik
from knotwork.robot import Robot
from knotwork.waypoints import CartesianWaypoint, FloatArray

# Every so many waypoints the search for branches starts afresh; between, it starts from those of
# the waypoints beside.
ANCHOR_EVERY = 8
# Joint speeds leave this much of a twist over [m/s, rad/s] where the arm can't do it.
RESIDUAL = 1e-7
# And that counts as so many times the velocity limits.
LOST = 1e3
SPREAD = 24


@dataclass(frozen=True, eq=False)
class Candidates:
    """What may be chosen at one waypoint.

    Attributes:
        q: Joint positions inside the limits, all turns, shape (m, d).
        branch: Index of the branch of each, shape (m,).
        signs: What tells branches apart, shape (m, k).
        excess: 0 where the twist can be had within the velocity limits, otherwise how many times
            the limits it takes; a thousand and more where it can't be had at all. Shape (m,).
        weight: Factor of the travel from and to each, shape (m,).
        velocity: Joint velocities that give the twist [rad/s or m/s], shape (m, d).
        lost: Where no joint velocities give it, shape (m,).
        branches: Number of branches inside the limits.
        free: The arm moves freely at the pose, and the candidates are samples of that motion.
    """

    q: FloatArray
    branch: Any
    signs: FloatArray
    excess: FloatArray
    weight: FloatArray
    velocity: FloatArray
    lost: Any
    branches: int
    free: bool


def find_candidates(
    robot: Robot, waypoints: Sequence[CartesianWaypoint], references: Sequence[FloatArray]
) -> list[Candidates]:
    """Find the candidates at waypoints in order of time.

    Args:
        robot: The robot.
        waypoints: Poses and twists.
        references: For each waypoint a configuration that its solution may be wanted near.

    Raises:
        OutsideLimitsError, UnreachablePoseError: A pose has no solution inside the limits.
    """
    if not waypoints:
        return []
    poses = [waypoint.pose for waypoint in waypoints]
    targets = Targets.of(poses)
    redundant = robot.dof > 6
    found = _tracked(robot, targets) if redundant else _branches(robot, targets)
    result = []
    before: FloatArray | None = None
    tried: FloatArray | None = None
    for i, (waypoint, pose, solutions, reference) in enumerate(
        zip(waypoints, poses, found, references, strict=True)
    ):
        free = redundant or len(solutions) > MOST_BRANCHES
        if free and not redundant:
            inside = np.array(inside_limits(robot, solutions)).reshape(-1, robot.dof)
            solutions = farthest_apart(robot, inside, SPREAD)
        if not free and not (tried is not None and np.array_equal(reference, tried)):
            # What is next to where the arm comes from must not be missing.
            tried, led = reference, _led(robot, pose, reference)
            solutions = told_apart(
                joint_axes(robot), targets.take([i]), np.vstack([solutions, led])
            )
        if not free:
            # The order decides ties, and must not hang on which search came to which solution.
            solutions = np.array(sorted(solutions, key=in_order)).reshape(-1, robot.dof)
        copies = [turns_inside(robot, q) for q in solutions]
        copies = [turns for turns in copies if len(turns) and _reaches(robot, pose, turns[0])]
        if free or not copies:
            near = reference if before is None else before
            # Where to be is settled later; at first anywhere near will do.
            solution = _nearest(robot, pose, near, waypoint, search_on=not free)
            copies.insert(0, turns_inside(robot, solution.q))
            before = solution.q
        result.append(_valued(robot, waypoint, copies, free))
    return result


def _led(robot: Robot, pose: Any, start: FloatArray) -> FloatArray:
    """Where a search from a configuration ends: one solution, shape (1, d), or none."""
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    found = PoseSearch(robot, pose, 1e-9, 1e-9).solve(start, lower, upper)
    return found.q[None] if found.converged else np.empty((0, robot.dof))


def _nearest(
    robot: Robot, pose: Any, near: FloatArray, waypoint: CartesianWaypoint, *, search_on: bool
) -> IKSolution:
    return solve_pose_ik(
        robot, pose, near, nearest=search_on, waypoint=waypoint.name, where=waypoint.where
    )


def _reaches(robot: Robot, pose: Any, q: FloatArray) -> bool:
    """Whether Pinocchio's forward kinematics puts the TCP on the pose."""
    error = robot.forward(q).actInv(pose)
    turn = np.linalg.norm(error.rotation - np.eye(3))  # √2 times the angle, if that is small
    return bool(np.linalg.norm(error.translation) <= 1e-8 and turn <= 1e-8)


def _branches(robot: Robot, targets: Targets) -> list[FloatArray]:
    """All branches at each pose: at some of them afresh, at the others from those."""
    n, complete = len(targets), partial(all_branches, robot)
    anchors = sorted({*range(0, n, ANCHOR_EVERY), n - 1})
    found: list[FloatArray] = [np.empty((0, robot.dof))] * n
    for i, solutions in zip(
        anchors, find_branches(robot, targets.take(anchors), complete=complete), strict=True
    ):
        found[i] = solutions
    others = [i for i in range(n) if i not in anchors]
    if others:
        nearest = [min(anchors, key=lambda k: (abs(k - i), k)) for i in others]
        known = [found[k][:MOST_BRANCHES] for k in nearest]
        for i, solutions in zip(
            others, find_branches(robot, targets.take(others), known, complete), strict=True
        ):
            found[i] = solutions
    return found


def _tracked(robot: Robot, targets: Targets) -> list[FloatArray]:
    """Samples of the free motion at each pose, and where those of the pose before lead."""
    fresh = spread_free_motion(robot, targets, SPREAD)
    limits = robot.lower_position_limit, robot.upper_position_limit
    found = [fresh[0]]
    for i in range(1, len(targets)):
        before = found[-1][:SPREAD]
        led = solve_batch(
            joint_axes(robot),
            targets.take([i] * len(before)),
            before,
            tolerance=1e-10,
            lower=limits[0],
            upper=limits[1],
            max_iterations=25,
        )
        found.append(np.vstack([led.q[led.converged], fresh[i]]))
    return found


def _valued(
    robot: Robot, waypoint: CartesianWaypoint, copies: list[FloatArray], free: bool
) -> Candidates:
    """Say what each solution is worth: the speeds it takes, and how near limits it is."""
    first = np.array([turns[0] for turns in copies])
    twist = np.concatenate([waypoint.linear, waypoint.angular])
    v, left, smallest = solve_velocities(robot, first, twist)
    fastest = (np.abs(v) / robot.velocity_limit).max(axis=1)
    excess = np.where(fastest > AT_LIMIT, fastest, 0.0)
    bad = left > RESIDUAL * max(1.0, float(np.abs(twist).max()))
    excess[bad] = LOST * (1.0 + left[bad])
    owner = np.repeat(np.arange(len(copies)), [len(turns) for turns in copies])
    q = np.concatenate(copies)
    return Candidates(
        q=q,
        branch=owner,
        signs=branch_signs(robot, first)[owner],
        excess=excess[owner],
        weight=1.0 + limit_nearness(robot, q) + singular_nearness(smallest)[owner],
        velocity=v[owner],
        lost=bad[owner],
        branches=len(copies),
        free=free,
    )
