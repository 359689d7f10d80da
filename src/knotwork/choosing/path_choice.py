"""`TimedPaths`: a task with maximum speeds along its tool paths."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from knotwork.choosing.limit_shares import Limit
from knotwork.choosing.path_errors import no_speeds
from knotwork.choosing.path_speeds import (
    AT_MOST,
    NEXT,
    NoSpeedsError,
    PathSpeeds,
    rounded,
)
from knotwork.choosing.task import FreeTask, knots_of
from knotwork.scenario import FreeTimes, Scenario, ScenarioPath, resolved
from knotwork.scenario.joint_space import joint_space
from knotwork.task import Task
from knotwork.task_to_joint import TaskSolution, solve_task
from knotwork.timing import Binding


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
    """Choose the free speeds along tool paths.

    Args:
        scenario: The task.
        free: Its unknowns.
        solution: Solutions of the poses, if not the best.
        caps: Upper bounds of some of the speeds [m/s], by the waypoint.

    Raises:
        InputError: No speeds are feasible, or the task can't be solved.
    """
    space = joint_space(scenario)
    paths = [path for path in scenario.paths if path.asked.at_most]
    if not paths:
        solution = solution or solve_task(scenario, space, knots_of(scenario))
        return TimedPaths(FreeTask(scenario, free, space, solution))
    task = FreeTask(scenario, free, space, solve_task(scenario, space, knots_of(scenario)))
    found = TimedPaths(task)
    for path in paths:
        places = [path.first + 1 + k for k in range(len(path.stretches))]
        most = {k: min(one, caps.get(places[k], one)) for k, one in path.asked.at_most.items()}
        problem = PathSpeeds(task, path, most)
        try:
            chosen = problem.greatest()
        except NoSpeedsError as error:
            raise no_speeds(task, problem, error) from None
        limits = {
            k: NEXT if places[k] in caps and one == AT_MOST else one
            for k, one in chosen.limits.items()
        }
        found = replace(
            found,
            speeds=found.speeds | {places[k]: speed for k, speed in chosen.speeds.items()},
            binding=(*found.binding, *_binding(task, path, limits)),
        )
    scenario = resolved(_with_speeds(task, found.speeds), scenario.places)
    space = joint_space(scenario)
    solution = solution or solve_task(scenario, space, knots_of(scenario))
    left = scenario.free or replace(free, path_speed={})
    return replace(found, task=FreeTask(scenario, left, space, solution))


def _binding(task: FreeTask, path: ScenarioPath, limits: Mapping[int, Limit]) -> Iterator[Binding]:
    names = [waypoint.name for waypoint in task.scenario.waypoints[path.first : path.last + 1]]
    for k, limit in limits.items():
        yield Binding(names[k], names[k + 1], limit.name, limit.quantity, None)


def _with_speeds(task: FreeTask, speeds: Mapping[int, float]) -> Task:
    """The task with these speeds along its paths [m/s]."""
    scenario, unit = task.scenario, task.scenario.shown_length[0]
    asked = scenario.task.with_waypoints(
        {scenario.index[i]: {"speed": rounded(unit * speed)} for i, speed in speeds.items()}
    )
    # with these speeds every waypoint has a time
    return asked if task.free.duration.any() else asked.replace(times=None)
