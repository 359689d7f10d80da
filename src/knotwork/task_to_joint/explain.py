"""Saying which solutions were chosen and why."""

from __future__ import annotations

import numpy as np

from knotwork.kinematics.geometry.configuration_flags import configuration_flags, describe_flags
from knotwork.kinematics.sequence.candidates import Candidates
from knotwork.robot import Robot
from knotwork.task_to_joint.search import Found, Search
from knotwork.task_to_joint.solution import Choice
from knotwork.waypoints import FloatArray


def describe_choices(search: Search, found: Found) -> tuple[Choice, ...]:
    """The solution chosen at each waypoint that is given by a pose."""
    robot, result = search.robot, []
    signs = configuration_flags(robot, found.positions)
    for i, candidates in enumerate(search.candidates):
        if candidates is None:
            continue
        changed = bool((signs[: i + 1] * signs[i] < 0).any())
        result.append(
            Choice(
                waypoint=search.scenario.waypoints[i].name,
                branch=describe_flags(robot, signs[i]),
                turns=_turns(robot, found.positions[i]),
                branches=candidates.branches,
                solutions=len(candidates.q),
                sampled=candidates.free,
                reason="nearest to its near"
                if i in search.space.solutions
                else _reason(search, found, candidates, changed),
            )
        )
    return tuple(result)


def _reason(search: Search, found: Found, candidates: Candidates, changed: bool) -> str:
    """Why a solution was chosen, in words."""
    if len(candidates.q) == 1:
        return "the only solution"
    fast = int((candidates.lost + candidates.excess != 0.0).sum())
    asked = {
        "free": "",
        "keep": ", branch changed for the speeds" if changed else ", branch kept",
        "fixed": ", branch fixed",
    }.get(str(search.scenario.branch), ", branch as asked")
    if found.sequence.cost.infeasible > 0.0:
        return f"least beyond the velocity limits{asked}"
    aim = "nearest to near" if search.near is not None else "least travel"
    if search.scenario.prefers_clearance:
        aim = "most clearance"
    elif candidates.free and search.robot.dof > 6 and search.near is None:
        aim = "least travel, and clear of limits and singularities"
    return f"{aim}{asked}" + (f"; {fast} too fast for the joints" if fast else "")


def _turns(robot: Robot, q: FloatArray) -> tuple[tuple[str, int], ...]:
    turns = np.round(q / (2 * np.pi)).astype(int)
    joints = zip(robot.joint_names, turns, robot.joint_units, strict=True)
    return tuple((name, int(turn)) for name, turn, unit in joints if turn and unit == "rad")
