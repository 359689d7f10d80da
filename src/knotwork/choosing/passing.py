"""Speeds along tool paths that leave the arm in a state from which it can go on.

The greatest speed along a path may bring a joint to its limit just where the path ends, and nothing
can slow it down at once. Then lower speeds along that path are taken: those with which the whole
takes least time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from knotwork.choosing.path_search import rounded
from knotwork.choosing.path_speeds import path_speeds
from knotwork.choosing.runs import Run, find_runs, timing_problem
from knotwork.choosing.task import FreeTask, knots_of
from knotwork.documents import Edits, Location, edited
from knotwork.errors import InputError
from knotwork.joint_space import joint_space
from knotwork.scenario import FreeTimes, Scenario, scenario_of
from knotwork.task_to_joint import TaskSolution, solve_task
from knotwork.timing import Binding, Objective
from knotwork.timing.solving import NoMotionError, solved
from knotwork.timing.watch import Watch

LEAST = 0.1
"""The part of the greatest speeds that is tried first: if it does not do, they do not hinder."""

PARTS = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2)
"""Those tried then, until the whole takes longer again."""

BESIDE = "the motion before or after"
"""What bounds such a speed."""


@dataclass(frozen=True, eq=False)
class Passing:
    """A task whose speeds along tool paths are chosen.

    Attributes:
        task: The task with these speeds; durations and the like are still to be chosen.
        solution: Solutions of its poses.
        edits: What gives its document the speeds.
        binding: What bounds each of them.
    """

    task: FreeTask
    solution: TaskSolution
    edits: dict[Location, Any]
    binding: tuple[Binding, ...] = ()


def at_greatest_speeds(
    scenario: Scenario,
    free: FreeTimes,
    solution: TaskSolution | None,
    caps: Edits = MappingProxyType({}),
) -> Passing:
    """The task with the greatest speeds along its paths that the limits allow.

    Args:
        scenario: The task.
        free: What it leaves to be chosen.
        solution: Solutions of the poses, if not the best.
        caps: Edits that bound some of the speeds.

    Raises:
        InputError: There are none, or the task can't be solved.
    """
    edits: dict[Location, Any] = {}
    binding: list[Binding] = []
    if free.path_speed:
        if caps:
            scenario = scenario_of(edited(free.document, caps))
        space = joint_space(scenario)
        waypoints = solve_task(scenario, space, knots_of(scenario)).waypoints
        edits, binding = path_speeds(FreeTask(scenario, scenario.free or free, space, waypoints))
        scenario = scenario_of(edited(free.document, edits))
    space = joint_space(scenario)
    solution = solution or solve_task(scenario, space, knots_of(scenario))
    left = scenario.free or replace(free, path_speed={})
    return Passing(
        FreeTask(scenario, left, space, solution.waypoints), solution, edits, (*binding,)
    )


def at_lower_speeds(
    scenario: Scenario,
    free: FreeTimes,
    solution: TaskSolution | None,
    greatest: Passing,
    failed: Sequence[Run],
    watch: Watch,
) -> Passing | None:
    """The task with lower speeds along those paths that meet runs without a motion.

    Args:
        scenario: The task.
        free: What it leaves to be chosen.
        solution: Solutions of the poses, if not the best.
        greatest: The task with the greatest speeds.
        failed: The runs for which no motion was found.
        watch: What knows of the budget.

    Returns:
        The task, or `None` where no lower speeds help.
    """
    ends = {i for run in failed for i in (run.waypoints[0], run.waypoints[-1])}
    numbers = [k for k, one in enumerate(scenario.paths) if ends & {one.first, one.last}]
    paths = [scenario.paths[k] for k in numbers]
    beside = {i for one in paths for i in (one.first, one.last)}
    stretches = {free.index[i] for one in paths for i in range(one.first + 1, one.last + 1)}
    places = stretches & set(free.path_speed)
    speeds = {("waypoints", i, "speed"): greatest.edits["waypoints", i, "speed"] for i in places}

    def passing(part: float) -> tuple[float, Passing] | None:
        """The task at parts of the speeds, and how long these paths and runs take together [s]."""
        caps: Edits = {key: {"at_most": rounded(part * speed)} for key, speed in speeds.items()}
        try:
            made = at_greatest_speeds(scenario, free, solution, caps)
            runs = [one for one in find_runs(made.task) if beside & {*one.waypoints}]
            problems = [timing_problem(made.task, run, Objective()) for run in runs]
            taken = sum(solved(problem, Watch()).duration for problem in problems)
        except (InputError, NoMotionError):
            return None
        taken += sum(made.task.scenario.paths[k].motion.timing.duration for k in numbers)
        return taken, replace(made, binding=tuple(_beside(one) for one in made.binding))

    best = passing(LEAST) if places else None
    if best is None:
        return None
    before = math.inf
    for part in PARTS:
        made = None if watch.late(found=False) else passing(part)
        if made is not None:
            if made[0] > before:
                break
            before = made[0]
            best = min(best, made, key=lambda one: one[0])
    return best[1]


def _beside(binding: Binding) -> Binding:
    """What bounds a speed that was lowered for what comes before or after."""
    return replace(binding, quantity=BESIDE) if binding.quantity == "at_most" else binding
