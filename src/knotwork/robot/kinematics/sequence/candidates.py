"""The candidates at each waypoint of a task: all solutions of its pose, with their costs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.chain.batch import Targets, solve_batch
from knotwork.robot.kinematics.chain.joint_ranges import (
    all_turns,
    arm_limits,
    joint_difference,
    nearest_turns,
    position_limits,
)
from knotwork.robot.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.robot.kinematics.chain.null_space import minimise_by_self_motion
from knotwork.robot.kinematics.chain.velocity import joint_scales, solve_velocities
from knotwork.robot.kinematics.geometry.configuration_flags import configuration_flags
from knotwork.robot.kinematics.sequence.nearness import limit_nearness, singular_nearness
from knotwork.robot.kinematics.sequence.step_costs import OVERSPEED_FACTOR
from knotwork.robot.kinematics.solutions.all_within_limits import (
    sort_key,
    turn_solutions_into_limits,
)
from knotwork.robot.kinematics.solutions.enumeration import (
    MAX_BRANCHES,
    drop_equal_solutions,
    find_branches,
)
from knotwork.robot.kinematics.solutions.self_motion import (
    choose_farthest_apart,
    sample_self_motion,
)
from knotwork.units import SI, Units
from knotwork.waypoints import CartesianWaypoint

TWIST_RESIDUAL = 1e-7
"""Residual above which a twist is infeasible [m/s, rad/s]."""
SELF_MOTION_SAMPLES = 24
"""Number of samples of a self-motion."""
PROJECTION_STEPS = 12
"""Maximum number of steps of a projection of a sample onto the next pose."""
CANDIDATE_ERROR = 1e-9
"""Pose error of solutions [m, rad]."""


class Candidates(NamedTuple):
    """The configurations that may be chosen at one waypoint.

    Attributes:
        q: Joint positions inside the limits, all turns, shape (m, d).
        branch: Index of the branch of each candidate, shape (m,).
        flags: Configuration flags, shape (m, k).
        unattainable: 0 where the twist is attainable, otherwise 1 + its residual [m/s, rad/s],
            shape (m,).
        overspeed: 0 where the joint velocities are within limits, otherwise their ratio to the
            limits, shape (m,).
        weight: Factor on the travel from and to each candidate, shape (m,).
        velocity: Joint velocities for the twist [rad/s or m/s], shape (m, d).
        branches: Number of branches inside the limits, or of samples.
        sampled: The candidates are samples of a self-motion, or of very many solutions.
    """

    q: FloatArray
    branch: Any
    flags: FloatArray
    unattainable: FloatArray
    overspeed: FloatArray
    weight: FloatArray
    velocity: FloatArray
    branches: int
    sampled: bool

    def select(self, rows: Any) -> Candidates:
        """The candidates at row indices or a mask."""
        columns = set(self._fields) - {"branches", "sampled"}
        return self._replace(**{key: getattr(self, key)[rows] for key in columns})


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
    targets = Targets.from_poses([waypoint.pose for waypoint in waypoints])
    hopeless = np.flatnonzero(
        joint_axes(robot).distance_beyond_reach(targets.position) > CANDIDATE_ERROR
    )
    if hopeless.size:  # the reason, before the others are solved
        first = int(hopeless[0])
        _solve(robot, waypoints[first], references[first], units)
    solve = _track_self_motion if robot.is_redundant else find_branches
    turns: list[tuple[list[FloatArray], bool]] = []
    previous: FloatArray | None = None
    for i, (waypoint, solutions, reference) in enumerate(
        zip(waypoints, solve(robot, targets), references, strict=True)
    ):
        search = PoseSearch(robot, waypoint.pose, CANDIDATE_ERROR, CANDIDATE_ERROR)
        sampled = robot.is_redundant or len(solutions) > MAX_BRANCHES
        if not sampled and not (i and np.array_equal(reference, references[i - 1])):
            # The solution nearest the previous configuration must not be missing.
            local = search.solve(reference, position_limits(robot))
            if local.converged:
                solutions = np.vstack([solutions, local.q])
                solutions = drop_equal_solutions(robot, targets.take([i]), solutions)
        solutions = turn_solutions_into_limits(search, solutions)
        if not sampled:
            # The order decides ties, so it must not depend on the order of searches.
            solutions = np.array(sorted(solutions, key=sort_key)).reshape(-1, robot.dof)
        elif not robot.is_redundant:
            solutions = choose_farthest_apart(robot, solutions, SELF_MOTION_SAMPLES)
        copies = all_turns(robot, solutions)
        if sampled or not copies:
            for near in (reference,) if previous is None else (reference, previous):
                if robot.is_redundant and len(solutions):
                    nearby = _move_nearest_samples(search, solutions, near)
                else:
                    nearby = [_solve(robot, waypoint, near, units)]
                copies = [*all_turns(robot, np.array(nearby)), *copies]
                previous = nearby[0]
        turns.append((copies, sampled))
    return _evaluate(robot, waypoints, turns)


def find_nearest_candidate(
    robot: Robot, waypoint: CartesianWaypoint, near: FloatArray, units: Units = SI
) -> Candidates:
    """Find the candidate at a waypoint that is nearest a configuration.

    Raises:
        OutsideLimitsError, UnreachablePoseError: The pose has no solution inside the limits.
    """
    q = _solve(robot, waypoint, near, units)
    return _evaluate(robot, [waypoint], [([q[None]], False)])[0]


def _solve(robot: Robot, waypoint: CartesianWaypoint, near: FloatArray, units: Units) -> FloatArray:
    """Find the solution of a waypoint's pose nearest a configuration, shape (d,)."""
    from knotwork.robot.kinematics.solutions.pose import solve_pose_ik

    return solve_pose_ik(
        robot,
        waypoint.pose,
        near,
        waypoint=waypoint.name,
        where=waypoint.where,
        units=units,
    ).q


