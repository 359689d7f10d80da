"""Errors of speeds along tool paths, and of given speeds of the tool, with what is accepted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from knotwork.choosing.limit_shares import Limit, LimitShares
from knotwork.choosing.path_speeds import (
    DIGITS,
    RAMPS,
    TOLERANCES,
    UNBOUNDED,
    NoSpeedsError,
    PathSpeeds,
)
from knotwork.choosing.task import FreeTask, knots_of
from knotwork.errors import InputError, together
from knotwork.errors.plain_text import called
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.scenario import FreeTimes, Scenario, ScenarioPath
from knotwork.timing.problem import with_margin
from knotwork.units import rounded_down, rounded_up
from knotwork.waypoints import FloatArray

ROUNDING = 1e-9
"""Tolerance of limits, as a fraction."""

NO_MARGIN = 5e-4
"""Largest share of the limit for a given speed at a waypoint: the solver needs the rest."""

ADVISED_MARGIN = 0.002
"""Fraction of the limit that an advised speed leaves to the motion around the waypoint."""


def waypoints_near_tool_speed(task: FreeTask) -> Iterator[InputError]:
    """Errors for waypoints with a given tool speed near or above its limit."""
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
                f"{called(scenario.waypoints[i].name)}: the tool is given a speed of "
                f"{_speed(scenario, speed)}, and tool_speed is {_tool_limit(scenario)}; "
                f"accepted: at most {_speed(scenario, most)}, {rounded_down(most / speed, 3):g} "
                "times that speed, or a higher limit"
            )
            yield task.located(error, i)


def paths_beyond_limits(task: FreeTask, asked: FreeTimes) -> dict[int, list[InputError]]:
    """Errors for given speeds that exceed a limit along a path, by the path's index.

    Args:
        task: The task.
        asked: The unknowns; given speeds on paths with a chosen one are feasible.
    """
    given = {
        number: path
        for number, path in enumerate(task.scenario.paths)
        if not any(i + 1 in asked.path_speed for i in range(path.first, path.last))
    }
    errors: dict[int, list[InputError]] = {}
    for number, path in given.items():
        shares = LimitShares(task, path)
        used = _used(task, path, shares)
        columns, most = used.argmax(axis=1), used.max(axis=1)
        over = {
            int(k): _exceeds(task, shares.limits[columns[k]], float(most[k]))
            for k in np.flatnonzero(most > 1.0 + ROUNDING)
        }
        if over:
            errors[number] = speed_errors(task, path, over)
    return errors


def _used(task: FreeTask, path: ScenarioPath, shares: LimitShares) -> FloatArray:
    """Largest shares of limits that the motion uses on the stretches of a path."""
    rows, known = task.rows[path.first : path.last + 1], task.waypoints
    own = slice(rows[0], rows[-1] + 1)
    time, q, v, a = (
        values[own]  # type: ignore[index]
        for values in (known.time, known.position, known.velocity, known.acceleration)
    )
    curve = ModifiedHermiteSpline(time, q, v, knots=knots_of(task.scenario), acceleration=a)
    return shares.of_curve(curve, known.time[rows])


def no_speeds(task: FreeTask, problem: PathSpeeds, found: NoSpeedsError) -> InputError:
    """The error for a path without feasible speeds, with accepted values.

    Args:
        task: The task.
        paths: All of its paths with chosen speeds.
        problem: The problem without a solution.
        found: The reason.
    """
    k = found.stretch if found.stretch in problem.caps else min(problem.caps)
    if found.limit == UNBOUNDED:
        error = InputError(
            "nothing bounds the speed along it; accepted: speed: {at_most: a speed}, or limits"
        )
        return task.located(error, problem.path.first + 1 + k, "speed")
    over = {k: _exceeds(task, found.limit)}
    other = "a higher path.acceleration" if found.limit == RAMPS else ""
    return together(speed_errors(task, problem.path, over, other))


def speed_errors(
    task: FreeTask,
    path: ScenarioPath,
    exceeded: Mapping[int, str],
    other: str = "",
) -> list[InputError]:
    """Errors for a path that exceeds limits, with lower speeds that keep them.

    Args:
        task: The task.
        path: The path.
        exceeded: Exceeded limit, in words, by index of the stretch.
        other: Other accepted changes.
    """
    if path.motion.carrier is not None:  # a lower speed does not slow down weave or frame
        own = next(iter(exceeded))
        woven = path.stretches[own].kind.startswith("woven")
        other = "a narrower weave, a lower frequency" if woven else "a slower frame"
        return [_error(task, path, own, exceeded[own], other)]
    chosen = path.asked.at_most
    given = {k: one.speed for k, one in enumerate(path.stretches) if k not in chosen}
    try:
        found = PathSpeeds(task, path, given | dict(chosen)).greatest()
        durations = np.diff(found.timing.times)
        slower = [k for k, speed in given.items() if found.speeds[k] < rounded_down(speed, DIGITS)]
    except NoSpeedsError:
        slower = []
    if not slower:
        k, why = next(iter(exceeded.items()))
        return [_error(task, path, k, why, other or "another path or path.acceleration")]
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


def _key(task: FreeTask, i: int) -> str:
    """Key of the speed of the stretch to a waypoint."""
    waypoint = task.scenario.task.waypoints[task.scenario.index[i]]
    return next(key for key in ("speed", "after", "time") if getattr(waypoint, key) is not None)


def _ends(scenario: Scenario, path: ScenarioPath, k: int) -> str:
    begin, end = (scenario.waypoints[path.first + k + i].name for i in (0, 1))
    return f"from {begin!r} to {end!r}"


def _exceeds(task: FreeTask, limit: Limit, share: float | None = None) -> str:
    if limit == RAMPS:
        shown = task.scenario.units.text(task.scenario.paths[0].asked.acceleration, "m/s²")
        return f"there is no {RAMPS.quantity} at path.acceleration, {shown}"
    if limit == TOLERANCES:
        return "the tolerances are not kept"
    what = "exceeds" if share is None else f"reaches {rounded_up(share, 4):.4g} times"
    return f"{repr(limit.name) if limit.name else 'the tool'} {what} its limit of {limit.quantity}"


def _speed(scenario: Scenario, speed: float) -> str:
    """A speed [m/s] in the units of the scenario."""
    scale, unit = scenario.shown_length
    return f"{rounded_down(scale * speed, 6):.6g} {unit}/s"


def _tool_limit(scenario: Scenario) -> str:
    """The limit of the tool's speed, with its value before the margin."""
    limit = scenario.motion_limits.tool_speed or math.inf
    return with_margin(partial(_speed, scenario), limit, scenario.task.limits.margin)
