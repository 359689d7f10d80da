"""The candidates at each waypoint of a task: all solutions of its pose, with their costs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import all_turns, limits_of
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.kinematics.sequence.nearness import limit_nearness, singular_nearness
from knotwork.kinematics.sequence.step_costs import AT_LIMIT
from knotwork.kinematics.solutions.all_within_limits import in_order, turned_within_limits
from knotwork.kinematics.solutions.enumeration import MOST_BRANCHES, distinct, find_branches
from knotwork.kinematics.solutions.self_motion import farthest_apart, sample_self_motion
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.units import SI, Units
from knotwork.waypoints import CartesianWaypoint, FloatArray

# Residual above which a twist is unattainable [m/s, rad/s].
RESIDUAL = 1e-7
# Number of samples of a self-motion.
SPREAD = 24
# Pose error of solutions [m, rad].
TOLERANCE = 1e-9


class Candidates(NamedTuple):
    """The configurations that may be chosen at one waypoint.

    Attributes:
        q: Joint positions inside the limits, all turns, shape (m, d).
        branch: Index of the branch of each candidate, shape (m,).
        flags: Configuration flags, shape (m, k).
        lost: 0 where the twist is attainable, otherwise 1 + its residual [m/s, rad/s], shape (m,).
            excess: 0 where these joint velocities are within limits, otherwise their ratio to the
            limits, shape (m,).
        weight: Factor on the travel from and to each candidate, shape (m,).
        velocity: Joint velocities for the twist [rad/s or m/s], shape (m, d).
        branches: Number of branches inside the limits.
        free: The arm is redundant at the pose, and the candidates are samples of its self-motion.
    """

    q: FloatArray
    branch: Any
    flags: FloatArray
    lost: FloatArray
    excess: FloatArray
    weight: FloatArray
    velocity: FloatArray
    branches: int
    free: bool


def find_candidates(
    robot: Robot,
    waypoints: Sequence[CartesianWaypoint],
    references: Sequence[FloatArray],
    units: Units = SI,
) -> list[Candidates]:
    """Find the candidates at waypoints in order of time.

    Args:
        robot: The robot.
        waypoints: Poses and twists.
        references: For each waypoint a configuration near which a solution may be wanted.
        units: Units of lengths and angles in errors.

    Raises:
        OutsideLimitsError, UnreachablePoseError: A pose has no solution inside the limits.
    """
    if not waypoints:
        return []
    targets = Targets.of([waypoint.pose for waypoint in waypoints])
    redundant = robot.dof > 6
    hopeless = np.flatnonzero(joint_axes(robot).certain_miss(targets.position) > TOLERANCE)
    for i in hopeless[:1]:  # the reason, before the others are solved
        _solution(robot, waypoints[i], references[i], units, nearest=False)
    found = _tracked(robot, targets) if redundant else find_branches(robot, targets)
    copied: list[tuple[list[FloatArray], bool]] = []
    before: FloatArray | None = None
    for i, (waypoint, solutions, reference) in enumerate(
        zip(waypoints, found, references, strict=True)
    ):
        search = PoseSearch(robot, waypoint.pose, TOLERANCE, TOLERANCE)
        free = redundant or len(solutions) > MOST_BRANCHES
        if not free and not (i and np.array_equal(reference, references[i - 1])):
            # The solution nearest the previous configuration must not be missing.
            local = search.solve(reference, limits_of(robot))
            if local.converged:
                both = np.vstack([solutions, local.q])
                solutions = distinct(robot, targets.take([i]), both)
        kept = turned_within_limits(search, solutions)
        if free and not redundant:
            kept = farthest_apart(robot, kept, SPREAD)
        if not free:
            # The order decides ties, and must not depend on the order of searches.
            kept = np.array(sorted(kept, key=in_order)).reshape(-1, robot.dof)
        copies = [all_turns(robot, q) for q in kept]
        if free or not copies:
            # Refined later: any solution nearby is sufficient at first.
            near = reference if before is None else before
            before = _solution(robot, waypoint, near, units, nearest=not free)
            copies.insert(0, all_turns(robot, before))
        copied.append((copies, free))
    return _valued(robot, waypoints, copied)


def nearest_candidate(
    robot: Robot, waypoint: CartesianWaypoint, near: FloatArray, units: Units = SI
) -> Candidates:
    """The candidate at a waypoint that is nearest a configuration.

    Raises:
        OutsideLimitsError, UnreachablePoseError: The pose has no solution inside the limits.
    """
    q = _solution(robot, waypoint, near, units, nearest=True)
    return _valued(robot, [waypoint], [([q[None]], False)])[0]


def candidates_of(robot: Robot, waypoint: CartesianWaypoint, q: FloatArray) -> Candidates:
    """Candidates of one solution of a redundant arm at a waypoint, with its turns."""
    return _valued(robot, [waypoint], [([all_turns(robot, q)], True)])[0]


def _solution(
    robot: Robot, waypoint: CartesianWaypoint, near: FloatArray, units: Units, *, nearest: bool
) -> FloatArray:
    """A solution of a waypoint's pose near a configuration, shape (d,)."""
    from knotwork.kinematics.solutions.pose import solve_pose_ik

    return solve_pose_ik(
        robot,
        waypoint.pose,
        near,
        nearest=nearest,
        waypoint=waypoint.name,
        where=waypoint.where,
        units=units,
    ).q