def _move_nearest_samples(
    search: PoseSearch, samples: FloatArray, near: FloatArray
) -> list[FloatArray]:
    """Move the nearest of some solutions along its self-motion, to be nearer still.

    The distance of a joint has three measures, each with its solution. One uses its velocity limit
    and weight. One uses its speed after a ramp at the acceleration limit. One uses the acceleration
    limit, which determines short moves.
    """
    robot, speed = search.robot, search.robot.limits.velocity
    acceleration = robot.limits.acceleration
    scales = [joint_scales(robot)]
    if np.isfinite((speed + acceleration)[~robot.is_virtual]).all():
        with np.errstate(invalid="ignore"):  # virtual joints have no limits
            ramped = speed / (1.0 + speed / acceleration)
        for limit in (ramped, acceleration):
            usual = limit[~robot.is_virtual].mean()
            scales.append(np.where(robot.is_virtual, scales[0], limit / usual))
    result = []
    for scale in scales:
        differences = joint_difference(samples, near, joint_axes(robot).is_revolute) / scale
        q = samples[np.linalg.norm(differences, axis=1).argmin()]
        start = nearest_turns(robot, q, near)
        result.append(minimise_by_self_motion(search, start, near, scale=scale)[0])
    return result


def _track_self_motion(robot: Robot, targets: Targets) -> list[FloatArray]:
    """Sample the self-motion at each pose, and add projections of the previous pose's samples."""
    fresh = [
        choose_farthest_apart(robot, q, SELF_MOTION_SAMPLES)
        for q in sample_self_motion(robot, targets)
    ]
    samples = [fresh[0]]
    for i in range(1, len(targets)):
        projections = solve_batch(
            robot,
            targets.take([i]),
            samples[-1][:SELF_MOTION_SAMPLES],
            tolerance=1e-10,
            limits=position_limits(robot),
            max_iterations=PROJECTION_STEPS,
        )
        samples.append(np.vstack([projections.q[projections.converged], fresh[i]]))
    return samples


def _evaluate(
    robot: Robot,
    waypoints: Sequence[CartesianWaypoint],
    turns: Sequence[tuple[list[FloatArray], bool]],
) -> list[Candidates]:
    """Evaluate each solution: its joint speeds, and its nearness to limits.

    Args:
        robot: The robot.
        waypoints: The waypoints.
        turns: For each waypoint its solutions, each with its turns, shape (k, d), and whether
            these are samples.
    """
    first = np.array([copies[0] for solutions, _ in turns for copies in solutions])
    twists = np.array([np.concatenate([w.linear, w.angular]) for w in waypoints])
    twists = np.repeat(twists, [len(solutions) for solutions, _ in turns], axis=0)
    J = joint_axes(robot).jacobians(first)
    v = solve_velocities(robot, J, twists)
    residual = np.abs(twists - (J @ v[:, :, None])[:, :, 0]).max(axis=1)
    fastest = (np.abs(v) / robot.limits.velocity).max(axis=1)
    overspeed = np.where(fastest > OVERSPEED_FACTOR, fastest, 0.0)
    tolerance = TWIST_RESIDUAL * np.maximum(1.0, np.abs(twists).max(axis=1))
    unattainable = np.where(residual > tolerance, 1.0 + residual, 0.0)
    flags, singular = configuration_flags(robot, first), singular_nearness(J)
    result, begin = [], 0
    for solutions, sampled in turns:
        branch = np.repeat(np.arange(len(solutions)), [len(copies) for copies in solutions])
        row, q = begin + branch, np.concatenate(solutions)
        begin += len(solutions)
        result.append(
            Candidates(
                q=q,
                branch=branch,
                flags=flags[row],
                unattainable=unattainable[row],
                overspeed=overspeed[row],
                weight=1.0 + limit_nearness(q, arm_limits(robot)) + singular[row],
                velocity=v[row],
                branches=len(solutions),
                sampled=sampled,
            )
        )
    return result
