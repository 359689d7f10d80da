"""Errors of speeds along tool paths, and of given speeds of the tool, with what is accepted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NoReturn

import numpy as np

from knotwork.choosing.limit_shares import Limit, LimitShares, of_stretches
from knotwork.choosing.path_speeds import (
    RAMPS,
    SLOWEST,
    TOLERANCES,
    TOOL_MARGIN,
    UNBOUNDED,
    NoSpeedsError,
    PathSpeeds,
)
from knotwork.choosing.task import FreeTask, knots_of
from knotwork.errors import InputError, PathError, together
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.scenario import FreeTimes, Scenario, ScenarioPath
from knotwork.timing.given_values import rounded_down, rounded_up
from knotwork.timing.problem import with_margin
from knotwork.timing.watch import Watch
from knotwork.waypoints import FloatArray

ROUNDING = 1e-9
"""A limit may be exceeded by this part of it."""

NO_MARGIN = 5e-4
"""A given speed at a waypoint that leaves less of the limit is refused: the solver needs more."""

ADVISED_MARGIN = 0.002
"""A speed that is advised leaves this part of the limit to the motion around the waypoint."""

FACTOR, FACTORS, HALVINGS = 4.0, 6, 3
"""Accelerations along a path are tried in powers of a factor, so many, and then between two."""


def tell(errors: Iterable[InputError]) -> None:
    """Raise what several errors say together, if there are any."""
    found = list(errors)
    if found:
        raise together(found)


def paths_near_tool_speed(scenario: Scenario) -> dict[int, list[InputError]]:
    """Errors for given speeds along paths at the tool's limit or above, by the path's index."""
    limit, free = scenario.motion_limits.tool_speed, scenario.free
    errors: dict[int, list[InputError]] = {}
    if limit is None or free is None:
        return errors
    most = limit / (1.0 + scenario.tolerances.path_speed)
    for number, path in enumerate(scenario.paths):
        for k, stretch in enumerate(path.stretches):
            place = free.index[path.first + 1 + k]
            highest = limit * (1.0 - TOOL_MARGIN) * (1.0 + ROUNDING)
            if place in free.path_speed or stretch.speed <= highest:
                continue
            error = InputError(
                f"{_speed(scenario, stretch.speed)} along the path {_ends(scenario, path, k)} "
                f"leaves no room below tool_speed, {_tool_limit(scenario)}; accepted: at most "
                f"{_speed(scenario, most)} (the path_speed tolerance is "
                f"{scenario.tolerances.path_speed:g} of the speed), or a higher limit"
            )
            error.locate(free.document.where(("waypoints", place, "speed")))
            errors.setdefault(number, []).append(error)
    return errors


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
        speed, most = (
            float(np.linalg.norm(robot.jacobian(q)[:3] @ v)),
            (1.0 - ADVISED_MARGIN) * limit,
        )
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
    """Errors for given speeds that take a joint beyond a limit, by the path's index.

    Args:
        task: The task.
        asked: What was to be chosen; along paths with a speed that was, those given are possible.
        watch: What knows of the budget.
    """
    errors: dict[int, list[InputError]] = {}
    stuck: dict[int, tuple[ScenarioPath, FloatArray]] = {}
    shares = LimitShares(task) if task.scenario.paths else None
    for number, path in enumerate(task.scenario.paths):
        ends = range(path.first + 1, path.last + 1)
        if shares is None or any(task.free.index[i] in asked.path_speed for i in ends):
            continue
        used = _used(task, path, shares)
        if (used > 1.0 + ROUNDING).any():
            errors[number] = _given_too_fast(task, path, watch, used)
            if not errors[number]:
                stuck[number] = path, used
    if stuck:
        other = _other_acceleration(task, [path for path, _ in stuck.values()], watch)
        for number, (path, used) in stuck.items():
            k = int(np.flatnonzero((used > 1.0 + ROUNDING).any(axis=1))[0])
            accepted = "another path" if other is None else _acceleration(task, other)
            errors[number] = [_too_fast(task, path, k, _reaches(task, used[k]), accepted)]
    return errors


def _used(task: FreeTask, path: ScenarioPath, shares: LimitShares) -> FloatArray:
    """The greatest shares of joints' limits that the motion uses on the stretches of a path."""
    rows, known = task.rows[path.first : path.last + 1], task.waypoints
    own = slice(rows[0], rows[-1] + 1)
    time, q, v, a = (
        values[own]  # type: ignore[index]
        for values in (known.time, known.position, known.velocity, known.acceleration)
    )
    curve = ModifiedHermiteSpline(time, q, v, knots=knots_of(task.scenario), acceleration=a)
    return shares.of_curve(curve, known.time[rows])[:, : 3 * len(known.joint_names)]


