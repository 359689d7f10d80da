"""All configurations of an arm of up to six joints for a pose, without their turns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.robot.kinematics.chain.batch import Targets, solve_batch
from knotwork.robot.kinematics.chain.joint_ranges import (
    Limits,
    infinite_limits,
    joint_difference,
    position_limits,
    spread_starts,
)
from knotwork.robot.kinematics.geometry.closed_form import SOLUTION_ERROR, solve_closed_form
from knotwork.robot.kinematics.geometry.configuration_flags import are_all_branches

STARTS = 48
"""Number of starts in a batch, whose steps take hardly longer than those of one of half the size.

Branches attract about equal shares of the starts: each of a UR5's gets an eighth.
"""
SEARCH_ROUNDS = 6
"""Maximum number of batches for a pose."""
SEARCH_ITERATIONS = 72
"""Maximum number of steps of a batch."""
SOLUTION_TOLERANCE = 1e-5
"""Distance within which solutions are equal [rad or m].

The remaining pose error moves no joint by more, except where two branches meet.
"""
JOINED_DISTANCE = 1e-2
"""Distance within which solutions are equal if the pose is kept halfway between [rad or m]."""
JOINED_ERROR = 1e-9
"""Error below which a pose is kept [m, rad]."""
NEAR_SINGULAR_VALUE = 3e-3
"""Singular value below which searches also start along the singular direction."""
SINGULAR_STEPS = np.array([-2.4, -1.6, -0.8, -0.4, -0.2, 0.2, 0.4, 0.8, 1.6, 2.4])
"""Distances of these starts from a solution along that direction [rad or m]."""
MAX_BRANCHES = 16
"""Maximum number of solutions of a six-joint arm; one with more is redundant at the pose."""


def find_branches(robot: Robot, targets: Targets) -> list[FloatArray]:
    """Find all solutions for each pose, regardless of the position limits of revolute joints.

    The closed form is used if its result is certain, otherwise searches.

    Args:
        robot: An arm of up to six joints.
        targets: n poses in the base frame.

    Returns:
        For each pose the solutions, revolute joints within half a turn of zero, shape (b, d).
    """
    exact = solve_closed_form(robot, targets)
    uncertain = [i for i, closed_form in enumerate(exact) if not closed_form.certain]
    if uncertain:
        guesses = [exact[i].q for i in uncertain]
        searched = iter(search_branches(robot, targets.take(uncertain), guesses))
    return [closed_form.q if closed_form.certain else next(searched) for closed_form in exact]


def search_branches(
    robot: Robot, targets: Targets, guesses: Sequence[FloatArray] = ()
) -> list[FloatArray]:
    """Find all solutions for each pose by searches.

    Rounds of searches are repeated for a pose until all solutions that its configuration flags
    allow are found, or a round finds nothing new. Starts are a low-discrepancy sequence. Near a
    singularity a solution may be missing.

    Args:
        robot: An arm of up to six joints.
        targets: n poses in the base frame.
        guesses: For each pose configurations near its solutions, shape (k, d) each, if known.

    Returns:
        As `find_branches`.
    """
    n, d, box = len(targets), robot.dof, _slide_limits(robot)
    solutions_of = [np.empty((0, d)) for _ in range(n)]
    for i, guess in enumerate(guesses):
        if not len(guess):
            continue
        ended = solve_batch(robot, targets.take([i]), guess, tolerance=SOLUTION_ERROR)
        # near a singularity rounding ends searches earlier
        solved = np.maximum(ended.position_error, ended.orientation_error) <= JOINED_ERROR
        solutions_of[i] = drop_equal_solutions(robot, targets.take([i]), ended.q[solved])
    active = [i for i in range(n) if not _are_all(robot, solutions_of[i])]
    for round_ in range(SEARCH_ROUNDS):
        if not active:
            break
        spread = spread_starts(robot, box, STARTS, skip=round_ * STARTS)
        begin = [np.vstack([_near_singular_starts(robot, solutions_of[i]), spread]) for i in active]
        owner = np.repeat(active, [len(start) for start in begin])
        ended = solve_batch(
            robot,
            targets.take(owner),
            np.concatenate(begin),
            tolerance=SOLUTION_ERROR,
            max_iterations=SEARCH_ITERATIONS,
        )
        remaining = []
        for i in active:
            earlier, solved = solutions_of[i], ended.q[(owner == i) & ended.converged]
            every = np.vstack([earlier, solved])
            solutions_of[i] = drop_equal_solutions(robot, targets.take([i]), every)
            complete = _are_all(robot, solutions_of[i])
            calm = round_ > 0 and len(solutions_of[i]) == len(earlier)
            if complete is False or (complete is None and not calm):
                remaining.append(i)
        active = remaining
    revolute = joint_axes(robot).is_revolute
    return [joint_difference(solutions, np.zeros(d), revolute) for solutions in solutions_of]


def _are_all(robot: Robot, solutions: FloatArray) -> bool | None:
    """Whether these are all solutions of a pose, as far as flags show; `None` if unknown."""
    return True if len(solutions) > MAX_BRANCHES else are_all_branches(robot, solutions)


def _near_singular_starts(robot: Robot, solutions: FloatArray) -> FloatArray:
    """Configurations along which solutions (n, d) near a singularity hardly move the tool, (k, d).

    Other solutions are near such a line, and attract few other searches.
    """
    _, s, Vt = np.linalg.svd(joint_axes(robot).jacobians(solutions), full_matrices=False)
    near = s[:, -1] < NEAR_SINGULAR_VALUE
    moves = SINGULAR_STEPS[:, None, None] * Vt[near, -1]
    return np.asarray((solutions[near] + moves).reshape(-1, robot.dof))


def _slide_limits(robot: Robot) -> Limits:
    """Position limits of prismatic joints; revolute ones get none."""
    revolute = joint_axes(robot).is_revolute
    (lower, upper), (low, high) = infinite_limits(robot), position_limits(robot)
    return np.where(revolute, lower, low), np.where(revolute, upper, high)


def drop_equal_solutions(robot: Robot, target: Targets, solutions: FloatArray) -> FloatArray:
    """Drop solutions that equal an earlier one or are connected to it by a self-motion.

    Where two branches meet, searches end on both sides of that point. Near a singularity they end
    anywhere near the solution.
    """
    chain = joint_axes(robot)
    result: list[FloatArray] = []
    for q in solutions:
        differences = joint_difference(q, np.array(result).reshape(-1, len(q)), chain.is_revolute)
        sizes = np.abs(differences).max(axis=1)
        if (sizes <= SOLUTION_TOLERANCE).any():
            continue
        between = q - 0.5 * differences[sizes < JOINED_DISTANCE]
        if len(between):
            tip, rotation, *_ = chain.forward(between)
            poses = target.take(np.zeros(len(between), dtype=int))
            _, distance, angle = pose_errors(tip, rotation, poses.position, poses.rotation)
            if (np.maximum(distance, angle) < JOINED_ERROR).any():
                continue
        result.append(q)
    return np.array(result).reshape(-1, solutions.shape[1])
