"""Inverse kinematics of a pose (eq 3): the joint positions that bring the tool to it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.kinematics.arguments import (
    check_count,
    check_distance,
    check_pose,
    check_tolerance,
)
from knotwork.kinematics.chain.joint_ranges import low_discrepancy, nearest_turns
from knotwork.kinematics.chain.levenberg_marquardt import (
    PATIENT,
    PATIENT_ITERATIONS,
    POLISH_ITERATIONS,
    LocalSolution,
    PoseSearch,
)
from knotwork.kinematics.chain.null_space import settle_near
from knotwork.kinematics.diagnosis.reason import solution_or_reason
from knotwork.kinematics.solutions.near_singular import DEEP, STEP
from knotwork.kinematics.solutions.pulled_inside import pulled_inside
from knotwork.kinematics.solutions.starts import NEARBY_RESTARTS, in_valleys, spread, starts_after
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray, read_only

# Restarts until a first solution is found. The hardest of the shipped arms needs some tens; ten
# times as many leave little doubt that there is no solution.
MAX_RESTARTS = 200
# Searches that give up soon if they get no nearer; those after them have more patience.
HASTY_SEARCHES = 20
# Restarts in the neighbourhood that a nearer solution than the one found would lie in, when that is
# as far as `FAR` or farther; fewer for a smaller neighbourhood. Of 60 random poses about 2 rad away
# the nearest solution of a UR5 is missed for 3 with 8 restarts, for 2 with 16, for 1 with 24.
NEARER_RESTARTS = 16
FAR = 1.5  # [rad or m]
# Near a singularity a second solution may be as near as the first: it is looked for where it would
# be so many times as far from that, twice being the most in theory.
TWIN_WITHIN = 3.0
# With a smallest singular value below this that is no more than a guess; others may lie along a
# valley, or anywhere near.
NEAR_SINGULAR = 3e-3
NEAR_SINGULAR_RESTARTS = 8
# A search that ends so near its start, in a valley next to a singularity, has the nearest solution
# in there [rad or m]; from farther away other starts are quicker than to follow it.
VALLEY_BESIDE = 0.5
VALLEY_STEPS = 16
# Of many searches that failed, those that ended nearest the pose are gone on with.
MOST_GONE_ON = 20
# The free motion of an arm with more joints than the pose needs is followed from solutions that are
# not much farther than the nearest, until its steps are this part of the distance (what is left to
# gain is then about the square of it); and to the end from the nearest.
SETTLE_WITHIN = 1.5
ROUGHLY = 0.1
# Searches aim at a little less than the tolerances, so that rounding can't carry an answer across.
MARGIN = 0.9


@dataclass(frozen=True, eq=False)
class IKSolution:
    """Joint positions for a pose, with what forward kinematics makes of them.

    Attributes:
        q: Joint positions, inside the limits [rad or m], shape (d,), read-only.
        position_error: Distance of the TCP from the pose, by forward kinematics of `q` [m].
        orientation_error: Angle of the tool from the pose, likewise [rad].
        distance: From the configuration that it should be near: the Euclidean norm over the
            joints, one metre counting as one radian.
        iterations: Steps of all local searches.
        restarts: Local searches beyond the first.
        converged: Whether both errors are within the tolerances.
        reason: How the search ended.
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
    max_restarts: int = MAX_RESTARTS,
    near: ArrayLike | None = None,
    nearest: bool = True,
    waypoint: str = "",
    where: str = "",
) -> IKSolution:
    """Find the joint positions nearest a start that bring the TCP to a pose (eq 3).

    A local search from the start is followed by others from points that fill the part of joint
    space where a nearer solution would lie. Where the nearest is far, by some radians, it may be
    missed all the same; `solve_all` finds every one. Joints are taken by whole turns to where they
    are nearest; an arm with more joints than the pose needs is moved along its free motion as
    near as it gets. The same arguments always give the same answer.

    Args:
        robot: The robot.
        pose: Pose of the TCP in the base frame, `pin.SE3`.
        start: Joint positions to search from [rad or m], shape (d,).
        position_tolerance: [m].
        orientation_tolerance: [rad].
        max_restarts: Searches to make at most when the first finds nothing. If none of them does,
            others look for the reason; where they come upon a solution it is the answer.
        near: Configuration that the answer should be near [rad or m], shape (d,); by default the
            start.
        nearest: Go on to look for nearer solutions. Without, the first solution found is the
            answer, as other solvers do it: from a start close by that is the nearest all the
            same, in one local search.
        waypoint: Name of the waypoint, for errors.
        where: Where it is defined, for errors.

    Raises:
        OutsideLimitsError: The pose is reachable only with joints outside their limits.
        UnreachablePoseError: It is not reachable; the message says by how much, and whether the
            point would be in another orientation.
        WaypointDataError: An array is not finite or of another shape, or a tolerance is finer
            than rounding.
        RobotError: The robot has no tool frame.
    """
    check_pose(pose)
    usual = type(position_tolerance) is type(orientation_tolerance) is float
    usual = usual and type(max_restarts) is int and max_restarts >= 0
    if not (usual and 0.0 < position_tolerance < np.inf and 0.0 < orientation_tolerance < np.inf):
        check_tolerance(position_tolerance, "position_tolerance")
        check_tolerance(orientation_tolerance, "orientation_tolerance")
        check_count(max_restarts, "max_restarts")
    first: FloatArray
    if (  # faster than `read_only`
        type(start) is np.ndarray
        and (start.shape, start.dtype) == ((robot.dof,), float)
        and math.isfinite(sum(start.tolist()))
    ):
        first = start
    else:
        first = read_only(start, (robot.dof,), "start")
    goal = first if near is None else read_only(near, (robot.dof,), "near")
    tolerances = MARGIN * position_tolerance, MARGIN * orientation_tolerance
    search = PoseSearch(robot, pose, *tolerances)
    found = search.solve(
        first,
        robot.lower_position_limit,
        robot.upper_position_limit,
        polish_iterations=POLISH_ITERATIONS if nearest else 0,
        hasty=True,
    )
    if found.converged and not nearest:
        distance = math.dist(found.q.tolist(), goal.tolist())
        if distance <= np.pi:  # no joint is more than half a turn away
            return _ended(found, distance, found.iterations, 0, "first")
    collector = _Collector(search, goal, nearest=nearest)
    collector.take(found)
    if collector.found and not nearest:
        return collector.solution()
    points = low_discrepancy(robot.dof)
    if not collector.found:
        check_distance(pose)
        if math.dist(found.q.tolist(), goal.tolist()) < VALLEY_BESIDE:
            collector.search_on(in_valleys(search, [found], goal, VALLEY_STEPS))
            if not collector.found:
                collector.go_on([found])
    if not collector.found:
        starts = starts_after(robot, pose, goal, points, NEARBY_RESTARTS if nearest else 0)
        collector.search_on(islice(starts, max_restarts))
    if not collector.found and max_restarts:
        collector.search_on(in_valleys(search, collector.failed, goal))
    if not collector.found and max_restarts:
        collector.go_on(collector.failed)
    if not collector.found and max_restarts:
        collector.search_on(pulled_inside(search, goal))
    if not collector.found:
        asked = position_tolerance, orientation_tolerance
        collector.restarts += 1
        collector.take(
            solution_or_reason(search, goal, tolerances=asked, waypoint=waypoint, where=where)
        )
    if nearest and max_restarts:
        for start_beside in collector.twins():
            collector.search_on([start_beside])
    for restart in range(min(NEARER_RESTARTS, max_restarts) if nearest else 0):
        if restart > NEARER_RESTARTS * collector.distance / FAR:
            break
        collector.search_on(spread(robot, goal, collector.distance, points, 1))
    return collector.solution()


