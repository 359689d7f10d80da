"""The closest a robot comes to a pose it does not reach: the least distance² + angle²."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import (
    FULL_TURN,
    BoolArray,
    difference,
    low_discrepancy,
    nearest_turns,
)
from knotwork.kinematics.chain.levenberg_marquardt import MAX_STEP, LocalSolution, PoseSearch
from knotwork.kinematics.solutions.enumeration import joint_axes
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# Searches made at once, with limits and without. They stop near a minimum; so many of the best,
# no two of them this close to each other [rad or m], are taken on to it.
SEARCHES = 120
REFINED = 10
APART = 0.1
# Newton's method: steps at most, and the part of the square that the last ones must gain.
NEWTON_STEPS = 60
LEAST_GAIN = 1e-9
# Half the width of the differences that the Hessian is made of [rad or m].
DIFFERENCE = 1e-5
LEAST_DAMPING = 1e-12
MOST_DAMPING = 1e8
# The finest tolerance that can be asked for [m, rad]: less may be lost to rounding. Searches aim at
# a little less than a tolerance.
FINEST_TOLERANCE = 1e-12
ROUNDING = 0.9 * FINEST_TOLERANCE
Limits = tuple[FloatArray, FloatArray]


def turning_limits(robot: Robot) -> Limits:
    """Limits for a search, shape (d,) each: none for a joint that may turn all the way around.

    Such a joint is taken inside its limits by whole turns, see `turned_inside`.
    """
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    around = joint_axes(robot).revolute & (upper - lower >= FULL_TURN)
    return np.where(around, -np.inf, lower), np.where(around, np.inf, upper)


def turned_inside(robot: Robot, q: FloatArray, near: FloatArray) -> FloatArray:
    """Take joints inside their limits by the turns nearest a configuration, then by force."""
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    turned = nearest_turns(q, near, lower, upper, joint_axes(robot).revolute)
    return np.minimum(np.maximum(turned, lower), upper)


def no_limits(robot: Robot) -> Limits:
    """Limits for a search that ignores them."""
    return np.full(robot.dof, -np.inf), np.full(robot.dof, np.inf)


def reached(solution: LocalSolution) -> bool:
    """Whether it is a solution, to the tolerances or to rounding."""
    return (
        solution.converged or max(solution.position_error, solution.orientation_error) <= ROUNDING
    )


def square(solution: LocalSolution) -> float:
    """What is least at the closest pose: distance² + angle², a metre counting as a radian."""
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
    starts = np.vstack([starts_inside(robot, near, limits, SEARCHES), *(q[None] for q in more)])
    starts = np.minimum(np.maximum(starts, limits[0]), limits[1])
    target = Targets.of([search.pose]).take(np.zeros(len(starts), dtype=int))
    found = solve_batch(
        joint_axes(robot), target, starts, tolerance=1e-9, lower=limits[0], upper=limits[1]
    )
    size = found.position_error**2 + found.orientation_error**2
    ends = apart(robot, found.q[np.argsort(size, kind="stable")], REFINED)
    return sorted((come_close(search, q, limits) for q in ends), key=square)


def apart(robot: Robot, configurations: Iterable[FloatArray], most: int) -> list[FloatArray]:
    """Take the first of some configurations, leaving out those close to one taken before."""
    revolute = joint_axes(robot).revolute
    kept: list[FloatArray] = []
    for q in configurations:
        if all(np.abs(difference(q, other, revolute)).max() > APART for other in kept):
            kept.append(q)
            if len(kept) == most:
                break
    return kept


def come_close(search: PoseSearch, q: FloatArray, limits: Limits) -> LocalSolution:
    """Come as close as possible to a pose from a configuration, and stop at a true minimum.

    Damped least squares leads to a solution if there is one. Where there is none it creeps, and
    Newton's method with the Hessian of |e|²/2 takes over, the signs of its eigenvalues dropped so
    that each step descends. Joints at a limit that the descent would leave are held.

    Args:
        search: The pose, weighted, and the robot.
        q: Where to begin, shape (d,).
        limits: To stay within.
    """
    lower, upper = limits
    found = search.solve(q, lower, upper)
    if reached(found):
        return found
    q, damping = found.q, LEAST_DAMPING
    e = search.error(q)
    least = float(e @ e)
    for _ in range(NEWTON_STEPS):
        slope = search.gradient(q)
        slope[held_at(q, slope, limits)] = 0.0
        free = np.flatnonzero(slope)
        if not free.size:
            break
        values, vectors = np.linalg.eigh(_hessian(search, q)[np.ix_(free, free)])
        along = vectors.T @ slope[free]
        before = least
        while damping <= MOST_DAMPING:
            step = np.zeros_like(q)
            step[free] = vectors @ (along / (np.abs(values) + damping))
            step *= MAX_STEP / max(MAX_STEP, float(np.abs(step).max()))
            trial = np.minimum(np.maximum(q + step, lower), upper)
            e = search.error(trial)
            if float(e @ e) < least:
                q, least = trial, float(e @ e)
                damping = max(0.1 * damping, LEAST_DAMPING)
                break
            damping = max(8.0 * damping, 1e-4 * float(np.abs(values).max()))
        if before - least <= LEAST_GAIN * before:
            break
    errors = search.errors(q)
    return LocalSolution(q, *errors, found.iterations, search.within(*errors))


def held_at(q: FloatArray, slope: FloatArray, limits: Limits, margin: float = 0.0) -> BoolArray:
    """Which joints at a limit a slope steeper than a margin would take beyond it, shape (d,)."""
    lower, upper = limits
    held: BoolArray = ((q <= lower) & (slope < -margin)) | ((q >= upper) & (slope > margin))
    return held


def _hessian(search: PoseSearch, q: FloatArray) -> FloatArray:
    """Second derivatives of |e|²/2 by differences of its gradient, shape (d, d)."""
    columns = []
    for i in range(len(q)):
        step = np.zeros_like(q)
        step[i] = DIFFERENCE
        columns.append(search.gradient(q - step) - search.gradient(q + step))
    H = np.array(columns) / (2.0 * DIFFERENCE)
    return np.asarray(0.5 * (H + H.T))


def starts_inside(robot: Robot, near: FloatArray, limits: Limits, count: int) -> FloatArray:
    """A configuration, and others that fill a box of a full turn within limits, shape (n, d)."""
    lower, upper = (np.where(np.isfinite(limit), limit, np.nan) for limit in limits)
    # What has no limit is searched around the configuration, a slide as far as the arm is long.
    chain = joint_axes(robot)
    reach = np.where(chain.revolute, np.pi, max(chain.reach, np.pi))
    low = np.fmax(near - reach, lower)
    low = np.fmin(low, np.fmax(upper - 2.0 * reach, lower))
    high = np.fmin(low + 2.0 * reach, upper)
    points = low_discrepancy(robot.dof)
    starts = low + np.array([next(points) for _ in range(count)]) * (high - low)
    return np.vstack([near, starts])
