"""Inverse kinematics of a pose (eq 3): the joint positions that bring the tool to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.chain.joint_ranges import (
    nearest_turns,
    position_limits,
    spread_starts,
)
from knotwork.robot.kinematics.chain.levenberg_marquardt import (
    HASTY_BUDGET,
    TOLERANCE_MARGIN,
    PoseSearch,
    SearchBudget,
)
from knotwork.robot.kinematics.chain.null_space import minimise_by_self_motion
from knotwork.robot.kinematics.pose_arguments import check_request
from knotwork.robot.kinematics.solutions.all_within_limits import find_solutions_within_limits
from knotwork.robot.kinematics.solutions.diagnosis import find_solution_or_raise
from knotwork.robot.kinematics.solutions.enumeration import NEAR_SINGULAR_VALUE
from knotwork.units import SI, Units

MAX_RESTARTS = 50
"""Maximum number of restarts for a first solution.

After them one batch searches for all solutions.
"""
NEAR_DISTANCE = 0.5
"""Distance from the start within which a solution of the local search counts as the nearest [rad or
m], unless a second one may be as near.
"""
TWIN_DISTANCE_FACTOR = 3.0
"""Factor on the distance of a solution, within which a second one is searched; in theory 2."""
NEAREST_TOLERANCE = 1e-6
"""Distance within which a solution is the nearest one [rad or m]."""
MAX_FOLLOWED = 8
"""Maximum number of solutions from which self-motion is followed; only the nearest one to the end.
"""
FOLLOW_DISTANCE_FACTOR = 1.5
"""Factor on the minimum distance, within which solutions are followed."""
ROUGH_STEP_FACTOR = 0.1
"""Size of a step relative to the distance, at which the others are followed no further.

