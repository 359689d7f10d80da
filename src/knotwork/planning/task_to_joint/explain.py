"""The chosen solutions, and the velocity limits that no choice can keep."""

from __future__ import annotations

import numpy as np

from knotwork.planning.task_to_joint.solution import Choice, Infeasibility
from knotwork.planning.task_to_joint.solution_search import ChosenSequence, SolutionSearch
from knotwork.robot import Robot
from knotwork.robot.kinematics.geometry.configuration_flags import (
    configuration_flags,
    describe_flags,
)
from knotwork.robot.kinematics.sequence.step_costs import OVERSPEED_FACTOR
from knotwork.waypoints import FloatArray


def describe_choices(search: SolutionSearch, chosen: ChosenSequence) -> tuple[Choice, ...]:
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
            sampled=candidates.redundant,
        )
        for i, candidates in enumerate(search.candidates)
        if candidates is not None
    )


def _turns(robot: Robot, q: FloatArray) -> dict[str, int]:
    turns = np.round(q / (2 * np.pi)).astype(int)
    joints = zip(robot.joint_names, turns, robot.joint_units, strict=True)
    return {name: int(turn) for name, turn, unit in joints if turn and unit == "rad"}


def find_infeasibilities(
    search: SolutionSearch, chosen: ChosenSequence
) -> tuple[Infeasibility, ...]:
    """Intervals and waypoints that exceed a velocity limit with every choice."""
    moves = np.abs(np.diff(chosen.positions, axis=0))
    spans = [
        (i, i + 1, move / step.duration)
        for i, (move, step) in enumerate(zip(moves, search.steps, strict=True))
        if step.is_timed
    ]
    spans += [
        (i, i, np.abs(chosen.velocities[i]))
        for i, candidates in enumerate(search.candidates)
        if candidates is not None and i not in search.free_velocity
    ]
    limit = search.robot.velocity_limit * OVERSPEED_FACTOR
    return tuple(_infeasibility(search, *span) for span in spans if (span[2] > limit).any())


def _infeasibility(
    search: SolutionSearch, first: int, last: int, speed: FloatArray
) -> Infeasibility:
    """An interval in which a joint is too fast, or a waypoint where first and last are equal.

    Args:
        search: The search.
        first: Index of the waypoint.
        last: Index of the waypoint where the interval ends.
        speed: Joint speeds [rad/s or m/s], shape (d,).
    """
    robot, scenario = search.robot, search.scenario
    worst = int(np.argmax(speed / robot.velocity_limit))
    return Infeasibility(
        waypoint=scenario.waypoints[first].name,
        until=scenario.waypoints[last].name if first < last else "",
        start=float(scenario.times[first]),
        end=float(scenario.times[last]),
        joint=robot.joint_names[worst],
        velocity=float(speed[worst]),
        limit=float(robot.velocity_limit[worst]),
        unit=f"{robot.joint_units[worst]}/s",
    )
