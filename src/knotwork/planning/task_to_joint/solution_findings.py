"""The chosen solutions, and the velocity limits that no choice can keep."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors.plain_text import quoted_waypoint, to_one_line
from knotwork.planning.task_to_joint.sequence_search import ChosenSequence, SequenceSearch
from knotwork.planning.task_to_joint.task_solution import Choice
from knotwork.robot import Robot
from knotwork.robot.kinematics.geometry.configuration_flags import (
    configuration_flags,
    describe_flags,
)
from knotwork.robot.kinematics.sequence.step_costs import OVERSPEED_FACTOR
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario import ScenarioWaypoint
from knotwork.verification import Finding
from knotwork.verification.finding import Group, Topic


def describe_choices(search: SequenceSearch, chosen: ChosenSequence) -> tuple[Choice, ...]:
    """The solution chosen at each waypoint that is given by a pose."""
    robot = search.robot
    flags = configuration_flags(robot, chosen.positions)
    return tuple(
        Choice(
            waypoint=search.scenario.waypoints[i].name,
            branch=describe_flags(robot, flags[i]),
            turns=_turns(robot, chosen.positions[i]),
            branches=candidates.branches,
            solutions=len(candidates.q),
            sampled=candidates.sampled,
        )
        for i, candidates in enumerate(chosen.candidates)
        if candidates is not None
    )


def _turns(robot: Robot, q: FloatArray) -> dict[str, int]:
    turns = np.round(q / (2 * np.pi)).astype(int)
    turns_by_joint = zip(robot.joint_names, turns, robot.joint_units, strict=True)
    return {name: int(turn) for name, turn, unit in turns_by_joint if turn and unit == "rad"}


def find_infeasibilities(search: SequenceSearch, chosen: ChosenSequence) -> tuple[Finding, ...]:
    """Failures of intervals and waypoints that exceed a velocity limit with every choice."""
    robot, scenario, intervals = search.robot, search.scenario, pairwise(search.scenario.waypoints)
    moves = np.abs(np.diff(chosen.positions, axis=0))
    failures = [
        _velocity_finding(robot, scenario, move / step.duration, start, end)
        for move, step, (start, end) in zip(moves, search.steps, intervals, strict=True)
        if step.is_timed
    ]
    failures += [
        _velocity_finding(robot, scenario, np.abs(chosen.velocities[i]), scenario.waypoints[i])
        for i, candidates in enumerate(chosen.candidates)
        if candidates is not None and i not in search.unknown_speeds
    ]
    return tuple(failure for failure in failures if failure is not None)


def _velocity_finding(
    robot: Robot,
    scenario: Scenario,
    speeds: FloatArray,
    start: ScenarioWaypoint,
    end: ScenarioWaypoint | None = None,
) -> Finding | None:
    """The failure of the joint that is too fast, if one is.

    Args:
        robot: The robot.
        scenario: The scenario.
        speeds: Joint speeds [rad/s or m/s], shape (d,).
        start: Waypoint with these speeds, or where an interval with these mean speeds begins.
        end: Waypoint where the interval ends.
    """
    worst = int(np.argmax(speeds / robot.limits.velocity))
    joint, unit = robot.joint_names[worst], f"{robot.joint_units[worst]}/s"
    speed, limit = float(speeds[worst]), float(robot.limits.velocity[worst])
    if not speed > limit * OVERSPEED_FACTOR:  # an unknown duration gives NaN
        return None
    if end is not None:
        why = "on average"
        place = f"from {quoted_waypoint(start.name)} to {quoted_waypoint(end.name)}"
        duration = end.time - start.time
        needed = duration * speed / limit
        remedy = f"the interval lasts {duration:.4g} s and needs at least {needed:.4g} s"
    else:
        why, place = "for the tool's velocity", f"at {quoted_waypoint(start.name)}"
        remedy = f"{limit / speed:.3g} of that velocity is feasible"
    text, allowed = scenario.units.text, scenario.units.text(limit, unit, ".4g")
    bare = scenario.units.number(speed, unit)
    short_fact = f"{to_one_line(joint)} needs {bare} of {allowed} {why}"
    return Topic(Group.FEASIBILITY, "waypoint", start.name).finding(
        "joint_velocity_needed",
        f"{place} {joint} needs {text(speed, unit, '.4g')} {why}, and its limit is {allowed}",
        "failed",
        value=speed,
        limit=limit,
        margin=limit - speed,
        unit=unit,
        time=None if end is not None else start.time,
        short_fact=short_fact,
        remedy=remedy,
        interval=None if end is None else (start.time, end.time),
    )