def no_speeds(
    task: FreeTask,
    paths: Sequence[ScenarioPath],
    problem: PathSpeeds,
    found: NoSpeedsError,
    watch: Watch,
) -> NoReturn:
    """Report that there are no speeds along a path, and what is accepted.

    Args:
        task: The task.
        paths: All of its paths whose speeds are chosen.
        problem: The problem that has no solution.
        found: Why it has none.
        watch: What knows of the budget.
    """
    path, limit = problem.path, found.limit
    k = found.stretch if found.stretch in problem.caps else min(problem.caps)
    if limit == UNBOUNDED:
        error = InputError(
            "nothing bounds the speed along it; accepted: speed: {at_most: a speed}, or limits"
        )
        raise task.located(error, path.first + 1 + k, "speed")
    other = None
    if limit == RAMPS:
        other = _other_acceleration(task, paths, watch, higher=True)
    tell(_given_too_fast(task, path, watch, None, other))
    if limit != RAMPS:
        other = _other_acceleration(task, paths, watch)
    slowest, fastest = (
        task.scenario.units.text(speed, "m/s", ".4g")
        for speed in (SLOWEST, max(problem.bounds.get(k, SLOWEST), SLOWEST))
    )
    said = (
        f"no speed from {slowest} to {fastest} was found at which the limits are kept along it: "
        f"{_exceeded(task, limit)}"
    )
    if other is not None and limit != RAMPS:
        said += f", where speeds change {_at_acceleration(task)}"
    accepted = "" if other is None else f"{_acceleration(task, other)}, "
    error = InputError(f"{said}; accepted: {accepted}higher limits, or another path")
    raise task.located(error, path.first + 1 + k, "speed")


def _given_too_fast(
    task: FreeTask,
    path: ScenarioPath,
    watch: Watch,
    used: FloatArray | None,
    other: float | None = None,
) -> list[InputError]:
    """Errors for given speeds that can't be kept along a path, if lower ones can.

    Args:
        task: The task.
        path: The path.
        watch: What knows of the budget.
        used: The shares of joints' limits that are used at these speeds, if they are known.
        other: A path.acceleration with which these speeds can be kept, if one is known [m/s²].
    """
    chosen = path.asked.at_most
    given = {k: one.speed for k, one in enumerate(path.stretches) if k not in chosen}
    problem = PathSpeeds(task, path, given | dict(chosen))
    try:
        found = problem.greatest(watch)
    except NoSpeedsError:
        return []
    durations = np.diff(found.timing.times)
    if used is None:
        try:
            used = of_stretches(problem.along.at(problem.asked.timed({**found.speeds, **given})[0]))
            used = used[:, : 3 * len(task.space.joint_names)]
        except PathError:
            used = np.zeros((len(durations), 1))
    errors = []
    for k, speed in given.items():
        if found.speeds[k] >= rounded_down(speed, 4) * (1.0 - ROUNDING):
            continue
        key = _given_key(task, path.first + 1 + k)
        accepted = task.scenario.units.text(found.speeds[k], "m/s")
        if key != "speed":
            accepted = f"{key}: {rounded_up(float(durations[k]), 5):g}"
        if other is not None:
            accepted += f", {_acceleration(task, other)}"
        held = f", {_exceeded(task, found.limits[k])}"
        if (used[k] > 1.0 + ROUNDING).any():
            held = _reaches(task, used[k])
        errors.append(_too_fast(task, path, k, held, accepted))
    return errors


