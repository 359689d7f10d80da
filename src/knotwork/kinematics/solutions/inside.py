"""All solutions of a pose inside the joint limits, before turns are counted."""

from __future__ import annotations

import numpy as np

from knotwork.kinematics.chain.batch import Targets
from knotwork.kinematics.chain.joint_ranges import (
    AT_LIMIT,
    clipped,
    limits_of,
    middle,
    nearest_turns,
)
from knotwork.kinematics.chain.levenberg_marquardt import PoseSearch
from knotwork.kinematics.solutions.enumeration import find_branches
from knotwork.kinematics.solutions.self_motion import sample_self_motion
from knotwork.waypoints import FloatArray

# A solution outside the limits by up to this [rad or m] has another beside it inside, if the arm
# is so near a singularity that rounding moves solutions that far.
EDGE = 1e-2


def solutions_inside(search: PoseSearch) -> FloatArray:
    """Find all solutions of a pose inside the limits, at the turns nearest their middle.

    For an arm of up to six joints all solutions, whatever the limits, and of these the ones that
    some turn brings inside. For a redundant arm samples of its self-motion, so many that at least
    one is near any solution.

    Args:
        search: The pose, the robot and the tolerances.

    Returns:
        Shape (k, d).
    """
    robot, targets = search.robot, Targets.of([search.pose])
    find = sample_self_motion if robot.dof > 6 else find_branches
    return brought_inside(search, find(robot, targets)[0])


def brought_inside(search: PoseSearch, solutions: FloatArray) -> FloatArray:
    """Solutions that whole turns bring inside the limits, at that turn, shape (k, d)."""
    robot, limits = search.robot, limits_of(search.robot)
    centre, kept = middle(limits), []
    for solution in solutions:
        turned = nearest_turns(robot, solution, centre)
        q = clipped(turned, limits)
        beyond = float(np.abs(turned - q).max())
        if beyond > EDGE:
            continue
        if beyond > AT_LIMIT or not search.within(*search.errors(q)):
            found = search.solve(q, limits)
            if not found.converged or np.abs(found.q - turned).max() > EDGE:
                continue
            q = found.q
        kept.append(q)
    return np.array(kept).reshape(-1, robot.dof)


def in_order(q: FloatArray) -> tuple[float, ...]:
    """Key that sorts configurations alike on every machine."""
    return tuple((np.round(q, 5) + 0.0).tolist())
