"""All solutions of a pose: every branch with its turns, or samples of the self-motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray, checked_array
from knotwork.errors.arguments import require_count
from knotwork.errors.old_names import OldAttribute, warn_of_old_name
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import all_turns, position_limits, range_middles
from knotwork.robot.kinematics.chain.levenberg_marquardt import TOLERANCE_MARGIN, PoseSearch
from knotwork.robot.kinematics.geometry.configuration_flags import (
    configuration_flags,
    describe_flags,
)
from knotwork.robot.kinematics.pose_arguments import check_request
from knotwork.robot.kinematics.solutions.all_within_limits import (
    find_solutions_within_limits,
    sort_key,
)
from knotwork.robot.kinematics.solutions.diagnosis import find_solution_or_raise
from knotwork.robot.kinematics.solutions.enumeration import MAX_BRANCHES
from knotwork.robot.kinematics.solutions.self_motion import choose_farthest_apart

SELF_MOTION_SAMPLES = 32
"""Number of samples of the self-motion of a redundant arm."""


@dataclass(frozen=True, eq=False)
class PoseSolution:
    """A solution of a pose: one branch, with its turns.

    >>> robot = kw.load_robot("ur5")
    >>> pose = robot.forward([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
    >>> solutions = kw.solve_pose_ik_all(robot, pose)
    >>> len(solutions), solutions[0].branch
    (8, 'shoulder right, elbow up, no flip')

    Attributes:
        q: Joint positions inside the limits [rad or m], shape (d,), read-only, at the turn nearest
            the middle of the limits, or nearest zero without limits.
        turns: All copies inside the limits, offset by whole turns, shape (k, d), read-only. A
            joint without limits is within half a turn of zero. At most 1024 copies are kept,
            nearest the middle of the limits.
        branch: Name of its branch, `shoulder left, elbow up, no flip`; empty for an arm whose
            branches have no names.
        smallest_singular_value: Smallest singular value of the Jacobian: zero at a singularity.
        position_error: Distance of the TCP from the pose, by `Robot.forward` [m].
        orientation_error: Angle of the tool from the pose, by `Robot.forward` [rad].
        sampled: Whether the pose has infinitely many solutions, or very many, of which this is a
            sample.
    """

    q: FloatArray
    turns: FloatArray
    branch: str
    smallest_singular_value: float
    position_error: float
    orientation_error: float
    sampled: bool = False

    flags = OldAttribute("branch")


def solve_pose_ik_all(
    robot: Robot,
    pose: Any,
    *,
    position_tolerance: float = 1e-8,
    orientation_tolerance: float = 1e-8,
    samples: int = SELF_MOTION_SAMPLES,
    waypoint: str = "",
    where: str = "",
    spread: int | None = None,
) -> tuple[PoseSolution, ...]:
    """Find every branch that takes the TCP to a pose inside the joint limits, with its turns.

    Some arms are solved in closed form: axes 2 and 3 parallel to each other and perpendicular to
    axis 1, and a spherical wrist or that of a Universal Robots arm. Near singularities, and for
    all other arms of up to six joints, searches are repeated until a round finds nothing new. A
    redundant arm, or one that is singular at the pose, has infinitely many solutions: samples of
    its self-motion are returned, marked `sampled`. The same arguments always give the same result.
    `robot.solve_pose_ik_all(pose)` is the same.

    Args:
        robot: The robot.
        pose: Pose of the TCP in the base frame, `pin.SE3`.
        position_tolerance: Position tolerance [m].
        orientation_tolerance: Orientation tolerance [rad].
        samples: Number of samples of a self-motion.
        waypoint: Name of the waypoint, for errors.
        where: Location of its definition, for errors.
        spread: Old name of `samples`.

    Returns:
        A solution for each branch, in a fixed order, at least one.

    Raises:
        OutsideLimitsError, UnreachablePoseError, ArrayError, RobotError: As `solve_pose_ik`.

    >>> robot = kw.load_robot("ur5")
    >>> solutions = kw.solve_pose_ik_all(robot, robot.forward([0.4, -1.2, 1.1, -0.8, 1.0, 0.3]))
    >>> len(solutions), sum(len(solution.turns) for solution in solutions)
    (8, 256)
    >>> solutions[0].branch
    'shoulder right, elbow down, no flip'
    """
    check_request(pose, position_tolerance, orientation_tolerance)
    if spread is not None:
        warn_of_old_name("option 'spread'", "'samples'")
        samples = spread
    require_count(samples, "samples", 1)
    tolerances = TOLERANCE_MARGIN * position_tolerance, TOLERANCE_MARGIN * orientation_tolerance
    search = PoseSearch(robot, pose, *tolerances)
    solutions = find_solutions_within_limits(search)
    sampled = robot.is_redundant or len(solutions) > MAX_BRANCHES
    if sampled:
        solutions = choose_farthest_apart(robot, solutions, samples)
    if not len(solutions):
        centre = range_middles(position_limits(robot))
        solutions = find_solution_or_raise(search, centre, waypoint, where)[None]
    return tuple(_make_solution(robot, pose, q, sampled) for q in sorted(solutions, key=sort_key))


def _make_solution(robot: Robot, pose: Any, q: FloatArray, sampled: bool) -> PoseSolution:
    copies = all_turns(robot, q[None])[0]
    distance = np.abs(copies - range_middles(position_limits(robot))).sum(axis=1)
    nearest = copies[int(np.argmin(np.round(distance, 6)))]
    error = robot.forward(nearest).actInv(pose)
    return PoseSolution(
        q=checked_array(nearest, nearest.shape, "q"),
        turns=checked_array(copies, copies.shape, "turns"),
        branch=describe_flags(robot, configuration_flags(robot, nearest[None])[0]),
        smallest_singular_value=float(np.linalg.svd(robot.jacobian(nearest), compute_uv=False)[-1]),
        position_error=float(np.linalg.norm(error.translation)),
        orientation_error=float(np.linalg.norm(pin.log3(error.rotation))),
        sampled=sampled,
    )
