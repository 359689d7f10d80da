"""The branch that a scenario requests, and the errors if it is infeasible."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from knotwork.arrays import BoolArray
from knotwork.errors import BranchError
from knotwork.robot import Robot
from knotwork.robot.kinematics.geometry.configuration_flags import (
    FLAGS,
    describe_flags,
    find_axis_geometry,
)
from knotwork.robot.kinematics.sequence.candidates import Candidates
from knotwork.task.scenario import Scenario
from knotwork.waypoints import CartesianWaypoint


def check_branch(scenario: Scenario, robot: Robot) -> None:
    """Check that the arm has the kind of branches that `branch` names.

    Raises:
        BranchError: The arm has no branches of that kind.
    """
    wanted = scenario.branch
    if wanted == "free":
        return
    if robot.dof != 6:
        fault = f"needs an arm of six joints, and {robot.name} has {robot.dof}"
        accepted = "near: a configuration, to stay near it"
    elif not isinstance(wanted, str) and find_axis_geometry(robot) is None:
        fault = f"needs a spherical wrist or parallel axes 2 to 4, which {robot.name} lacks"
        accepted = "branch: keep, branch: fixed, or near: a configuration, to stay near it"
    else:
        return
    first = next(w for w in scenario.waypoints if isinstance(w, CartesianWaypoint))
    raise BranchError(
        first.name,
        f"{_branch_text(wanted)} {fault}; accepted: {accepted}",
        branches=(),
        where=first.where,
    )


def _branch_text(branch: str | Mapping[str, str]) -> str:
    """A requested branch as a file writes it."""
    if isinstance(branch, str):
        return f"branch: {branch}"
    return "branch: {" + ", ".join(f"{flag}: {word}" for flag, word in branch.items()) + "}"


def require_branch(scenario: Scenario, robot: Robot, i: int, candidates: Candidates) -> BoolArray:
    """Whether each candidate is in the branch requested by name, as at least one must be.

    Raises:
        BranchError: No candidate is in that branch.
    """
    in_branch = is_in_branch(scenario, candidates)
    if not in_branch.any():
        raise make_branch_error(scenario, robot, i, candidates)
    return in_branch


def is_in_branch(scenario: Scenario, candidates: Candidates) -> BoolArray:
    """Whether each candidate is in the branch requested by name; all are without a request."""
    wanted = scenario.branch
    if isinstance(wanted, str):
        return np.ones(len(candidates.q), dtype=bool)
    signs = np.array(
        [
            0.0 if k not in wanted else 1.0 if wanted[k] == words[0] else -1.0
            for k, words in FLAGS.items()
        ]
    )
    return np.asarray((candidates.flags * signs >= 0).all(axis=1))


def make_branch_error(
    scenario: Scenario, robot: Robot, i: int, candidates: Candidates | None
) -> BranchError:
    """Make the error for a waypoint that is not reached in the requested branch."""
    waypoint = scenario.waypoints[i]
    flags = np.empty((0, 0)) if candidates is None else candidates.flags
    names = dict.fromkeys(describe_flags(robot, row) for row in flags)
    branches = tuple(name for name in names if name)  # an arm without branches has no names
    wanted = scenario.branch
    requested = (
        "the branch of the waypoints before it"
        if isinstance(wanted, str)
        else "branch " + ", ".join(f"{k}: {v}" for k, v in wanted.items())
    )
    reached = f"; it is reached in: {'; '.join(branches)}" if branches else ""
    return BranchError(
        waypoint.name,
        f"can't be reached in {requested}{reached}",
        branches=branches,
        where=waypoint.where,
    )
