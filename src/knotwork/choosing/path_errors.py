"""Errors of speeds along tool paths, and of given speeds of the tool, with what is accepted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from knotwork.choosing.limit_shares import Limit, LimitShares
from knotwork.choosing.path_speeds import (
    BUDGET,
    DIGITS,
    RAMPS,
    TOLERANCES,
    UNBOUNDED,
    NoSpeedsError,
    PathSpeeds,
)
from knotwork.choosing.task import FreeTask, knots_of
from knotwork.errors import InputError, together
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.scenario import FreeTimes, Scenario, ScenarioPath
from knotwork.timing.budget import Watch
from knotwork.timing.infeasible_values import rounded_down, rounded_up
from knotwork.timing.problem import with_margin
from knotwork.waypoints import FloatArray

ROUNDING = 1e-9
"""A limit may be exceeded by this part of it."""

NO_MARGIN = 5e-4
"""A given speed at a waypoint that leaves less of the limit is refused: the solver needs more."""

ADVISED_MARGIN = 0.002
"""A speed that is advised leaves this part of the limit to the motion around the waypoint."""

FACTOR, FACTORS, HALVINGS = 4.0, 6, 3
"""Accelerations along a path are tried in powers of a factor, and then between two."""


def waypoints_near_tool_speed(task: FreeTask) -> Iterator[InputError]:
    """Errors for waypoints at which the tool is given a speed of its limit, nearly, or above it."""
    scenario, free = task.scenario, task.free
    limit, robot = scenario.motion_limits.tool_speed, task.space.robot
    if limit is None or robot is None:
        return
    on_paths = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    for i, row in enumerate(task.rows):
        if free.speed[i] != "given" or i in on_paths:
            continue
        q, v = task.waypoints.position[row], task.waypoints.velocity[row]
        speed = float(np.linalg.norm(robot.jacobian(q)[:3] @ v))
        most = (1.0 - ADVISED_MARGIN) * limit
        if speed > limit * (1.0 - NO_MARGIN):
            error = InputError(
                f"waypoint {scenario.waypoints[i].name!r}: the tool is given a speed of "
                f"{_speed(scenario, speed)}, and tool_speed is {_tool_limit(scenario)}; "
                f"accepted: at most {_speed(scenario, most)}, {rounded_down(most / speed, 3):g} "
                "times that speed, or a higher limit"
            )
            yield task.located(error, i)


def paths_beyond_limits(
    task: FreeTask, asked: FreeTimes, watch: Watch
) -> dict[int, list[InputError]]:
    """Errors for given speeds that exceed a limit along a path, by the path's index.

    Args:
        task: The task.
        asked: What was to be chosen; along paths with a speed that was, those given are possible.
        watch: What knows of the budget.
    """
    given = {
        number: path
        for number, path in enumerate(task.scenario.paths)
        if not any(i + 1 in asked.path_speed for i in range(path.first, path.last))
    }
    errors: dict[int, list[InputError]] = {}
    for number, path in given.items():
        shares = LimitShares(task)
        used = _used(task, path, shares)
        columns, most = used.argmax(axis=1), used.max(axis=1)
        over = {
            int(k): _exceeds(task, shares.limits[columns[k]], float(most[k]))
            for k in np.flatnonzero(most > 1.0 + ROUNDING)
        }
        if over:
            errors[number] = speed_errors(task, [*given.values()], path, over, watch)
    return errors


def _used(task: FreeTask, path: ScenarioPath, shares: LimitShares) -> FloatArray:
    """The greatest shares of limits that the motion uses on the stretches of a path."""
    rows, known = task.rows[path.first : path.last + 1], task.waypoints
    own = slice(rows[0], rows[-1] + 1)
    time, q, v, a = (
        values[own]  # type: ignore[index]
        for values in (known.time, known.position, known.velocity, known.acceleration)
    )
    curve = ModifiedHermiteSpline(time, q, v, knots=knots_of(task.scenario), acceleration=a)
    return shares.of_curve(curve, known.time[rows])


def no_speeds(
    task: FreeTask,
    paths: Sequence[ScenarioPath],
    problem: PathSpeeds,
    found: NoSpeedsError,
    watch: Watch,
) -> InputError:
    """The error for a path along which there are no speeds, with what is accepted.

    Args:
        task: The task.
        paths: All of its paths whose speeds are chosen.
        problem: The problem that has no solution.
        found: Why it has none.
        watch: What knows of the budget.
    """
    k = found.stretch if found.stretch in problem.caps else min(problem.caps)
    if found.limit == UNBOUNDED:
        error = InputError(
            "nothing bounds the speed along it; accepted: speed: {at_most: a speed}, or limits"
        )
        return task.located(error, problem.path.first + 1 + k, "speed")
    over = {k: _exceeds(task, found.limit)}
    errors = speed_errors(task, paths, problem.path, over, watch, higher=found.limit == RAMPS)
    return together(errors)


def speed_errors(
    task: FreeTask,
    paths: Sequence[ScenarioPath],
    path: ScenarioPath,
    exceeded: Mapping[int, str],
    watch: Watch,
    *,
    higher: bool = False,
) -> list[InputError]:
    """Errors for a path along which limits are exceeded, with lower speeds or another acceleration.

    Args:
        task: The task.
        paths: Those of its paths that are to keep the limits with another acceleration.
        path: The path.
        exceeded: What is exceeded, in words, by index of the stretch.
        watch: What knows of the budget.
        higher: Whether an acceleration has to be higher than the task's own.
    """
    chosen = path.asked.at_most
    given = {k: one.speed for k, one in enumerate(path.stretches) if k not in chosen}
    other = _other_acceleration(task, paths, watch, higher=True) if higher else ""
    try:
        found = PathSpeeds(task, path, given | dict(chosen)).greatest(watch)
        durations = np.diff(found.timing.times)
        slower = [k for k, speed in given.items() if found.speeds[k] < rounded_down(speed, DIGITS)]
    except NoSpeedsError:
        slower = []
    if not slower:
        k, why = next(iter(exceeded.items()))
        other = other or _other_acceleration(task, paths, watch, higher=False)
        return [_error(task, path, k, why, other or "another path")]
    errors = []
    for k in slower:
        key = _key(task, path.first + 1 + k)
        accepted = task.scenario.units.text(found.speeds[k], "m/s")
        if key != "speed":
            accepted = f"{key}: {rounded_up(float(durations[k]), 5):g}"
        why = exceeded.get(k) or _exceeds(task, found.limits[k])
        errors.append(_error(task, path, k, why, ", ".join(filter(None, (accepted, other)))))
    return errors


def _error(task: FreeTask, path: ScenarioPath, k: int, why: str, accepted: str) -> InputError:
    scenario, i = task.scenario, path.first + 1 + k
    speed = scenario.units.text(path.stretches[k].speed, "m/s")
    at = "no speed keeps the limits" if k in path.asked.at_most else f"at {speed}"
    error = InputError(
        f"{at} along the path {_ends(scenario, path, k)}: {why}; accepted: {accepted}, or a higher "
        "limit"
    )
    return task.located(error, i, _key(task, i))


def _other_acceleration(
    task: FreeTask, paths: Sequence[ScenarioPath], watch: Watch, *, higher: bool
) -> str:
    """A path.acceleration not far from the task's own with which paths keep the limits.

    Empty if none is found, or the budget has ended.

    Args:
        task: The task.
        paths: Those of its paths that are to keep them, at some of the speeds to be chosen.
        watch: What knows of the budget.
        higher: Whether it has to be higher than the task's own.
    """
    unit, own = task.scenario.shown_length[0], paths[0].asked.acceleration
    problems = [PathSpeeds(task, path, path.asked.at_most) for path in paths]
    worse, good, halvings = own, None, 0
    for k in range(FACTORS + HALVINGS):
        if watch.late(found=True) or halvings == HALVINGS or (good is None and k == FACTORS):
            break
        wanted = math.sqrt(worse * good) if good else worse * (FACTOR if higher else 1.0 / FACTOR)
        trial = rounded_down(unit * wanted, 2) / unit
        halvings += good is not None
        if all(_keeps(problem, trial, watch) for problem in problems):
            good = trial
        else:
            worse = trial
    return f"path: {{acceleration: {unit * good:.6g}}}" if good else ""


def _keeps(problem: PathSpeeds, acceleration: float, watch: Watch) -> bool:
    """Whether a path can be followed within the limits with some acceleration along it [m/s²]."""
    problem.asked = replace(problem.asked, acceleration=acceleration)
    try:
        problem.greatest(watch, first=True)
    except NoSpeedsError:
        return False
    return True


def _key(task: FreeTask, i: int) -> str:
    """What gives the speed of the stretch to a waypoint."""
    waypoint = task.scenario.task.waypoints[task.scenario.index[i]]
    return next(key for key in ("speed", "after", "time") if getattr(waypoint, key) is not None)


def _ends(scenario: Scenario, path: ScenarioPath, k: int) -> str:
    begin, end = (scenario.waypoints[path.first + k + i].name for i in (0, 1))
    return f"from {begin!r} to {end!r}"


def _exceeds(task: FreeTask, limit: Limit, share: float | None = None) -> str:
    if limit == RAMPS:
        shown = task.scenario.units.text(task.scenario.paths[0].asked.acceleration, "m/s²")
        return f"there is no {RAMPS.quantity} at path.acceleration, {shown}"
    if limit in (TOLERANCES, BUDGET):  # whichever limit it was, when the budget ended
        return f"the {'tolerances' if limit == TOLERANCES else 'limits'} are not kept"
    what = "exceeds" if share is None else f"reaches {rounded_up(share, 4):.4g} times"
    return f"{repr(limit.name) if limit.name else 'the tool'} {what} its limit of {limit.quantity}"


def _speed(scenario: Scenario, speed: float) -> str:
    """A speed [m/s] in the units of the scenario."""
    scale, unit = scenario.shown_length
    return f"{rounded_down(scale * speed, 6):.6g} {unit}/s"


def _tool_limit(scenario: Scenario) -> str:
    """The limit of the tool's speed, and what it is before the margin."""
    limit = scenario.motion_limits.tool_speed or math.inf
    return with_margin(partial(_speed, scenario), limit, scenario.margin)
