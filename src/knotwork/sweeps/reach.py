"""Poses of many scenarios, tested in one batch: which rows can't pass, and why.

A row is refused here only where that is certain: a pose is farther away than the arm is long, its
closed form has no joint positions inside the limits, or, for other arms, the pose is missed by far
in all of many searches. A pose that is missed by little may be next to a singularity or at the
end of the arm's reach: planning has better means for that, and decides.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from knotwork.errors import InputError
from knotwork.interpolation import get_planner
from knotwork.joint_space import joint_space
from knotwork.kinematics import solve_pose_ik_batch
from knotwork.kinematics.chain.batch import Targets
from knotwork.kinematics.chain.joint_axes import joint_axes
from knotwork.kinematics.chain.joint_ranges import limits_of, middle, nearest_turns
from knotwork.kinematics.geometry.closed_form import closed_form
from knotwork.kinematics.solutions.all_within_limits import EDGE
from knotwork.planner_options import planner_options
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.sweeps.outcome import OUT_OF_REACH, REFUSED, Outcome
from knotwork.task_to_joint.branches import check_branch
from knotwork.waypoints import CartesianWaypoint

FEW, MANY = 24, 300
"""Searches for every pose that fails from the start, and for the worst pose of a row left then."""
FAR = 0.01
"""Poses that are missed by less [m + rad] are left to planning."""
TOLERANCE = 1e-7
MOST_ROBOTS = 64
"""Robots that are kept."""
# All else of a scenario may decide which robot it has, or be wrong before its poses are looked at.
_OTHERWISE = ("name", "description", "frames", "scene", "waypoints")

LONG = "it is farther away than the arm is long"
NOTHING = "no joint positions lead to it"
OUTSIDE = "all joint positions that lead to it are outside the limits"
SEARCHED = f"none of {MANY} searches for joint positions inside the limits comes near it"


class ReachTest:
    """Finds rows with poses out of reach; keeps the robots it has loaded."""

    def __init__(self) -> None:
        self._robots: dict[str, Robot | None] = {}

    def refused(self, scenarios: Mapping[int, Scenario]) -> dict[int, Outcome]:
        """Find rows with a pose that no joint positions inside the limits lead to.

        What is found depends on the rows given together in no digit, as neither a closed form nor
        the searches for one pose know the others.

        Args:
            scenarios: By row.

        Returns:
            The outcomes of those that are refused, by row.
        """
        groups: dict[str, list[int]] = {}
        for row, scenario in scenarios.items():
            groups.setdefault(_robot_key(scenario), []).append(row)
        found: dict[int, Outcome] = {}
        for key, rows in groups.items():
            robot = self._robot(key, scenarios[rows[0]])
            if robot is not None:
                targets = [(row, *pose) for row in rows for pose in _poses(scenarios[row])]
                found |= _refused(robot, targets)
        return found

    def _robot(self, key: str, scenario: Scenario) -> Robot | None:
        """The robot of a scenario; `None` if it has none that could be out of reach."""
        if key not in self._robots:
            if len(self._robots) >= MOST_ROBOTS:
                self._robots.clear()
            try:
                self._robots[key] = _checked_robot(scenario)
            except InputError:
                self._robots[key] = None  # planning says what is wrong
        return self._robots[key]


def _poses(scenario: Scenario) -> Iterator[tuple[str, Any]]:
    """Name and pose of the waypoints that planning solves first; a path follows from its start."""
    along = {i for path in scenario.paths for i in range(path.first + 1, path.last + 1)}
    for i, waypoint in enumerate(scenario.waypoints):
        if isinstance(waypoint, CartesianWaypoint) and i not in along:
            yield waypoint.name, waypoint.pose


def _robot_key(scenario: Scenario) -> str:
    data: Any = scenario.document.data if scenario.document is not None else {}
    kept = {name: value for name, value in data.items() if name not in _OTHERWISE}
    return json.dumps(kept, sort_keys=True, default=str)


def _checked_robot(scenario: Scenario) -> Robot | None:
    """The robot of a scenario that nothing is wrong with but, maybe, its poses."""
    space = joint_space(scenario)
    get_planner(scenario.planner)
    planner_options(scenario, space)
    if space.robot is None or space.robot.tool_frame is None:
        return None
    check_branch(scenario, space.robot)
    return space.robot


def _refused(robot: Robot, targets: list[tuple[int, str, Any]]) -> dict[int, Outcome]:
    """Rows with a pose out of reach, and which; targets are row, waypoint and pose."""
    found: dict[int, Outcome] = {}
    unsure: list[tuple[int, str, Any]] = []
    for target, why in zip(targets, _reasons(robot, [pose for *_, pose in targets]), strict=True):
        row, name, _ = target
        if why:
            found.setdefault(row, _outcome(name, why))
        elif why is None:
            unsure.append(target)
    left = [target for target in unsure if target[0] not in found]
    return found | (_searched(robot, left) if left else {})


def _reasons(robot: Robot, poses: list[Any]) -> list[str | None]:
    """Why each pose is out of reach; empty if it may not be, `None` if searches have to tell."""
    if not poses:
        return []
    targets = Targets.of(poses)
    long = joint_axes(robot).certain_miss(targets.position) > FAR
    reasons: list[str | None] = [LONG if one else None for one in long]
    near = np.flatnonzero(~long).tolist()
    if near:
        for i, solutions in zip(near, closed_form(robot, targets.take(near)), strict=True):
            if solutions is not None:
                reasons[i] = (
                    "" if _inside(robot, solutions) else OUTSIDE if len(solutions) else NOTHING
                )
    return reasons


def _inside(robot: Robot, solutions: Any) -> bool:
    """Whether whole turns bring one of some solutions inside the limits, or near them."""
    limits = limits_of(robot)
    (low, high), centre = limits, middle(limits)
    turned = (nearest_turns(robot, q, centre) for q in solutions)
    return any(bool(((low - EDGE <= q) & (q <= high + EDGE)).all()) for q in turned)


def _searched(robot: Robot, targets: list[tuple[int, str, Any]]) -> dict[int, Outcome]:
    """Rows whose worst pose no search comes near."""
    start = robot.configurations.get("home", np.zeros(robot.dof))
    error = _errors(robot, [pose for *_, pose in targets], start, FEW)
    worst: dict[int, int] = {}
    for i, (row, *_) in enumerate(targets):
        if error[i] > FAR and (row not in worst or error[i] > error[worst[row]]):
            worst[row] = i
    if not worst:
        return {}
    left = _errors(robot, [targets[i][2] for i in worst.values()], start, MANY)
    return {
        row: _outcome(targets[i][1], SEARCHED)
        for (row, i), miss in zip(worst.items(), left, strict=True)
        if miss > FAR
    }


def _outcome(waypoint: str, why: str) -> Outcome:
    message = (
        f"waypoint {waypoint!r}: the pose is out of reach: {why}; plan this row for its diagnosis"
    )
    return Outcome(REFUSED, OUT_OF_REACH, message)


def _errors(robot: Robot, poses: list[Any], start: Any, searches: int) -> Any:
    """The remaining error of each pose [m + rad], 0 where it is met; equal poses once."""
    keys = [pose.homogeneous.tobytes() for pose in poses]
    first = {key: i for i, key in reversed(list(enumerate(keys)))}
    once = sorted(first.values())
    place = {keys[i]: k for k, i in enumerate(once)}
    found = solve_pose_ik_batch(
        robot, [poses[i] for i in once], start, tolerance=TOLERANCE, max_restarts=searches
    )
    left = np.where(found.converged, 0.0, found.position_error + found.orientation_error)
    return left[[place[key] for key in keys]]
