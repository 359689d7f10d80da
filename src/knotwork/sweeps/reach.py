"""Poses that are certainly out of reach, found without planning.

A scenario is refused here only where that is certain: a pose is farther away than the arm is long,
its closed form has no joint positions inside the limits, or, for other arms, the pose is missed by
far in all of many searches. A pose that is missed by little may be next to a singularity or at the
end of the arm's reach: planning has better means for that, and decides.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.interpolation import get_planner
from knotwork.joint_space import joint_space
from knotwork.kinematics import solve_pose_ik_batch
from knotwork.kinematics.chain.batch import Targets
from knotwork.kinematics.chain.joint_ranges import limits_of, middle, nearest_turns
from knotwork.kinematics.geometry.closed_form import closed_form
from knotwork.kinematics.solutions.all_within_limits import EDGE
from knotwork.planner_options import planner_options
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.scenario import Scenario
from knotwork.task_to_joint.branches import check_branch
from knotwork.waypoints import CartesianWaypoint

FEW, MANY = 24, 300
"""Searches for every pose that fails from the start, and for the worst pose that is left then."""
FAR = 0.01
"""Poses that are missed by less [m + rad] are left to planning."""
TOLERANCE = 1e-7

LONG = "it is farther away than the arm is long"
NOTHING = "no joint positions lead to it"
OUTSIDE = "all joint positions that lead to it are outside the limits"
SEARCHED = f"none of {MANY} searches for joint positions inside the limits comes near it"


def out_of_reach(scenario: Scenario) -> str:
    """Say which pose no joint positions inside the limits lead to; empty if there may be some."""
    # those along a path follow from its start
    along = {i for path in scenario.paths for i in range(path.first + 1, path.last + 1)}
    asked = [
        one
        for i, one in enumerate(scenario.waypoints)
        if isinstance(one, CartesianWaypoint) and i not in along
    ]
    try:
        robot = _checked_robot(scenario)
    except InputError:
        return ""  # planning says what is wrong
    if robot is None or not asked:
        return ""
    pose, why = _missed(robot, [one.pose for one in asked])
    if not why:
        return ""
    name = asked[pose].name
    return f"waypoint {name!r}: the pose is out of reach: {why}; plan this row for its diagnosis"


def _checked_robot(scenario: Scenario) -> Robot | None:
    """The robot of a scenario that nothing is wrong with but, maybe, its poses."""
    space = joint_space(scenario)
    get_planner(scenario.planner)
    planner_options(scenario, space)
    if space.robot is None or space.robot.tool_frame is None:
        return None
    check_branch(scenario, space.robot)
    return space.robot


def _missed(robot: Robot, poses: list[Any]) -> tuple[int, str]:
    """The first of some poses that is out of reach, and why; no reason if none is."""
    targets = Targets.of(poses)
    long = joint_axes(robot).certain_miss(targets.position) > FAR
    if long.any():
        return int(long.argmax()), LONG
    unsure = []
    for i, solutions in enumerate(closed_form(robot, targets)):
        if solutions is None:
            unsure.append(i)
        elif not _inside(robot, solutions):
            return i, OUTSIDE if len(solutions) else NOTHING
    if unsure:
        errors = _errors(robot, [poses[i] for i in unsure], FEW)
        worst = unsure[int(errors.argmax())]
        if errors.max() > FAR and _errors(robot, [poses[worst]], MANY)[0] > FAR:
            return worst, SEARCHED
    return 0, ""


def _inside(robot: Robot, solutions: Any) -> bool:
    """Whether whole turns bring one of some solutions inside the limits, or near them."""
    limits = limits_of(robot)
    (low, high), centre = limits, middle(limits)
    turned = (nearest_turns(robot, q, centre) for q in solutions)
    return any(bool(((low - EDGE <= q) & (q <= high + EDGE)).all()) for q in turned)


def _errors(robot: Robot, poses: list[Any], searches: int) -> Any:
    """The remaining error of each pose [m + rad], 0 where it is met."""
    start = robot.configurations.get("home", np.zeros(robot.dof))
    found = solve_pose_ik_batch(robot, poses, start, tolerance=TOLERANCE, max_restarts=searches)
    return np.where(found.converged, 0.0, found.position_error + found.orientation_error)
