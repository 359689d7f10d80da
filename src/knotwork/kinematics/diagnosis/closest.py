"""The pose of a robot closest to one it does not reach: the minimum of distance² + angle²."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import (
    Limits,
    clip,
    joint_distances,
    spread_starts,
)
from knotwork.kinematics.chain.levenberg_marquardt import (
    PATIENT_EFFORT,
    LocalSolution,
    PoseSearch,
)
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import FloatArray

# Searches in one batch, with limits and without. They stop near a minimum; `MAX_REFINED` of the
# best, with at least this distance between them [rad or m], are refined.
CLOSEST_SEARCHES = 120
MAX_REFINED = 8
SAME_MINIMUM = 0.1
# A search that ends within this error [m, rad] may still converge at simultaneous singularities.
SMALL_ERROR = 1e-2
# Maximum steps of the minimisation, and the gradient at which it ends [m or rad per joint unit].
MINIMISER_STEPS = 500
FLAT_GRADIENT = 1e-10


def squared_error(solution: LocalSolution) -> float:
    """The minimised quantity: distance² + angle², one metre counting as one radian."""
    return solution.position_error**2 + solution.orientation_error**2


def closest_poses(
    search: PoseSearch, near: FloatArray, limits: Limits, more: Iterable[FloatArray] = ()
) -> list[LocalSolution]:
    """Find the poses closest to one that limits allow, from starts all over joint space.

    Args:
        search: The pose, and the robot.
        near: Preferred configuration, shape (d,).
        limits: Joint limits.
        more: Additional starts, shape (d,) each.

    Returns:
        The closest minima found, the closest first.
    """
    robot = search.robot
    begin = np.vstack(
        [starts_from(robot, near, limits, CLOSEST_SEARCHES), *(q[None] for q in more)]
    )
    ended = solve_batch(
        robot, Targets.from_poses([search.pose]), begin, tolerance=1e-9, limits=limits
    )
    size = ended.position_error**2 + ended.orientation_error**2
    ends = distinct_minima(robot, ended.q[np.argsort(size, kind="stable")], MAX_REFINED)
    return sorted((come_close(search, q, limits) for q in ends), key=squared_error)


def starts_from(robot: Robot, near: FloatArray, limits: Limits, count: int) -> FloatArray:
    """A configuration and others spread over a box around it within limits, shape (n, d)."""
    return np.vstack([near, spread_starts(robot, limits, count, around=near)])


def distinct_minima(
    robot: Robot, configurations: Iterable[FloatArray], most: int
) -> list[FloatArray]:
    """Select configurations in order, without those close to one selected before."""
    revolute = joint_axes(robot).revolute
    selected: list[FloatArray] = []
    for q in configurations:
        if all(joint_distances(q, p, revolute) > SAME_MINIMUM for p in selected):
            selected.append(q)
            if len(selected) == most:
                break
    return selected


def come_close(search: PoseSearch, q: FloatArray, limits: Limits) -> LocalSolution:
    """Minimise the pose error from a configuration, to a true minimum.

    Damped least squares converges to a solution if there is one. Otherwise it is slow, and |e|²/2
    is minimised with its exact gradient instead (L-BFGS-B).

    Args:
        search: The pose, weighted, and the robot.
        q: Start, shape (d,).
        limits: Joint limits.
    """
    solution = search.solve(q, limits)
    if not solution.converged and squared_error(solution) < SMALL_ERROR**2:
        solution = search.solve(solution.q, limits, PATIENT_EFFORT)
    if solution.converged:
        return solution
    from scipy.optimize import minimize

    options = {"ftol": 0.0, "gtol": FLAT_GRADIENT, "maxiter": MINIMISER_STEPS}
    bounds, least = np.transpose(limits), search.value_and_gradient
    ended = minimize(least, solution.q, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return search.measure(clip(ended.x, limits))
