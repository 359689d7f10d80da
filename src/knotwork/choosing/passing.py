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

from knotwork.choosing.path_search import BUDGET, rounded
from knotwork.choosing.path_speeds import PathSpeeds, path_speeds
from knotwork.choosing.runs import Run, find_runs, timing_problem
from knotwork.choosing.task import FreeTask, knots_of
from knotwork.documents import Edits, Location, edited
from knotwork.errors import InputError
from knotwork.joint_space import joint_space
from knotwork.scenario import FreeTimes, Scenario, scenario_of
from knotwork.task_to_joint import TaskSolution, solve_task
from knotwork.timing import Binding, Objective
from knotwork.timing.budget import Watch
from knotwork.timing.solving import NoMotionError, solved

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
        stopped: Whether the budget ended before they were the best.
    """

    task: FreeTask
    solution: TaskSolution
    edits: dict[Location, Any]
    binding: tuple[Binding, ...] = ()
    stopped: bool = False


def at_greatest_speeds(
    scenario: Scenario,
    free: FreeTimes,
    solution: TaskSolution | None,
    watch: Watch,
    caps: Edits = MappingProxyType({}),
) -> Passing:
    """The task with the greatest speeds along its paths that the limits allow.

    Args:
        scenario: The task.
        free: What it leaves to be chosen.
        solution: Solutions of the poses, if not the best.
        watch: What knows of the budget.
        caps: Edits that bound some of the speeds.

    Raises:
        InputError: There are none, or the task can't be solved.
    """
    found = PathSpeeds()
    if free.path_speed:
        if caps:
            scenario = scenario_of(edited(free.document, caps))
        space = joint_space(scenario)
        waypoints = solve_task(scenario, space, knots_of(scenario)).waypoints
        task = FreeTask(scenario, scenario.free or free, space, waypoints)
        found = path_speeds(task, watch)
        scenario = scenario_of(edited(free.document, found.edits))
    space = joint_space(scenario)
    solution = solution or solve_task(scenario, space, knots_of(scenario))
    left = scenario.free or replace(free, path_speed={})
    task = FreeTask(scenario, left, space, solution.waypoints)
    return Passing(task, solution, found.edits, found.binding, found.stopped)


def at_lower_speeds(
    scenario: Scenario,
    free: FreeTimes,
    solution: TaskSolution | None,
    greatest: Passing,
    failed: Sequence[Run],
    watch: Watch,
) -> Passing | None:
    """The task with lower speeds along those paths that meet runs without a motion.

    They take up to half of the budget that is left.

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

    def passing(part: float, watch: Watch) -> tuple[float, Passing] | None:
        """The task at parts of the speeds, and how long these paths and runs take together [s]."""
        caps: Edits = {key: {"at_most": rounded(part * speed)} for key, speed in speeds.items()}
        try:
            made = at_greatest_speeds(scenario, free, solution, watch, caps)
            runs = [one for one in find_runs(made.task) if beside & {*one.waypoints}]
            problems = [timing_problem(made.task, run, Objective()) for run in runs]
            watch = watch.within(1.0, sum(len(run.waypoints) - 1 for run in runs))
            motions = [solved(problem, watch) for problem in problems]
        except (InputError, NoMotionError):
            return None
        taken = sum(motion.duration for motion in motions)
        taken += sum(made.task.scenario.paths[k].motion.timing.duration for k in numbers)
        stopped = made.stopped or any(motion.status == "stopped" for motion in motions)
        return taken, replace(made, stopped=stopped)

    shared = watch.within(0.5)
    best = passing(LEAST, shared.within(1.0 / (1 + len(PARTS)))) if places else None
    if best is None:
        return None
    before, stopped = math.inf, False
    for part in PARTS:
        if stopped := shared.late(found=True):
            break
        made = passing(part, shared.within(1.0))
        if made is not None:
            stopped |= made[1].stopped
            if made[0] > before:
                break
            before = made[0]
            best = min(best, made, key=lambda one: one[0])
    stopped |= best[1].stopped
    lowered = BUDGET.quantity if stopped else BESIDE
    binding = tuple(
        replace(one, quantity=lowered) if one.quantity == "at_most" else one
        for one in best[1].binding
    )
    return replace(best[1], binding=binding, stopped=stopped)
