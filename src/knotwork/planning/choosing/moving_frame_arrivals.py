"""Arrival times at moving frames, by fixed-point iteration.

The poses depend on the arrival times, and the minimum times depend on the poses. Each iteration
chooses minimum times with the frames at their expected times. The results are the expected times of
the next iteration, until both agree. If the arm is faster than the frames, the iteration is a
contraction. Otherwise it may not converge, which is an error after `MAX_ARRIVAL_ROUNDS`. The times
are then made slightly longer and fixed.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import FollowingError, InputError, OutOfReachError, TimingError
from knotwork.planning.choosing.chosen_values import ChosenValues, choose_values
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.timing.budget import Budget
from knotwork.task import ExpandedTask
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.resolve import change_task
from knotwork.task.scenario.unknowns_reader import ends_wait
from knotwork.units import rounded_up

MAX_ARRIVAL_ROUNDS = 20
"""Maximum number of iterations."""

FULL_STEPS = 5
"""Number of iterations with full steps and a new choice of solutions.

After that, solutions are kept and steps are halved. Otherwise the times may alternate, because a
redundant arm may reach a later pose sooner, or with another solution.
"""

AGREEMENT = 1e-3
"""Tolerance of agreement [s]."""

LONGER_TIMES = 1.002
"""Factor on the minimum times; `AGREEMENT` is added as well."""

GUESSES = (1.0, 0.5, 2.0, 0.25, 4.0)
"""Expected times to the first moving frame that are tried in this order [s]."""


def fix_arrival_times(scenario: Scenario, budget: Budget) -> Scenario:
    """Fix times and speeds up to the last moving frame as numbers.

    Args:
        scenario: A scenario with unknown times before poses in moving frames, or before a time
            since 0.
        budget: Computing time and progress of each iteration.

    Raises:
        InputError: A given time is too early, or the iteration does not converge.
    """
    scenario = _with_speeds_before(scenario, budget)
    if not (scenario.unknowns and scenario.unknowns.time_dependent):
        return scenario
    scenario, chosen_values = _first_choice(scenario, _guesses(scenario), budget)
    for count in range(MAX_ARRIVAL_ROUNDS):
        expected = scenario.expected_times
        times = _times(scenario, chosen_values)
        arrivals = list(scenario.required_unknowns.time_dependent)
        if np.abs(times - expected)[arrivals].max() <= AGREEMENT:
            return _with_numbers(scenario, chosen_values)
        task = scenario.task.with_waypoints(_speeds(scenario, chosen_values))
        if count == FULL_STEPS:
            task = task.with_waypoints(_solutions(scenario, chosen_values))
        following = times if count < FULL_STEPS else 0.5 * (expected + times)
        # a wait is two waypoints, of which the first remains
        by_task_index = dict(zip(scenario.task_index[::-1], following[::-1].tolist(), strict=True))
        scenario = _with_fewer_unknowns(scenario, task, by_task_index)
        if not (scenario.unknowns and scenario.unknowns.time_dependent):
            return scenario
        chosen_values = _choose(scenario, budget)
    i = max(arrivals, key=lambda k: abs(times[k] - expected[k]))
    raise TimingError(
        f"{scenario.waypoints[i].name!r} is in a moving frame: after {MAX_ARRIVAL_ROUNDS} "
        f"iterations it is reached at {times[i]:.6g} s where it is at {expected[i]:.6g} s; "
        "accepted: time or after [s] here and at the waypoints before",
        cause="rounds",
        where=scenario.where("waypoints", scenario.task_index[i]),
    )


def _choose(scenario: Scenario, budget: Budget) -> ChosenValues:
    """Minimum times for the best solutions of the poses at the expected times."""
    return choose_values(SolvedScenario.solve(scenario), budget)


def _first_choice(
    scenario: Scenario, guesses: Sequence[Mapping[int, float]], budget: Budget
) -> tuple[Scenario, ChosenValues]:
    """The scenario with the first expected times that have a solution, and the choice with them.

    Args:
        scenario: The scenario.
        guesses: Expected times of waypoints [s], by index in the task.
        budget: Computing time and progress.

    Raises:
        InputError: There is no solution for any guess; the error is that for the first one.
    """
    guess, *others = guesses
    try:
        guessed = change_task(scenario, scenario.task, guess)
        return guessed, _choose(guessed, budget)
    except (OutOfReachError, FollowingError) as error:
        if others:
            with suppress(OutOfReachError, FollowingError):
                return _first_choice(scenario, others, budget)
        error.hint = (
            "frames are taken at their expected times: after: {fastest: true, "
            "at_least: seconds} delays the arrival until they are in reach"
        )
        raise


def _guesses(scenario: Scenario) -> list[dict[int, float]]:
    """Expected times of the first moving frame to try [s], by index in the task."""
    unknowns = scenario.required_unknowns
    first = unknowns.time_dependent[0]
    task_i = scenario.task_index[first]
    if (
        scenario.task.waypoints[task_i].time is not None
        or not unknowns.at_waypoints[first].duration_is_unknown
    ):
        return [{}]
    start = scenario.expected_times[first - 1]
    spans = dict.fromkeys(max(span, unknowns.at_waypoints[first].min_duration) for span in GUESSES)
    return [{task_i: start + span} for span in spans]


def _with_speeds_before(scenario: Scenario, budget: Budget) -> Scenario:
    """The scenario with speeds of paths before the first moving frame, which decide its time.

    They are those of the motion before, planned alone if it is a complete task.
    """
    unknowns, task = scenario.required_unknowns, scenario.task
    first = unknowns.time_dependent[0]
    if not any(waypoint.path_speed_is_unknown for waypoint in unknowns.at_waypoints[:first]):
        return scenario
    try:
        part = task.replace(waypoints=task.waypoints[: scenario.task_index[first]])
        chosen_values = _choose(change_task(scenario, part), budget)
    except InputError:
        return scenario
    return _with_fewer_unknowns(scenario, task.with_waypoints(_speeds(scenario, chosen_values)))


def _speeds(scenario: Scenario, chosen_values: ChosenValues) -> dict[int, Any]:
    """Chosen speeds along paths up to the last moving frame, for the task."""
    unknowns, timed = scenario.required_unknowns, chosen_values.scenario.task.waypoints
    until = unknowns.at_waypoints[: unknowns.time_dependent[-1] + 1]
    ends = [scenario.task_index[i] for i, end in enumerate(until) if end.path_speed_is_unknown]
    # a part of the task has its first waypoints only
    return {
        task_i: {"speed": timed[task_i].speed}  # type: ignore[union-attr]  # it ends a path
        for task_i in ends
        if task_i < len(timed)
    }


def _solutions(scenario: Scenario, chosen_values: ChosenValues) -> dict[int, Any]:
    """Chosen solutions of the poses up to the last moving frame, for the task."""
    timed = chosen_values.scenario.task.waypoints
    reached = scenario.task_index[1 : scenario.required_unknowns.time_dependent[-1] + 1]
    near = {task_i: getattr(timed[task_i], "near", None) for task_i in reached}
    return {task_i: {"near": values} for task_i, values in near.items() if values}


def _times(scenario: Scenario, chosen_values: ChosenValues) -> FloatArray:
    """Times of the waypoints in a minimum-time motion [s], shape (n,).

    Raises:
        InputError: A waypoint is reached later than its given time.
    """
    times = np.array(chosen_values.scenario.times)
    for i in scenario.required_unknowns.time_dependent:
        task_i = scenario.task_index[i]
        time = scenario.task.waypoints[task_i].time
        if time is None or ends_wait(scenario.task_index, i):
            continue
        if times[i] > time:
            with scenario.locations.errors_at("waypoints", task_i, "time"):
                raise InputError(
                    f"{scenario.waypoints[i].name!r} is reached at "
                    f"{rounded_up(float(times[i])):.6g} s at the earliest that was found, "
                    f"not at {time:g} s; accepted: a later time, or after: fastest"
                )
        times[i:] += time - times[i]
    return times


def _with_numbers(scenario: Scenario, chosen_values: ChosenValues) -> Scenario:
    """The scenario with numbers for its unknowns up to the last moving frame."""
    unknowns, task = scenario.required_unknowns, scenario.task
    last, spans = unknowns.time_dependent[-1], np.diff(chosen_values.scenario.times)
    changes: defaultdict[int, dict[str, Any]] = defaultdict(dict)
    changes.update(_speeds(scenario, chosen_values))
    for i in range(1, last + 1):
        waypoint = unknowns.at_waypoints[i]
        task_i = scenario.task_index[i]
        if waypoint.duration_is_unknown and task.waypoints[task_i].time is None:
            span = float(spans[i - 1])
            is_at_bound = waypoint.min_duration > span - AGREEMENT
            after = span if is_at_bound else LONGER_TIMES * span + AGREEMENT
            changes[task_i]["after"] = rounded_up(after, 6)
    task = task.with_waypoints(changes).with_waypoints(_solutions(scenario, chosen_values))
    return _with_fewer_unknowns(scenario, task)


def _with_fewer_unknowns(
    scenario: Scenario, task: ExpandedTask, expected: Mapping[int, float] | None = None
) -> Scenario:
    """The scenario with a task with fewer unknowns; its knots stay unknown.

    Other arguments as for `change_task`.
    """
    timed = change_task(scenario, task.replace(objective=None), expected)
    if np.isnan(timed.durations).any():
        return change_task(scenario, task, expected)
    unknowns = scenario.required_unknowns
    if not unknowns.knots_are_unknown:
        return timed
    # minimum jerk would continue end accelerations
    terms = {name: value for name, value in unknowns.objective if value and name != "time"}
    objective = terms or {"acceleration": 1.0}
    return change_task(scenario, task.replace(knots="optimal", objective=objective), expected)
