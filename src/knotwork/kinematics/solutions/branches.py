"""All solutions of a pose: every branch with its turns, or a spread of the self-motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.kinematics.chain.joint_ranges import all_turns, limits_of, middle
from knotwork.kinematics.chain.levenberg_marquardt import MARGIN, PoseSearch
from knotwork.kinematics.diagnosis.reason import solution_or_reason
from knotwork.kinematics.geometry.configuration_flags import configuration_flags, describe_flags
from knotwork.kinematics.pose_arguments import check_count, check_request
from knotwork.kinematics.solutions.all_within_limits import in_order, solutions_within_limits
from knotwork.kinematics.solutions.enumeration import MOST_BRANCHES
from knotwork.kinematics.solutions.self_motion import farthest_apart
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray, read_only

# Configurations that stand for the self-motion of an arm that moves freely.
SPREAD = 32


@dataclass(frozen=True, eq=False)
class Branch:
    """One way for an arm to take a pose.

    >>> robot = kw.load_robot("ur5")
    >>> pose = robot.forward([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])
    >>> branches = kw.solve_pose_ik_all(robot, pose)
    >>> len(branches), branches[0].flags
    (8, 'shoulder right, elbow up, no flip')

    Attributes:
        q: Joint positions inside the limits [rad or m], shape (d,), read-only: of the turns the
            one nearest the middle of the limits, and nearest zero where there are none.
        turns: All copies inside the limits, joints whole turns apart, shape (k, d), read-only. A
            joint without limits is within half a turn of zero in all of them. Of more than
            1024 those are left out that are farthest from the middle of the limits.
        flags: The configuration flags in words, `shoulder left, elbow up, no flip`; empty where
            the arm has none.
        smallest_singular_value: That of the Jacobian: zero at a singularity.
        position_error: Distance of the TCP from the pose, by `Robot.forward` [m].
        orientation_error: Angle of the tool from the pose, by `Robot.forward` [rad].
        sampled: The arm moves freely at the pose, and this is one of the samples of that motion.
    """

    q: FloatArray
    turns: FloatArray
    flags: str
    smallest_singular_value: float
    position_error: float
    orientation_error: float
    sampled: bool = False


def solve_pose_ik_all(
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

    An arm whose geometry has one is solved in closed form: axes 2 and 3 parallel and square to
    axis 1, and a spherical wrist or the wrist of a Universal Robots arm. Near singularities, and
    for all other arms of up to six joints, searches go on until a round of them brings nothing
    new. A redundant arm has infinitely many solutions, and so has one that
    is singular at the pose: they get a spread of configurations over the self-motion instead,
    marked `sampled`. The same arguments always give the same answer.
    `robot.solve_pose_ik_all(pose)` is the same.

    Args:
        robot: The robot.
        pose: Pose of the TCP in the base frame, `pin.SE3`.
        position_tolerance: [m].
        orientation_tolerance: [rad].
        spread: How many configurations stand for a self-motion.
        waypoint: Name of the waypoint, for errors.
        where: Where it is defined, for errors.

    Returns:
        The branches in an order of their own, at least one.

    Raises:
        OutsideLimitsError, UnreachablePoseError, WaypointDataError, RobotError: As `solve_pose_ik`.

    Examples:
        >>> import knotwork as kw
        >>> robot = kw.load_robot("ur5")
        >>> branches = kw.solve_pose_ik_all(robot, robot.forward([0.4, -1.2, 1.1, -0.8, 1.0, 0.3]))
        >>> len(branches), sum(len(branch.turns) for branch in branches)
        (8, 256)
        >>> branches[0].flags
        'shoulder right, elbow down, no flip'
    """
    check_request(pose, position_tolerance, orientation_tolerance)
    check_count(spread, "spread", 1)
    asked = position_tolerance, orientation_tolerance
    search = PoseSearch(robot, pose, MARGIN * asked[0], MARGIN * asked[1])
    found = solutions_within_limits(search)
    free = robot.dof > 6 or len(found) > MOST_BRANCHES
    if free:
        found = farthest_apart(robot, found, spread)
    if not len(found):
        centre = middle(limits_of(robot))
        found = solution_or_reason(search, centre, asked, waypoint, where).q[None]
    return tuple(_branch(robot, pose, q, free) for q in sorted(found, key=in_order))


def _branch(robot: Robot, pose: Any, q: FloatArray, sampled: bool) -> Branch:
    copies = all_turns(robot, q)
    distance = np.abs(copies - middle(limits_of(robot))).sum(axis=1)
    nearest = copies[int(np.argmin(np.round(distance, 6)))]
    error = robot.forward(nearest).actInv(pose)
    return Branch(
        q=read_only(nearest, nearest.shape, "q"),
        turns=read_only(copies, copies.shape, "turns"),
        flags=describe_flags(robot, configuration_flags(robot, nearest[None])[0]),
        smallest_singular_value=float(np.linalg.svd(robot.jacobian(nearest), compute_uv=False)[-1]),
        position_error=float(np.linalg.norm(error.translation)),
        orientation_error=float(np.linalg.norm(pin.log3(error.rotation))),
        sampled=sampled,
    )