def _other_acceleration(
    task: FreeTask, paths: Sequence[ScenarioPath], watch: Watch, *, higher: bool = False
) -> float | None:
    """An acceleration not far from the task's own with which paths keep the limits [m/s²].

    `None` if none is found, or the budget has ended.

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
    return good


def _keeps(problem: PathSpeeds, acceleration: float, watch: Watch) -> bool:
    """Whether a path can be followed within the limits with some acceleration along it [m/s²]."""
    problem.asked = replace(problem.asked, acceleration=acceleration)
    try:
        problem.greatest(watch, first=True)
    except NoSpeedsError:
        return False
    return True


def _too_fast(task: FreeTask, path: ScenarioPath, k: int, held: str, accepted: str) -> InputError:
    scenario = task.scenario
    error = InputError(
        f"at {scenario.units.text(path.stretches[k].speed, 'm/s')} along the path "
        f"{_ends(scenario, path, k)}{held}; accepted: {accepted}, or a higher limit"
    )
    i = path.first + 1 + k
    return task.located(error, i, _given_key(task, i))


def _given_key(task: FreeTask, i: int) -> str:
    """What gives the speed of the stretch to a waypoint."""
    waypoint = task.free.document.data["waypoints"][task.free.index[i]]
    return next(key for key in ("speed", "after", "time") if key in waypoint)


def _ends(scenario: Scenario, path: ScenarioPath, k: int) -> str:
    begin, end = (scenario.waypoints[path.first + k + i].name for i in (0, 1))
    return f"from {begin!r} to {end!r}"


def _reaches(task: FreeTask, used: FloatArray) -> str:
    """What the joint that uses most of a limit reaches, and the limit."""
    space, text = task.space, task.scenario.units.text
    column = int(used[: 3 * len(space.joint_names)].argmax())
    order, joint = divmod(column, len(space.joint_names))
    quantity = ("velocity", "acceleration", "jerk")[order]
    unit = JOINT_QUANTITIES[quantity].units[space.joint_units[joint]]
    limit = float(space.limits[quantity][joint])
    said = with_margin(partial(text, unit=unit), limit, task.scenario.margin)
    return (
        f" joint {space.joint_names[joint]!r} would reach {text(used[column] * limit, unit)}; its "
        f"limit of {quantity} is {said}"
    )


def _exceeded(task: FreeTask, limit: Limit) -> str:
    if limit == RAMPS:
        return f"there is no {RAMPS.quantity} {_at_acceleration(task)}"
    if limit == TOLERANCES:
        return "the tolerances are not kept"
    if limit.name:
        return f"{limit.name!r} exceeds its limit of {limit.quantity}"
    return f"the limit of {limit.quantity} is not kept"


def _at_acceleration(task: FreeTask) -> str:
    shown = task.scenario.units.text(task.scenario.paths[0].asked.acceleration, "m/s²")
    return f"at path.acceleration, {shown}"


def _acceleration(task: FreeTask, acceleration: float) -> str:
    return f"path: {{acceleration: {task.scenario.shown_length[0] * acceleration:.6g}}}"


def _speed(scenario: Scenario, speed: float) -> str:
    """A speed [m/s] in the units of the scenario."""
    scale, unit = scenario.shown_length
    return f"{rounded_down(scale * speed, 6):.6g} {unit}/s"


def _tool_limit(scenario: Scenario) -> str:
    """The limit of the tool's speed, and what it is before the margin."""
    limit = scenario.motion_limits.tool_speed or math.inf
    return with_margin(partial(_speed, scenario), limit, scenario.margin)
