"""The closest a robot comes to a pose it does not reach: the least distance² + angle²."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import (
    Limits,
    clipped,
    joint_distances,
    starts,
)
from knotwork.kinematics.chain.levenberg_marquardt import (
    PATIENT,
    LocalSolution,
    PoseSearch,
)
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import FloatArray

# Searches made at once, with limits and without. They stop near a minimum; some of the best,
# no two of them this close to each other [rad or m], are taken on to it.
SEARCHES = 120
REFINED = 8
APART = 0.1
# A search that ends this near the pose [m, rad] may still get there, where the arm is singular in
# more than one way at once.
SMALL = 1e-2
# Steps of the minimisation, and the gradient at which it ends [m or rad a joint's unit].
MOST_STEPS = 500
FLAT = 1e-10
# The finest tolerance that can be asked for [m, rad]: less may be lost to rounding. Searches aim at
# a little less than a tolerance.
FINEST_TOLERANCE = 1e-12
ROUNDING = 0.9 * FINEST_TOLERANCE


def reached(solution: LocalSolution) -> bool:
    """Whether it is a solution, to the tolerances or to rounding."""
    return (
        solution.converged or max(solution.position_error, solution.orientation_error) <= ROUNDING
    )


def square(solution: LocalSolution) -> float:
    """The quantity that the search minimises: distance² + angle², a metre counting as a radian."""
    return solution.position_error**2 + solution.orientation_error**2


def closest_poses(
    search: PoseSearch, near: FloatArray, limits: Limits, more: Iterable[FloatArray] = ()
) -> list[LocalSolution]:
    """Come as close to a pose as limits allow, from all over joint space.

    Args:
        search: The pose, and the robot.
        near: Configuration that matters most, shape (d,).
        limits: To stay within.
        more: Configurations to search from besides, shape (d,) each.

    Returns:
        The closest minima found, the closest first.
    """
    robot = search.robot
    begin = np.vstack([starts_from(robot, near, limits, SEARCHES), *(q[None] for q in more)])
    found = solve_batch(robot, Targets.of([search.pose]), begin, tolerance=1e-9, limits=limits)
    size = found.position_error**2 + found.orientation_error**2
    ends = apart(robot, found.q[np.argsort(size, kind="stable")], REFINED)
    return sorted((come_close(search, q, limits) for q in ends), key=square)


def starts_from(robot: Robot, near: FloatArray, limits: Limits, count: int) -> FloatArray:
    """A configuration, and others that fill the box around it within limits, shape (n, d)."""
    return np.vstack([near, starts(robot, limits, count, around=near)])


def apart(robot: Robot, configurations: Iterable[FloatArray], most: int) -> list[FloatArray]:
    """Take the first of some configurations, leaving out those close to one taken before."""
    revolute = joint_axes(robot).revolute
    kept: list[FloatArray] = []
    for q in configurations:
        if all(joint_distances(q, other, revolute) > APART for other in kept):
            kept.append(q)
            if len(kept) == most:
                break
    return kept


def come_close(search: PoseSearch, q: FloatArray, limits: Limits) -> LocalSolution:
    """Come as close as possible to a pose from a configuration, and stop at a true minimum.

    Damped least squares leads to a solution if there is one. Where there is none it creeps, and
    |e|²/2 is minimised by its exact gradient instead (L-BFGS-B).

    Args:
        search: The pose, weighted, and the robot.
        q: Where to begin, shape (d,).
        limits: To stay within.
    """
    found = search.solve(q, limits)
    if not reached(found) and found.miss < SMALL:
        found = search.solve(found.q, limits, PATIENT)
    if reached(found):
        return found
    from scipy.optimize import minimize

    options = {"ftol": 0.0, "gtol": FLAT, "maxiter": MOST_STEPS}
    bounds, least = np.transpose(limits), search.value_and_gradient
    ended = minimize(least, found.q, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return search.measured(clipped(ended.x, limits))
