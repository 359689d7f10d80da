"""Constant speeds along tool paths: those that are chosen, and those given that can't be kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any, NoReturn

import numpy as np

from knotwork.choosing.accelerations import other_acceleration
from knotwork.choosing.along_path import AlongPath, Excess, Hindrance
from knotwork.choosing.bracket import SLOWEST
from knotwork.choosing.given_speeds import ROUNDING, located, tell
from knotwork.choosing.path_search import RAMPS, PathSearch, Speeds
from knotwork.choosing.task import FreeTask
from knotwork.documents import Location
from knotwork.errors import DocumentError, InputError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.scenario import FreeTimes, ScenarioPath
from knotwork.timing import Binding
from knotwork.timing.budget import Watch
from knotwork.timing.infeasible_values import rounded_up
from knotwork.timing.problem import with_margin


@dataclass(frozen=True, eq=False)
class PathSpeeds:
    """Speeds along tool paths that were chosen.

    Attributes:
        edits: What gives each stretch its speed.
        binding: What bounds these speeds.
        stopped: Whether the budget ended before they were the greatest.
    """

    edits: dict[Location, Any] = field(default_factory=dict)
    binding: tuple[Binding, ...] = ()
    stopped: bool = False


def path_speeds(task: FreeTask, watch: Watch) -> PathSpeeds:
    """Choose the speeds along tool paths that are to be chosen, with up to half of the budget.

    Raises:
        InputError: Nothing bounds a speed, or the limits allow none.
    """
    edits: dict[Location, Any] = {}
    binding: list[Binding] = []
    stopped = False
    paths = [path for path in task.scenario.paths if path.asked.at_most]
    for i, path in enumerate(paths):
        search = PathSearch(task, path, path.asked.at_most, watch)
        with watch.turn(1.0 / (2 * len(paths) - i)):
            speeds = search.greatest()
        if speeds is None:
            other = partial(other_acceleration, task, paths, higher=search.no_room)
            found = other() if search.no_room else None
            tell(_given_too_fast(task, path, found))
            _refuse(task, search, found if search.no_room else other())
        edits |= search.edits(speeds)
        binding += search.binding(speeds)
        stopped |= search.stopped
    return PathSpeeds(edits, (*binding,), stopped)


def paths_beyond_joint_limits(task: FreeTask, asked: FreeTimes) -> dict[int, list[InputError]]:
    """Errors for given speeds that take a joint beyond a limit, by number of the path.

    Args:
        task: The task.
        asked: What was to be chosen; along paths with a speed that was, those given do.
    """
    errors: dict[int, list[InputError]] = {}
    stuck: dict[int, ScenarioPath] = {}
    for number, path in enumerate(task.scenario.paths):
        ends = range(path.first + 1, path.last + 1)
        if any(task.free.index[i] in asked.path_speed for i in ends):
            continue
        along = AlongPath(task, path)
        if along.joint_beyond(along.motion(task.scenario), 1.0 + ROUNDING) is not None:
            errors[number] = _given_too_fast(task, path)
            if not errors[number]:
                stuck[number] = path
    if stuck:
        waypoints = asked.document.data["waypoints"]
        others: dict[Location, Any] = {
            ("waypoints", i, "speed"): waypoints[i]["speed"] for i in asked.path_speed
        }
        other = other_acceleration(task, [*stuck.values()], higher=False, others=others)
        for number, path in stuck.items():
            errors[number] = [_no_lower_speed(task, path, other)]
    return errors


def _given_too_fast(
    task: FreeTask, path: ScenarioPath, other: float | None = None
) -> list[InputError]:
    """Errors for given speeds that can't be kept along a path, if lower ones can.

    Args:
        task: The task.
        path: The path.
        other: A path.acceleration with which they can, if one is known [m/s²].
    """
    chosen = path.asked.at_most
    given = {k: one.speed for k, one in enumerate(path.stretches) if k not in chosen}
    search = PathSearch(task, path, given | dict(chosen))
    found = search.greatest() if given else None
    if found is None:
        return []
    errors = []
    excesses = _excesses(task, path, {k: found[k] for k in chosen})
    durations = np.diff(search.asked.timed(found)[0].times)
    for k in given:
        if not search.slowed(k, found):
            continue
        key = _given_key(task, task.free.index[path.first + 1 + k])
        accepted = task.scenario.units.text(found[k], "m/s")
        if key != "speed":
            accepted = f"{key}: {rounded_up(float(durations[k]), 5):g}"
        if other is not None:
            accepted += f", {_acceleration(task, other)}"
        held = excesses.get(k)
        if held is None:
            held = f", {_not_kept(task, search.too_fast.get(k, RAMPS))}"
        errors.append(_too_fast(task, path, k, held, accepted))
    return errors


def _excesses(task: FreeTask, path: ScenarioPath, chosen: Speeds) -> dict[int, str]:
    """What joints reach at the given speeds, by index of those stretches where it is too much."""
    scenario = task.scenario
    if chosen:
        try:
            scenario = task.with_edits(PathSearch(task, path, chosen).edits(chosen))
        except DocumentError:
            return {}
    along = AlongPath(task, path)
    whole, at_speed = along.motion(scenario), scenario.paths[along.number]
    found = {}
    for k in range(len(path.stretches)):
        excess = along.joint_beyond(along.on_stretch(whole, at_speed, k), 1.0 + ROUNDING)
        if excess is not None:
            found[k] = _reaches(task, excess)
    return found


def _no_lower_speed(task: FreeTask, path: ScenarioPath, other: float | None) -> InputError:
    """The error for given speeds that can't be kept along a path, and lower ones neither."""
    k, held = next(iter(_excesses(task, path, {}).items()))
    accepted = "another path" if other is None else _acceleration(task, other)
    return _too_fast(task, path, k, held, accepted)


