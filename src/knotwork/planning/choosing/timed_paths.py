"""`TimedPaths`: a task with maximum speeds along its tool paths."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from knotwork.errors import FollowingError, PathError
from knotwork.planning.choosing.chosen_values import solutions_near
from knotwork.planning.choosing.free_task import FreeTask, knots_of
from knotwork.planning.choosing.limit_shares import Limit
from knotwork.planning.choosing.path_speeds import (
    NoSpeedsError,
    PathSpeeds,
    SpeedBound,
    round_speed,
)
from knotwork.planning.choosing.speed_errors import no_speeds
from knotwork.planning.task_to_joint import TaskSolution, solve_task
from knotwork.planning.timing import Binding
from knotwork.scenario import FreeTimes, Scenario, resolve_task
from knotwork.scenario.joint_space import joint_space

MAX_PLANS = 8
"""Largest number of planned motions."""


@dataclass(frozen=True, eq=False)
class TimedPaths:
    """A task with chosen speeds along tool paths.

    Attributes:
        task: The task with these speeds; durations and other unknowns are still to be chosen.
        speeds: These speeds [m/s], by the waypoints at the ends of their stretches.
        binding: Limiting constraint of each.
    """

    task: FreeTask
    speeds: dict[int, float] = field(default_factory=dict)
    binding: tuple[Binding, ...] = ()


def with_greatest_speeds(
    scenario: Scenario,
    free: FreeTimes,
    solution: TaskSolution | None,
    caps: Mapping[int, float] = MappingProxyType({}),
) -> TimedPaths:
    """Choose the free speeds along tool paths such that a planned motion keeps the limits.

    Args:
        scenario: The task.
        free: Its unknowns.
        solution: Solutions of the poses, if not the best.
        caps: Upper bounds of some of the speeds [m/s], by the waypoint.

    Raises:
        InputError: No speeds are feasible, or the task can't be solved.
    """
    space = joint_space(scenario)
    if not free.path_speed:
        solution = solution or solve_task(scenario, space, knots_of(scenario))
        return TimedPaths(FreeTask(scenario, free, space, solution))
    if solution is not None:
        near = solutions_near(FreeTask(scenario, free, space, solution))
        scenario = resolve_task(scenario.task.with_waypoints(near), scenario.places)
    task = FreeTask(scenario, free, space, solve_task(scenario, space, knots_of(scenario)))
    problems = {}
    for number, path in enumerate(scenario.paths):
        if path.asked.at_most:
            bounds = {
                k: (caps[path.first + 1 + k], SpeedBound.NEIGHBOURS)
                if caps.get(path.first + 1 + k, most) < most
                else (most, SpeedBound.AT_MOST)
                for k, most in path.asked.at_most.items()
            }
            problems[number] = PathSpeeds(task, path, bounds)
    try:
        return _fastest(task, problems)
    except NoSpeedsError as error:
        raise no_speeds(task, error) from None


def _fastest(task: FreeTask, problems: Mapping[int, PathSpeeds]) -> TimedPaths:
    """The fastest of some planned motions along the paths that keep the limits.

    Each one corrects the expectation of the next, until each speed has a limiting constraint.

    Raises:
        NoSpeedsError: No speeds are feasible.
    """
    best: TimedPaths | None = None
    least, speeds, before = math.inf, dict[int, float](), dict[int, float]()
    failed: NoSpeedsError | None = None
    for _ in range(MAX_PLANS):
        try:
            for problem in problems.values():
                chosen = problem.choose()
                speeds |= {problem.path.first + 1 + k: speed for k, speed in chosen.items()}
        except NoSpeedsError as error:
            failed = error
            break
        if speeds == before:
            break
        before = dict(speeds)
        try:
            timed = _with_speeds(task, speeds)
        except (PathError, FollowingError):
            for problem in problems.values():
                problem.lower_caps()
            continue
        paths = {number: timed.scenario.paths[number] for number in problems}
        excess = [problem.verify(timed, paths[number]) for number, problem in problems.items()]
        failed = next((error for error in excess if error), None)
        if failed is not None:
            continue
        limits = {
            problem.path.first + 1 + k: problem.limiting_constraint(k)
            for problem in problems.values()
            for k in problem.speeds
        }
        duration = sum(path.motion.timing.duration for path in paths.values())
        if duration < least:
            least, best = duration, TimedPaths(timed, before, tuple(_bindings(task, limits)))
        if None not in limits.values():
            break
    if best is None:
        raise failed or NoSpeedsError(task.scenario.paths[0], 0, SpeedBound.TOLERANCES)
    return best


def _with_speeds(task: FreeTask, speeds: Mapping[int, float]) -> FreeTask:
    """The task with these speeds along its paths [m/s], solved."""
    scenario, unit = task.scenario, task.scenario.shown_length[0]
    changed = scenario.task.with_waypoints(
        {scenario.index[i]: {"speed": round_speed(unit * speed)} for i, speed in speeds.items()}
    )
    if not task.free.duration.any():  # with these speeds every waypoint has a time
        changed = changed.replace(times=None)
    scenario = resolve_task(changed, scenario.places)
    space, free = joint_space(scenario), scenario.free or replace(task.free, path_speed={})
    return FreeTask(scenario, free, space, solve_task(scenario, space, knots_of(scenario)))


def _bindings(task: FreeTask, limits: Mapping[int, Limit | SpeedBound | None]) -> Iterator[Binding]:
    """Limiting constraints by the waypoints at the ends of stretches."""
    names = [waypoint.name for waypoint in task.scenario.waypoints]
    for i, limit in limits.items():
        joint, quantity = limit[:2] if isinstance(limit, Limit) else ("", limit or SpeedBound.RAMPS)
        yield Binding(names[i - 1], names[i], joint, str(quantity), None)
