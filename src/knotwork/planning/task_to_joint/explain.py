"""Reasons of the chosen solutions, and velocity limits that no choice can keep."""

from __future__ import annotations

import numpy as np

from knotwork.kinematics.geometry.configuration_flags import configuration_flags, describe_flags
from knotwork.kinematics.sequence.candidates import Candidates
from knotwork.kinematics.sequence.cost import CostLevel
from knotwork.kinematics.sequence.step_costs import OVERSPEED_FACTOR
from knotwork.planning.task_to_joint.solution import Choice, Infeasibility
from knotwork.planning.task_to_joint.solution_search import ChosenSequence, SolutionSearch
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray


def describe_choices(search: SolutionSearch, chosen: ChosenSequence) -> tuple[Choice, ...]:
    """The solution chosen at each waypoint that is given by a pose."""
    robot, result = search.robot, []
    signs = configuration_flags(robot, chosen.positions)
    for i, candidates in enumerate(search.candidates):
        if candidates is None:
            continue
        changed = bool((signs[: i + 1] * signs[i] < 0).any())
        result.append(
            Choice(
                waypoint=search.scenario.waypoints[i].name,
                branch=describe_flags(robot, signs[i]),
                turns=_turns(robot, chosen.positions[i]),
                branches=candidates.branches,
                solutions=len(candidates.q),
                sampled=candidates.redundant,
                reason="nearest to its near"
                if i in search.space.solutions
                else _reason(search, chosen, candidates, changed),
            )
        )
    return tuple(result)


def _reason(
    search: SolutionSearch, chosen: ChosenSequence, candidates: Candidates, changed: bool
) -> str:
    """Text of `Choice.reason`."""
    if len(candidates.q) == 1:
        return "the only solution"
    fast = int((candidates.unattainable + candidates.excess != 0.0).sum())
    asked = {
        "free": "",
        "keep": ", branch changed for the speeds" if changed else ", branch kept",
        "fixed": ", branch fixed",
    }.get(str(search.scenario.branch), ", branch as requested")
    if chosen.cost[CostLevel.INFEASIBLE] > 0.0:
        return f"smallest excess over the velocity limits{asked}"
    aim = "nearest to near" if search.near is not None else "least travel"
    if search.scenario.prefers_clearance:
        aim = "most clearance"
    elif candidates.redundant and search.robot.dof > 6 and search.near is None:
        aim = "minimum travel, away from limits and singularities"
    return f"{aim}{asked}" + (f"; {fast} too fast for the joints" if fast else "")


def _turns(robot: Robot, q: FloatArray) -> tuple[tuple[str, int], ...]:
    turns = np.round(q / (2 * np.pi)).astype(int)
    joints = zip(robot.joint_names, turns, robot.joint_units, strict=True)
    return tuple((name, int(turn)) for name, turn, unit in joints if turn and unit == "rad")


def find_infeasibilities(
    search: SolutionSearch, chosen: ChosenSequence
) -> tuple[Infeasibility, ...]:
    """Intervals and waypoints that exceed a velocity limit with every choice."""
    moves = np.abs(np.diff(chosen.positions, axis=0))
    places = [
        (i, i + 1, move / step.duration)
        for i, (move, step) in enumerate(zip(moves, search.steps, strict=True))
        if step.is_timed
    ]
    places += [
        (i, i, np.abs(chosen.velocities[i]))
        for i, candidates in enumerate(search.candidates)
        if candidates is not None and i not in search.free_velocity
    ]
    limit = search.robot.velocity_limit * OVERSPEED_FACTOR
    return tuple(_infeasibility(search, *place) for place in places if (place[2] > limit).any())


def _infeasibility(
    search: SolutionSearch, first: int, last: int, speed: FloatArray
) -> Infeasibility:
    """An interval in which joints are too fast, or a waypoint where first and last are equal.

    Args:
        search: The search.
        first: Index of the waypoint.
        last: Index of the waypoint where the interval ends.
        speed: Joint speeds [rad/s or m/s], shape (d,).
    """
    robot, times = search.robot, search.scenario.provisional_times
    names = [search.scenario.waypoints[i].name for i in (first, last)]
    limit = robot.velocity_limit
    units = [f"{unit}/s" for unit in robot.joint_units]
    excess = speed / limit
    order = np.argsort(-excess, kind="stable")
    fast = [int(j) for j in order if speed[j] > limit[j] * OVERSPEED_FACTOR]
    shown = search.scenario.units
    needs = ", ".join(
        f"{robot.joint_names[j]} needs {shown.text(float(speed[j]), units[j], '.4g')} "
        f"(limit {shown.shown(float(limit[j]), units[j])[0]:.4g})"
        for j in fast
    )
    worst, note = fast[0], _other_choices_text(search)
    if first < last:
        duration = search.steps[first].duration
        fact = f"from {names[0]!r} to {names[1]!r} {needs} on average; {note}"
        remedy = (
            f"{duration * excess[worst]:.4g} s or more is sufficient for the mean, and they have "
            f"{duration:.4g} s"
        )
    else:
        fact = f"at {names[0]!r} {needs} for the tool's velocity; {note}"
        remedy = f"{1.0 / excess[worst]:.3g} of that velocity is feasible"
    return Infeasibility(
        waypoint=names[0],
        until=names[1] if first < last else "",
        start=float(times[first]),
        end=float(times[last]),
        joint=robot.joint_names[worst],
        velocity=float(speed[worst]),
        limit=float(limit[worst]),
        unit=units[worst],
        fact=fact,
        remedy=remedy,
    )


def _other_choices_text(search: SolutionSearch) -> str:
    """Text about other choices of solutions."""
    if any(c is not None and c.redundant for c in search.candidates):
        return "no other candidate exceeds the limits by less"
    if search.scenario.branch != "free":
        return "no other solution in this branch exceeds the limits by less (try branch: free)"
    return "no other solution exceeds the limits by less"
