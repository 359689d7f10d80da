"""Maximum speeds along the tool paths of a task, and errors of given speeds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from operator import itemgetter

import numpy as np

from knotwork.errors import FollowingError, InputError, PathError
from knotwork.planning.choosing.chosen_values import solutions_near
from knotwork.planning.choosing.path_limit_utilisation import Limit, LimitUtilisation
from knotwork.planning.choosing.path_speed_problem import (
    ADJACENT_MOTION,
    AT_MOST,
    NOTHING,
    RAMPS,
    TOLERANCES,
    NoSpeedsError,
    PathSpeedProblem,
    round_speed,
)
from knotwork.planning.choosing.segments import TimingTask
from knotwork.planning.task_to_joint import TaskSolution, knots_of, solve_task
from knotwork.planning.timing import Binding
from knotwork.task.scenario import Scenario, ScenarioPath, Unknowns, resolve_task
from knotwork.task.scenario.joint_space import joint_space
from knotwork.units import rounded_up

MAX_PLANS = 4
"""Maximum number of planned motions; in most cases one or two are sufficient."""

CORRECTED_PLANS = 3
"""Number of planned motions after which speeds are lowered."""

MIN_GAIN = 0.01
"""Minimum gain of duration for which a motion is planned again, as a fraction."""

LIMIT_ROUNDING = 1e-9
"""Tolerance of limits, as a fraction."""


@dataclass(frozen=True, eq=False)
class ChosenPathSpeeds:
    """A task with chosen speeds along tool paths.

    Attributes:
        task: The task with these speeds; its other unknowns are still to be chosen.
        speeds: These speeds [m/s], by the waypoints at the ends of their stretches.
        binding: Limiting constraint of each.
    """

    task: TimingTask
    speeds: dict[int, float] = field(default_factory=dict)
    binding: tuple[Binding, ...] = ()


def with_max_speeds(
    scenario: Scenario, solution: TaskSolution | None, caps: Mapping[int, float]
) -> ChosenPathSpeeds:
    """Choose the free speeds along tool paths such that a planned motion keeps the limits.

    Args:
        scenario: A task with unknowns.
        solution: Solutions of the poses, if not the best.
        caps: Upper bounds of some of the speeds [m/s], by the waypoint.

    Raises:
        InputError: No speeds are feasible, or the task can't be solved.
    """
    unknowns = scenario.required_unknowns
    task = _solved_task(scenario, unknowns, solution)
    if not unknowns.path_speed:
        return ChosenPathSpeeds(task)
    if solution is not None:
        changed = scenario.given.with_waypoints(solutions_near(task))
        task = _solved_task(resolve_task(changed, scenario.locations), unknowns)
    problems = {}
    for number, path in enumerate(task.scenario.paths):
        if path.requested.at_most:
            bounds = {
                stretch: min(
                    (max_speed, AT_MOST),
                    (caps.get(path.first + 1 + stretch, math.inf), ADJACENT_MOTION),
                    key=itemgetter(0),
                )
                for stretch, max_speed in path.requested.at_most.items()
            }
            problems[number] = PathSpeedProblem(task, path, bounds)
    try:
        return _fastest_feasible_paths(task, problems)
    except NoSpeedsError as error:
        raise _infeasible_speed_error(task, error) from None


def _fastest_feasible_paths(
    task: TimingTask, problems: Mapping[int, PathSpeedProblem]
) -> ChosenPathSpeeds:
    """The fastest planned motion along the paths that keeps the limits.

    Each motion corrects the expectation for the next one. Where that is not sufficient, speeds are
    lowered.

    Raises:
        NoSpeedsError: No speeds are feasible.
    """
    best: ChosenPathSpeeds | None = None
    min_duration = math.inf
    failed: NoSpeedsError | None = None
    slower: dict[PathSpeedProblem, Limit] = {}
    for attempt in range(MAX_PLANS):
        try:
            for problem, bound in slower.items():
                problem.lower_caps(bound)
            duration = sum(problem.choose() for problem in problems.values())
        except NoSpeedsError as error:
            failed = error
            break
        if duration > (1.0 - MIN_GAIN) * min_duration:
            break
        try:
            timed = _with_speeds(task, problems.values())
        except (PathError, FollowingError):
            slower = dict.fromkeys(problems.values(), TOLERANCES)
            continue
        excess = {
            problem: problem.correct_from_plan(timed, timed.scenario.paths[number])
            for number, problem in problems.items()
        }
        missed = {problem: error for problem, error in excess.items() if error}
        failed = next(iter(missed.values()), None)
        if failed is None:
            min_duration, best = duration, _chosen_path_speeds(timed, problems.values())
        is_corrected = attempt + 1 >= CORRECTED_PLANS
        slower = {problem: error.limit for problem, error in missed.items()} if is_corrected else {}
    if best is None:
        raise failed or NoSpeedsError(task.scenario.paths[0], 0, TOLERANCES)
    return best


def _with_speeds(task: TimingTask, problems: Iterable[PathSpeedProblem]) -> TimingTask:
    """The task with the chosen speeds along its paths, solved."""
    scenario, unit = task.scenario, task.scenario.shown_length[0]
    changed = scenario.given.with_waypoints(
        {
            scenario.task_index[problem.path.first + 1 + stretch]: {
                "speed": round_speed(unit * speed)
            }
            for problem in problems
            for stretch, speed in problem.speeds.items()
        }
    )
    scenario = resolve_task(changed, scenario.locations)
    return _solved_task(scenario, scenario.unknowns or replace(task.unknowns, path_speed={}))


def _solved_task(
    scenario: Scenario, unknowns: Unknowns, solution: TaskSolution | None = None
) -> TimingTask:
    """A scenario with its joints, and its poses solved, if no solution is given."""
    space = joint_space(scenario)
    solution = solution or solve_task(scenario, space, knots_of(scenario))
    return TimingTask(scenario, unknowns, space, solution)


def _chosen_path_speeds(task: TimingTask, problems: Iterable[PathSpeedProblem]) -> ChosenPathSpeeds:
    """A task with the chosen speeds along its paths, and their limiting constraints."""
    names = [waypoint.name for waypoint in task.scenario.waypoints]
    speeds, binding = {}, []
    for problem in problems:
        for stretch, speed in problem.speeds.items():
            end, limit = problem.path.first + 1 + stretch, problem.limiting[stretch]
            speeds[end] = speed
            binding.append(Binding(names[end - 1], names[end], limit.joint, limit.quantity, None))
    return ChosenPathSpeeds(task, speeds, tuple(binding))


def paths_beyond_limits(paths: ChosenPathSpeeds) -> list[InputError]:
    """Errors for given speeds that exceed a limit along a path.

    Args:
        paths: The task; given speeds on its paths with a chosen one are feasible.
    """
    task, errors = paths.task, list[InputError]()
    for path in task.scenario.paths:
        if any(end in paths.speeds for end in range(path.first + 1, path.last + 1)):
            continue
        limits = LimitUtilisation(task, path)
        utilisations = limits.of_motion(task, path).max(axis=1)
        for stretch in np.flatnonzero((utilisations > 1.0 + LIMIT_ROUNDING).any(axis=1)).tolist():
            limit = limits.limits[int(utilisations[stretch].argmax())]
            worst = float(utilisations[stretch].max())
            errors.append(_path_error(task, path, stretch, limit, worst))
    return errors


def _infeasible_speed_error(task: TimingTask, error: NoSpeedsError) -> InputError:
    """The error for a path without feasible speeds, with accepted changes."""
    path, stretch, limit = error.path, error.stretch, error.limit
    if limit == NOTHING:
        return InputError(
            "nothing bounds the speed along it; accepted: speed: {at_most: a speed}, or limits",
            where=task.where(path.first + 1 + stretch, "speed"),
        )
    return _path_error(task, path, stretch, limit)


def _path_error(
    task: TimingTask,
    path: ScenarioPath,
    stretch: int,
    limit: Limit,
    utilisation: float | None = None,
) -> InputError:
    """The error for a stretch of a path that exceeds a limit.

    Args:
        task: The task.
        path: The path.
        stretch: Its index along the path.
        limit: The exceeded limit.
        utilisation: Utilisation of the limit, if known.
    """
    scenario, waypoint = task.scenario, path.first + 1 + stretch
    start, end = (scenario.waypoints[i].name for i in (waypoint - 1, waypoint))
    requested, text = path.requested, scenario.units.text
    chosen, duration = stretch in requested.at_most, requested.durations[stretch]
    given = requested.speeds[stretch] or path.stretches[stretch].speed
    if requested.at_most and duration:  # the stretches still have the nominal speed
        given = requested.lengths[stretch] / duration
    speed = "no speed keeps the limits" if chosen else f"at {text(given, 'm/s')}"
    if path.motion.carrier is not None:  # a lower speed does not slow down weave or frame
        woven = path.stretches[stretch].kind.startswith("woven")
        accepted = "a narrower weave, a lower frequency" if woven else "a slower frame"
    elif chosen:
        accepted = "another path or path.acceleration"
    else:
        accepted = "speed: fastest"
    if limit == RAMPS:
        shown = text(requested.acceleration, "m/s²")
        reason = f"the stretch is too short to change speed at path.acceleration, {shown}"
        accepted += ", a higher path.acceleration"
    elif limit == TOLERANCES:
        reason = "the tolerances are not kept"
    else:
        excess = f"reaches {rounded_up(utilisation, 4):.4g} times" if utilisation else "exceeds"
        joint = repr(limit.joint) if limit.joint else "the tool"
        reason = f"{joint} {excess} its limit of {limit.quantity}"
    return InputError(
        f"{speed} along the path from {start!r} to {end!r}: {reason}; accepted: {accepted}, or a "
        "higher limit",
        where=task.where(waypoint, _key(task, waypoint)),
    )


def _key(task: TimingTask, waypoint: int) -> str:
    """The key that gives the speed to a waypoint on a path."""
    step = task.scenario.given.waypoints[task.scenario.task_index[waypoint]]
    return next(key for key in ("speed", "after", "time") if getattr(step, key) is not None)