def _too_fast(task: FreeTask, path: ScenarioPath, k: int, held: str, accepted: str) -> InputError:
    scenario = task.scenario
    begin, end = (scenario.waypoints[path.first + k + i].name for i in (0, 1))
    error = InputError(
        f"at {scenario.units.text(path.stretches[k].speed, 'm/s')} along the path from {begin!r} "
        f"to {end!r}{held}; accepted: {accepted}, or a higher limit"
    )
    place = task.free.index[path.first + 1 + k]
    return located(scenario, error, "waypoints", place, _given_key(task, place))


def _given_key(task: FreeTask, place: int) -> str:
    """What gives the speed of the stretch to a waypoint of the file."""
    waypoint = task.free.document.data["waypoints"][place]
    return next(key for key in ("speed", "after", "time") if key in waypoint)


def _reaches(task: FreeTask, excess: Excess) -> str:
    space, text = task.space, task.scenario.units.text
    unit = JOINT_QUANTITIES[excess.quantity].units[space.joint_units[excess.joint]]
    limit = float(space.limits[excess.quantity][excess.joint])
    said = with_margin(partial(text, unit=unit), limit, task.scenario.margin)
    return (
        f" joint {space.joint_names[excess.joint]!r} would reach {text(excess.peak, unit)}; its "
        f"limit of {excess.quantity} is {said}"
    )


def _not_kept(task: FreeTask, held: Hindrance) -> str:
    if held == RAMPS:
        return f"there is no {RAMPS.quantity} {_at_acceleration(task)}"
    if held.who:
        return f"{held.who!r} exceeds its limit of {held.quantity}"
    return f"the limit of {held.quantity} is not kept"


def _refuse(task: FreeTask, search: PathSearch, other: float | None) -> NoReturn:
    """Say that no speed was found along a path, and with which path.acceleration there is one."""
    scenario = task.scenario
    k = search.stuck if search.stuck is not None else min(search.places)
    slowest, fastest = (
        scenario.units.text(v, "m/s", ".4g") for v in (SLOWEST, max(search.first[k], SLOWEST))
    )
    said = f"no speed from {slowest} to {fastest} was found at which the limits are kept along it"
    if search.no_room:
        said += f": {_not_kept(task, RAMPS)}"
    elif search.stuck is not None:
        said += f"; at {slowest} {_not_kept(task, search.too_fast[k])}"
        if other is not None:
            said += f", where speeds change {_at_acceleration(task)}"
    accepted = "" if other is None else f"{_acceleration(task, other)}, "
    with scenario.error_context("waypoints", search.places[k], "speed"):
        raise InputError(f"{said}; accepted: {accepted}higher limits, or another path")


def _at_acceleration(task: FreeTask) -> str:
    shown = task.scenario.units.text(task.scenario.paths[0].asked.acceleration, "m/s²")
    return f"at path.acceleration, {shown}"


def _acceleration(task: FreeTask, acceleration: float) -> str:
    return f"path: {{acceleration: {task.scenario.shown_length[0] * acceleration:.6g}}}"