def _tracked(robot: Robot, targets: Targets) -> list[FloatArray]:
    """Samples of the self-motion at each pose, and projections of the previous pose's samples."""
    fresh = [farthest_apart(robot, q, SPREAD) for q in sample_self_motion(robot, targets)]
    found = [fresh[0]]
    for i in range(1, len(targets)):
        led = solve_batch(
            robot,
            targets.take([i]),
            found[-1][:SPREAD],
            tolerance=1e-10,
            limits=limits_of(robot),
            max_iterations=25,
        )
        found.append(np.vstack([led.q[led.converged], fresh[i]]))
    return found


def _valued(
    robot: Robot,
    waypoints: Sequence[CartesianWaypoint],
    copied: Sequence[tuple[list[FloatArray], bool]],
) -> list[Candidates]:
    """Evaluate each solution: its joint speeds, and its nearness to limits.

    Args:
        robot: The robot.
        waypoints: The waypoints.
        copied: For each waypoint its solutions, each with its turns, shape (k, d), and whether the
            arm is redundant there.
    """
    counts = [len(copies) for copies, _ in copied]
    first = np.array([turns[0] for copies, _ in copied for turns in copies])
    twists = np.array([np.concatenate([one.linear, one.angular]) for one in waypoints])
    twists = np.repeat(twists, counts, axis=0)
    J = joint_axes(robot).jacobians(first)
    v, left = solve_velocities(robot, J, twists)
    fastest = (np.abs(v) / robot.velocity_limit).max(axis=1)
    excess = np.where(fastest > AT_LIMIT, fastest, 0.0)
    most = RESIDUAL * np.maximum(1.0, np.abs(twists).max(axis=1))
    lost = np.where(left > most, 1.0 + left, 0.0)
    flags, singular = configuration_flags(robot, first), singular_nearness(J)
    result, begin = [], 0
    for (copies, free), count in zip(copied, counts, strict=True):
        branch = np.repeat(np.arange(count), [len(turns) for turns in copies])
        owner, q = begin + branch, np.concatenate(copies)
        begin += count
        result.append(
            Candidates(
                q=q,
                branch=branch,
                flags=flags[owner],
                lost=lost[owner],
                excess=excess[owner],
                weight=1.0 + limit_nearness(robot, q) + singular[owner],
                velocity=v[owner],
                branches=count,
                free=free,
            )
        )
    return result
