"""The reason why a pose has no solution: joints outside their limits, or the closest pose."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import OutsideLimitsError, UnreachablePoseError
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.chain.batch import Targets, solve_batch
from knotwork.robot.kinematics.chain.joint_ranges import (
    LIMIT_TOLERANCE,
    Limits,
    clip_to_limits,
    infinite_limits,
    joint_distances,
    nearest_turns,
    position_limits,
    spread_starts,
    turn_into_limits,
    turning_limits,
)
from knotwork.robot.kinematics.chain.levenberg_marquardt import (
    PATIENT_BUDGET,
    LocalSolution,
    PoseSearch,
)
from knotwork.units import SI, Units

POINT_FIRST = 1e3
"""Weight of a metre relative to a radian: the closest pose is at the nearest point, and there
turned as little as possible.
"""
CLOSEST_SEARCHES = 120
"""Number of searches in one batch, which stop near a minimum."""
MAX_REFINED = 8
"""Maximum number of the best searches that are refined."""
MIN_SEPARATION = 0.1
"""Minimum distance between refined searches [rad or m]."""
MINIMISER_STEPS = 500
"""Maximum number of steps of the minimisation."""
FLAT_GRADIENT = 1e-10
"""Gradient at which the minimisation ends [m or rad per joint unit]."""


def find_solution_or_raise(
    search: PoseSearch,
    near: FloatArray,
    waypoint: str,
    where: str,
    units: Units = SI,
) -> FloatArray:
    """Search for a solution from all over joint space; raise the reason if there is none.

    Args:
        search: The pose, and the robot.
        near: Preferred configuration, shape (d,).
        waypoint: Name of the waypoint.
        where: Location of its definition.
        units: Units of the message.

    Returns:
        A solution inside the limits, shape (d,), if one is found after all.

    Raises:
        OutsideLimitsError: Only joint positions outside their limits reach the pose.
        UnreachablePoseError: No joint positions reach the pose.
    """
    robot, limits = search.robot, turning_limits(search.robot)
    beyond = _solve_without_limits(search, near)
    starts = [*_search_batch(search, near, limits), *beyond]
    ends = [search.solve(q, limits, PATIENT_BUDGET) for q in starts]
    if not any(end.converged for end in ends):  # a solution may be singular, where steps are short
        starts = [_minimise(search, end.q, limits) for end in ends]
        ends += [search.solve(q, limits, PATIENT_BUDGET) for q in starts]
    inside = [search.measure(turn_into_limits(robot, end.q, near)) for end in ends]
    solutions = [end.q for end in inside if end.converged]
    if solutions:
        return min(solutions, key=lambda q: float(np.linalg.norm(q - near)))
    if beyond:
        raise OutsideLimitsError(
            waypoint,
            _find_least_outside(robot, beyond, near),
            joint_units=dict(zip(robot.joint_names, robot.joint_units, strict=True)),
            where=where,
            units=units,
        )
    # nearest points may be far from the ends of searches for the whole pose
    spread = spread_starts(robot, limits, MAX_REFINED, centre=near)
    closest = _find_closest_pose(search, [*(end.q for end in ends), *spread], limits)
    end = search.solve(closest.q, limits, PATIENT_BUDGET)
    end = search.measure(turn_into_limits(robot, end.q, near))
    if end.converged:
        return end.q
    raise UnreachablePoseError(
        waypoint,
        closest=turn_into_limits(robot, closest.q, near).tolist(),
        closest_distance=closest.position_error,
        closest_angle=closest.orientation_error,
        where=where,
        units=units,
    )


def _solve_without_limits(search: PoseSearch, near: FloatArray) -> list[FloatArray]:
    """Find solutions of the pose inside or outside the joint limits."""
    robot, endless = search.robot, infinite_limits(search.robot)
    if joint_axes(robot).distance_beyond_reach(search.pose.translation) > search.tolerances[0]:
        return []
    starts = _search_batch(search, near, endless)
    ends = [search.solve(q, endless, PATIENT_BUDGET) for q in starts]
    return [nearest_turns(robot, end.q, near) for end in ends if end.converged]


def _search_batch(search: PoseSearch, near: FloatArray, limits: Limits) -> list[FloatArray]:
    """Search from all over joint space; return the best ends that differ from each other."""
    robot = search.robot
    begin = spread_starts(robot, limits, CLOSEST_SEARCHES, centre=near)
    ended = solve_batch(
        robot,
        Targets.from_poses([search.pose]),
        np.vstack([near, begin]),
        tolerance=1e-9,
        limits=limits,
    )
    order = np.argsort(ended.position_error + ended.orientation_error, kind="stable")
    revolute = joint_axes(robot).is_revolute
    selected: list[FloatArray] = []
    for q in ended.q[order]:
        if all(joint_distances(q, p, revolute) > MIN_SEPARATION for p in selected):
            selected.append(q)
    return selected[:MAX_REFINED]


def _find_least_outside(
    robot: Robot, solutions: list[FloatArray], near: FloatArray
) -> list[tuple[str, float, float, float]]:
    """List the joints outside their limits at the solution with the smallest excess."""
    lower, upper = position_limits(robot)

    def excess(q: FloatArray) -> FloatArray:
        return np.asarray(np.maximum(np.maximum(lower - q, q - upper), 0.0))

    best = min(solutions, key=lambda q: (float(excess(q).sum()), float(np.linalg.norm(q - near))))
    over = excess(best)
    # An excess within rounding is not reported if another joint is outside.
    return [
        (robot.joint_names[i], float(best[i]), float(lower[i]), float(upper[i]))
        for i in np.flatnonzero(over > min(LIMIT_TOLERANCE, 0.5 * over.max()))
    ]


def _find_closest_pose(
    search: PoseSearch, starts: list[FloatArray], limits: Limits
) -> LocalSolution:
    """Find the pose at the nearest point, turned as little as possible."""
    weighted = PoseSearch(
        search.robot, search.pose, *search.tolerances, position_weight=POINT_FIRST
    )
    ends = [_minimise(weighted, q, limits) for q in starts]
    q = min(ends, key=lambda end: weighted.value_and_gradient(end)[0])
    # the angle still draws the tool off a point that can be reached
    point = PoseSearch(search.robot, search.pose, *search.tolerances, orientation_weight=0.0)
    at_point = point.solve(q, limits)
    return search.measure(at_point.q if at_point.converged else q)


def _minimise(search: PoseSearch, start: FloatArray, limits: Limits) -> FloatArray:
    """Minimise |e|²/2 within limits from a configuration, by L-BFGS-B, shape (d,).

    Damped least squares is slow where there is no solution.
    """
    from scipy.optimize import minimize

    options = {"ftol": 0.0, "gtol": FLAT_GRADIENT, "maxiter": MINIMISER_STEPS}
    end = minimize(
        search.value_and_gradient,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=np.transpose(limits),
        options=options,
    )
    return clip_to_limits(end.x, limits)