The remaining gain is about the square of this.
"""


@dataclass(frozen=True, eq=False)
class IKSolution:
    """Joint positions for a pose, with their errors by forward kinematics.

    >>> robot = kw.load_robot("ur5")
    >>> home = robot.configurations["home"]
    >>> found = kw.solve_pose_ik(robot, robot.forward(home + 0.1), home)
    >>> found.converged, found.position_error < 1e-8, np.round(found.q - home, 6)
    (True, True, array([0.1, 0.1, 0.1, 0.1, 0.1, 0.1]))

    Attributes:
        q: Joint positions, inside the limits [rad or m], shape (d,), read-only.
        position_error: Distance of the TCP from the pose, by forward kinematics of `q` [m].
        orientation_error: Angle of the tool from the pose [rad].
        distance: Euclidean distance of `q` from the preferred configuration, one metre counting as
            one radian.
        iterations: Steps of all local searches, without those of the search for all solutions.
        restarts: Local searches beyond the first, without those of the search for all solutions.
        converged: Whether both errors are within the tolerances.
        reason: Text of how the search ended.
    """

    q: FloatArray
    position_error: float
    orientation_error: float
    distance: float
    iterations: int
    restarts: int
    converged: bool
    reason: str


def solve_pose_ik(
    robot: Robot,
    pose: Any,
    start: ArrayLike,
    *,
    position_tolerance: float = 1e-8,
    orientation_tolerance: float = 1e-8,
    near: ArrayLike | None = None,
    nearest: bool = True,
    waypoint: str = "",
    where: str = "",
    units: Units = SI,
) -> IKSolution:
    """Find the joint positions nearest a start that bring the TCP to a pose (eq 3).

    The first step is a local search from the start. If it fails or ends far away, the second takes
    the nearest of all solutions found, without a proof that there is no nearer one. If there is
    none, the third is a diagnosis. Joints are moved by whole turns towards the start, and a
    redundant arm is moved along its self-motion.

    Args:
        robot: The robot.
        pose: Pose of the TCP in the base frame, `pin.SE3`.
        start: Joint positions to search from [rad or m], shape (d,).
        position_tolerance: Tolerance of the position [m].
        orientation_tolerance: Orientation tolerance [rad].
        near: Preferred configuration [rad or m], shape (d,); by default the start.
        nearest: Search for the nearest solution; otherwise return the first one found.
        waypoint: Name of the waypoint, for errors.
        where: Location of its definition, for errors.
        units: Units of lengths and angles in errors.

    Raises:
        OutsideLimitsError: The pose is reachable only with joints outside their limits.
        UnreachablePoseError: The pose is not reachable, or only with another orientation.
        ArrayError: An array is not finite or has a wrong shape, or a tolerance is too fine.
        RobotError: The robot has no tool frame.

    >>> robot = kw.load_robot("ur5")
    >>> kw.solve_pose_ik(robot, robot.forward(np.ones(6)), start=np.full(6, 0.9)).q
    array([1., 1., 1., 1., 1., 1.])
    """
    check_request(pose, position_tolerance, orientation_tolerance)
    first = checked_array(start, (robot.dof,), "start")
    preferred = first if near is None else checked_array(near, (robot.dof,), "near")
    margin = TOLERANCE_MARGIN
    search = PoseSearch(robot, pose, margin * position_tolerance, margin * orientation_tolerance)
    best = _NearestSearch(search, preferred, nearest)
    best.search_from(first, HASTY_BUDGET)
    hopeless = joint_axes(robot).distance_beyond_reach(pose.translation) > position_tolerance
    if not hopeless and (best.is_nearest() if nearest else best.find_any()):
        return best.result(f"{'nearest' if nearest else 'first'} solution")
    every = np.empty((0, robot.dof))
    if not hopeless:
        every = find_solutions_within_limits(search, preferred)
    best.keep_nearest(every)
    if best.q is None:
        q = find_solution_or_raise(search, preferred, waypoint=waypoint, where=where, units=units)
        best.keep(q)
    return best.result(f"nearest of {max(len(every), 1)} solutions")


class _NearestSearch:
    """A search that keeps the solution nearest the preferred configuration, and counts steps."""

    def __init__(self, search: PoseSearch, preferred: FloatArray, nearest: bool) -> None:
        self.search = search
        self.preferred = preferred
        self.limits = position_limits(search.robot)
        self._follow = nearest and search.robot.is_redundant
        self.q: FloatArray | None = None
        self.distance = np.inf
        self.iterations = 0
        self.restarts = -1  # the first search is not counted

    def search_from(self, start: FloatArray, budget: SearchBudget) -> None:
        """Search locally, and keep the solution if it is nearer than the one before."""
        solution = self.search.solve(start, self.limits, budget)
        self.iterations += solution.iterations
        self.restarts += 1
        if solution.converged:
            self.keep(solution.q)

    def find_any(self) -> bool:
        """Search from other starts until there is a solution; return whether there is one."""
        for start in spread_starts(self.search.robot, self.limits, MAX_RESTARTS):
            if self.q is not None:
                break
            self.search_from(start, HASTY_BUDGET)
        return self.q is not None

    def keep(self, q: FloatArray) -> None:
        """Keep a solution if it is nearer than the one before."""
        q = nearest_turns(self.search.robot, q, self.preferred)
        distance = self._distance(q)
        if self._follow and distance < FOLLOW_DISTANCE_FACTOR * self.distance:
            q, steps = minimise_by_self_motion(
                self.search, q, self.preferred, ROUGH_STEP_FACTOR * distance
            )
            self.iterations += steps
            distance = self._distance(q)
        if distance < self.distance:
            self.q, self.distance = q, distance

    def keep_nearest(self, solutions: FloatArray) -> None:
        """Keep the nearest of some solutions, starting with the apparently nearest."""
        turned = nearest_turns(self.search.robot, solutions, self.preferred)
        nearest_first = sorted(turned, key=self._distance)
        for q in nearest_first[: MAX_FOLLOWED if self._follow else 1]:
            self.keep(q)

    def _distance(self, q: FloatArray) -> float:
        return math.dist(q.tolist(), self.preferred.tolist())

    def is_nearest(self) -> bool:
        """Whether the solution counts as the nearest.

        Take a step t along a right-singular vector whose singular value is σ, and let κ be the
        acceleration of the tool along the left-singular vector. To second order the tool moves by
        σt + κt²/2, which is zero again at t = −2σ/κ. Near that step there is a second solution.
        """
        if self.q is None or self.distance > NEAR_DISTANCE:
            return False
        if self.distance < NEAREST_TOLERANCE:
            return True
        within = TWIN_DISTANCE_FACTOR * self.distance
        U, s, Vt = np.linalg.svd(self.search.jacobian(self.q), full_matrices=False)
        if s[-1] < NEAR_SINGULAR_VALUE:  # the estimate is not valid
            return False
        bends = [
            abs(float(lost @ self.search.steady_acceleration(self.q, along)))
            for lost, along in zip(U.T, Vt, strict=True)
        ]
        return bool((2.0 * s >= within * np.array(bends)).all())

    def result(self, reason: str) -> IKSolution:
        """The nearest solution."""
        if self.q is None:
            raise RuntimeError("no solution has been kept")
        q = self.q
        if self._follow:
            q, steps = minimise_by_self_motion(self.search, q, self.preferred)
            self.iterations += steps
            self.distance = self._distance(q)
        errors = self.search.distance_and_angle(q)
        q.setflags(write=False)
        return IKSolution(
            q,
            *errors,
            distance=self.distance,
            iterations=self.iterations,
            restarts=self.restarts,
            converged=self.search.is_within(*errors),
            reason=reason,
        )