class _Collector:
    """Keeps the nearest of the solutions found, and counts the work."""

    def __init__(self, search: PoseSearch, near: FloatArray, *, nearest: bool) -> None:
        self.search, self.near = search, near
        self._nearest, self._settle = nearest, nearest and search.robot.dof > 6
        self._polish = POLISH_ITERATIONS if nearest else 0
        self.best: LocalSolution | None = None
        self.failed: list[LocalSolution] = []
        self.distance = np.inf
        self.iterations = self.restarts = 0
        self._measured = False

    def try_from(self, start: FloatArray) -> None:
        robot = self.search.robot
        lower, upper = robot.lower_position_limit, robot.upper_position_limit
        hasty = not self.found and self.restarts < HASTY_SEARCHES
        self.take(
            self.search.solve(start, lower, upper, polish_iterations=self._polish, hasty=hasty)
        )

    def take(self, found: LocalSolution) -> None:
        """Keep where a search ended, if it is a solution and nearer than the others."""
        self.iterations += found.iterations
        if not found.converged:
            self.failed.append(found)
            return
        robot, q = self.search.robot, found.q
        away = q - self.near
        distance = math.sqrt(away.dot(away))
        if distance > np.pi:  # else no joint is more than half a turn away
            lower, upper = robot.lower_position_limit, robot.upper_position_limit
            revolute = np.array([unit == "rad" for unit in robot.joint_units])
            q = nearest_turns(q, self.near, lower, upper, revolute)
            distance = float(np.linalg.norm(q - self.near))
        if self._settle and distance < SETTLE_WITHIN * self.distance:
            q, steps = settle_near(self.search, q, self.near, ROUGHLY * distance)
            self.iterations += steps
            distance = float(np.linalg.norm(q - self.near))
        if distance < self.distance:
            self.best, self.distance = found if q is found.q else found._replace(q=q), distance
            self._measured = q is found.q

    @property
    def found(self) -> bool:
        """Whether there is a solution."""
        return self.best is not None

    def search_on(self, starts: Iterable[FloatArray]) -> None:
        """Search from one start after the other until there is a solution."""
        for start in starts:
            self.restarts += 1
            self.try_from(start)
            if self.found:
                break

    def go_on(self, ended: Iterable[LocalSolution]) -> None:
        """Go on patiently where searches ended with a small error, until there is a solution."""
        robot = self.search.robot
        lower, upper = robot.lower_position_limit, robot.upper_position_limit
        small = sorted((one for one in ended if one.miss < DEEP), key=lambda one: one.miss)
        for one in small[:MOST_GONE_ON]:
            self.restarts += 1
            self.take(
                self.search.solve(
                    one.q,
                    lower,
                    upper,
                    PATIENT_ITERATIONS,
                    polish_iterations=self._polish,
                    patience=PATIENT,
                )
            )
            if self.found:
                break

    def twins(self) -> Iterator[FloatArray]:
        """Starts near a second solution that may be as near as the one found, if there is one.

        Along the direction v that the tool feels least, by σ, its motion bends by κ: after σ t it
        is back where it was at t = −2 σ / κ, and next to that there is a second solution.
        """
        if self.best is None or self.distance > FAR:
            return
        q = self.best.q
        U, s, Vt = np.linalg.svd(self.search.jacobian(q), full_matrices=False)
        for across, felt, along in zip(U.T, s, Vt, strict=True):
            if felt < self.distance:
                bend = float(across @ self.search.bend(q, along))
                if 2.0 * felt < TWIN_WITHIN * self.distance * abs(bend):
                    yield q - (2.0 * felt / bend) * along
        if s[-1] < NEAR_SINGULAR:
            steps = 2 + int(TWIN_WITHIN * self.distance / STEP)
            yield from in_valleys(self.search, [self.best], self.near, steps)
            points = low_discrepancy(self.search.robot.dof)
            for _ in range(NEAR_SINGULAR_RESTARTS):
                yield from spread(self.search.robot, self.near, self.distance, points, 1)

    def solution(self) -> IKSolution:
        if self.best is None:
            raise RuntimeError("no solution has been collected")
        q, best = self.best.q, self.best
        if self._settle:
            q, steps = settle_near(self.search, q, self.near)
            self.iterations += steps
            self.distance = float(np.linalg.norm(q - self.near))
        if self._measured and q is best.q:
            position, orientation = best.position_error, best.orientation_error
        else:
            position, orientation = self.search.errors(q)
        best = LocalSolution(
            q, position, orientation, best.iterations, self.search.within(position, orientation)
        )
        kind = "nearest" if self._nearest else "first"
        return _ended(best, self.distance, self.iterations, self.restarts, kind)


def _ended(
    found: LocalSolution, distance: float, iterations: int, restarts: int, kind: str
) -> IKSolution:
    found.q.setflags(write=False)
    return IKSolution(
        found.q,
        found.position_error,
        found.orientation_error,
        distance,
        iterations,
        restarts,
        found.converged,
        f"{kind} solution of {restarts + 1} searches" if restarts else "solution of one search",
    )
