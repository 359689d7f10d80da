"""Explain the chosen solutions, and the velocity limits that no choice can keep."""

from __future__ import annotations

import numpy as np

from knotwork.kinematics.geometry.configuration_flags import configuration_flags, describe_flags
from knotwork.kinematics.sequence.candidates import Candidates
from knotwork.kinematics.sequence.step_costs import AT_LIMIT
from knotwork.robot import Robot
from knotwork.task_to_joint.search import ChosenSequence, Search
from knotwork.task_to_joint.solution import Choice, Infeasibility
from knotwork.waypoints import FloatArray


def describe_choices(search: Search, found: ChosenSequence) -> tuple[Choice, ...]:
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


def _reason(search: Search, found: ChosenSequence, candidates: Candidates, changed: bool) -> str:
    """Text of `Choice.reason`."""
    if len(candidates.q) == 1:
        return "the only solution"
    fast = int((candidates.lost + candidates.excess != 0.0).sum())
    asked = {
        "free": "",
        "keep": ", branch changed for the speeds" if changed else ", branch kept",
        "fixed": ", branch fixed",
    }.get(str(search.scenario.branch), ", branch as asked")
    if found.sequence.cost.infeasible > 0.0:
        return f"smallest excess over the velocity limits{asked}"
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


def find_infeasibilities(search: Search, found: ChosenSequence) -> tuple[Infeasibility, ...]:
    """Intervals and waypoints that exceed a velocity limit with every choice."""
    limit, durations = search.robot.velocity_limit, search.durations
    mean = np.abs(np.diff(found.positions, axis=0)) / durations[:, None]
    if search.rules.untimed is not None:
        mean[search.rules.untimed] = 0.0
    at = np.abs(found.velocities)
    at[[c is None or i in search.free_velocity for i, c in enumerate(search.candidates)]] = 0.0
    places = [(i, i + 1, v) for i, v in enumerate(mean)] + [(i, i, v) for i, v in enumerate(at)]
    exceeded = [place for place in places if (place[2] > limit * AT_LIMIT).any()]
    if not exceeded:
        return ()
    others = _other_choices_text(search)
    return tuple(_infeasibility(search, *place, others) for place in exceeded)


def _infeasibility(
    search: Search, first: int, last: int, speed: FloatArray, others: str
) -> Infeasibility:
    """An interval in which joints are too fast, or a waypoint where first and last are equal.

    Args:
        search: The search.
        first: Index of the waypoint.
        last: Index of the waypoint where the interval ends.
        speed: Joint speeds [rad/s or m/s], shape (d,).
        others: Text about other choices.
    """
    robot, times = search.robot, search.scenario.provisional_times
    names = [search.scenario.waypoints[i].name for i in (first, last)]
    limit = robot.velocity_limit
    units = [f"{unit}/s" for unit in robot.joint_units]
    excess = speed / limit
    order = np.argsort(-excess, kind="stable")
    fast = [int(j) for j in order if speed[j] > limit[j] * AT_LIMIT]
    shown = search.scenario.units
    needs = ", ".join(
        f"{robot.joint_names[j]} needs {shown.text(float(speed[j]), units[j], '.4g')} "
        f"(limit {shown.shown(float(limit[j]), units[j])[0]:.4g})"
        for j in fast
    )
    worst = fast[0]
    if first < last:
        duration = float(search.durations[first])
        sentence = (
            f"from {names[0]!r} to {names[1]!r} {needs} on average; {others}; "
            f"{duration * excess[worst]:.4g} s or more is sufficient for the mean, and they have "
            f"{duration:.4g} s"
        )
    else:
        sentence = (
            f"at {names[0]!r} {needs} for the tool's velocity; {others}; "
            f"{1.0 / excess[worst]:.3g} of that velocity is feasible"
        )
    return Infeasibility(
        waypoint=names[0],
        until=names[1] if first < last else "",
        start=float(times[first]),
        end=float(times[last]),
        joint=robot.joint_names[worst],
        velocity=float(speed[worst]),
        limit=float(limit[worst]),
        unit=units[worst],
        sentence=sentence,
    )


def _other_choices_text(search: Search) -> str:
    """Text about other choices of solutions."""
    asked = search.scenario.branch != "free"
    if asked and search.feasible_if_free():
        return "another branch is feasible (branch: free)"
    if any(c is not None and c.free for c in search.candidates):
        return "no other solution tried exceeds the limits by less"
    return f"no other solution{' in this branch' if asked else ''} exceeds the limits by less"
