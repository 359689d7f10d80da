"""The chosen speeds along the tool paths of a task, in the task, and errors of given speeds."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from knotwork.errors import FollowingError, InputError, PathError
from knotwork.planning.choosing.chosen_values import solutions_near
from knotwork.planning.choosing.free_sections import FreeTask
from knotwork.planning.choosing.path_limit_utilisation import planned_utilisation, state_limits
from knotwork.planning.choosing.path_speed_problem import (
    MAX_SLOWDOWN,
    NOTHING,
    RAMPS,
    TOLERANCES,
    NoSpeedsError,
    PathSpeedProblem,
    round_speed,
)
from knotwork.planning.timing import ActiveLimit
from knotwork.task.scenario.resolve import change_task
from knotwork.units import rounded_up
from knotwork.verification.limits import LIMIT_SLACK


def with_path_speeds(free_task: FreeTask, problems: Sequence[PathSpeedProblem]) -> FreeTask:
    """The task with the chosen speeds along its paths, solved and found to keep the limits there.

    Args:
        free_task: The scenario, in which these speeds are free.
        problems: Its paths with chosen speeds; if the motion along one exceeds a limit, it is
            corrected.

    Raises:
        NoSpeedsError: A limit is exceeded along a path, or a path can't be followed.
    """
    if not problems:
        return free_task
    scenario, unit = free_task.scenario, free_task.scenario.units.per_metre
    changes: defaultdict[int, dict[str, Any]] = defaultdict(dict, solutions_near(free_task))
    for problem in problems:
        for stretch, speed in problem.speeds.items():
            end = scenario.task_index[problem.path.first + 1 + stretch]
            changes[end]["speed"] = round_speed(unit * speed)
    scenario = change_task(scenario, scenario.given.with_waypoints(changes))
    given = tuple(replace(at, path_speed_is_free=False) for at in free_task.free_values.waypoints)
    free = scenario.free_values or replace(free_task.free_values, waypoints=given)
    try:
        timed = FreeTask.solve(scenario, free)
    except (PathError, FollowingError) as blocked:
        faulty = [problem for problem in problems if problem.path.first == blocked.path_start]
        for problem in faulty or problems:
            problem.lower_caps(MAX_SLOWDOWN, TOLERANCES)
        raise NoSpeedsError((faulty or problems)[0].path, 0, TOLERANCES) from None
    errors = [error for problem in problems if (error := problem.correct_from_plan(timed))]
    if errors:
        raise errors[0]
    return timed


def active_path_limits(
    free_task: FreeTask, problems: Sequence[PathSpeedProblem]
) -> tuple[ActiveLimit, ...]:
    """Bounds of the chosen speeds along the paths of a task, as active limits."""
    names = [waypoint.name for waypoint in free_task.scenario.waypoints]
    return tuple(
        ActiveLimit(names[start], names[start + 1], limit.subject, limit.quantity, None)
        for problem in problems
        for start, limit in ((problem.path.first + k, problem.limiting[k]) for k in problem.speeds)
    )


def given_speeds_beyond_limits(
    free_task: FreeTask, problems: Sequence[PathSpeedProblem]
) -> list[InputError]:
    """Errors for given speeds that exceed a limit along a path.

    Args:
        free_task: The scenario and its IK solutions.
        problems: Its paths with a chosen speed, along which given speeds are feasible.
    """
    errors, chosen = list[InputError](), {problem.number for problem in problems}
    for number, path in enumerate(free_task.scenario.paths):
        if number in chosen:
            continue
        limits = state_limits(free_task, path)
        utilisations = planned_utilisation(free_task, path, limits).max(axis=1)
        for stretch in np.flatnonzero((utilisations > 1.0 + LIMIT_SLACK).any(axis=1)).tolist():
            limit = limits.quantities[int(utilisations[stretch].argmax())]
            worst = float(utilisations[stretch].max())
            errors.append(path_speed_error(free_task, NoSpeedsError(path, stretch, limit), worst))
    return errors


def path_speed_error(
    free_task: FreeTask, fault: NoSpeedsError, utilisation: float | None = None
) -> InputError:
    """The error for a stretch of a path without feasible speeds, with accepted changes.

    Args:
        free_task: The scenario and its IK solutions.
        fault: The stretch and the exceeded limit.
        utilisation: Utilisation of the limit, if known.
    """
    path, stretch, limit = fault.path, fault.stretch, fault.bound
    scenario, i = free_task.scenario, path.first + 1 + stretch
    if limit == NOTHING:
        return InputError(
            "nothing bounds the speed along it; accepted: speed: {at_most: a speed}, or limits",
            where=free_task.where(i, "speed"),
        )
    start, end = (scenario.waypoints[end].name for end in (i - 1, i))
    requested, text = path.requested, scenario.units.text
    chosen, duration = stretch in requested.at_most, requested.durations[stretch]
    given = requested.speeds[stretch] or path.stretches[stretch].speed
    if requested.at_most and duration:  # the stretches still have the nominal speed
        given = requested.lengths[stretch] / duration
    speed = "no speed keeps the limits" if chosen else f"at {text(given, 'm/s')}"
    if path.motion.has_own_clock:
        weave = path.stretches[stretch].weave
        accepted = "a slower frame" if weave is None else "a narrower weave, a lower frequency"
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
        joint = repr(limit.subject) if limit.subject else "the tool"
        reason = f"{joint} {excess} its limit of {limit.quantity.replace('_', ' ')}"
    return InputError(
        f"{speed} along the path from {start!r} to {end!r}: {reason}; accepted: {accepted}, or a "
        "higher limit",
        where=free_task.where(i, _key(free_task, i)),
    )


def _key(free_task: FreeTask, i: int) -> str:
    """The key that gives the speed to waypoint i, on a path."""
    given = free_task.scenario.given.waypoints[free_task.scenario.task_index[i]]
    return next(key for key in ("speed", "after", "time") if getattr(given, key) is not None)
