"""Errors of speeds along tool paths, with accepted values."""

from __future__ import annotations

import numpy as np

from knotwork.errors import InputError
from knotwork.planning.choosing.free_task import FreeTask
from knotwork.planning.choosing.limit_shares import Limit, LimitShares
from knotwork.planning.choosing.path_speeds import NoSpeedsError, SpeedBound
from knotwork.task.scenario import FreeTimes, ScenarioPath
from knotwork.units import rounded_up

LIMIT_ROUNDING = 1e-9
"""Tolerance of limits, as a fraction."""


def paths_beyond_limits(task: FreeTask, asked: FreeTimes) -> list[InputError]:
    """Errors for given speeds that exceed a limit along a path.

    Args:
        task: The task.
        asked: The unknowns; given speeds on paths with a chosen one are feasible.
    """
    errors: list[InputError] = []
    for path in task.scenario.paths:
        if any(i + 1 in asked.path_speed for i in range(path.first, path.last)):
            continue
        shares = LimitShares(task, path)
        used = shares.of_motion(task, path).max(axis=1)
        for k in np.flatnonzero((used > 1.0 + LIMIT_ROUNDING).any(axis=1)).tolist():
            limit, share = shares.limits[int(used[k].argmax())], float(used[k].max())
            errors.append(_path_error(task, path, k, limit, share))
    return errors


def no_speeds(task: FreeTask, error: NoSpeedsError) -> InputError:
    """The error for a path without feasible speeds, with accepted changes.

    Args:
        task: The task.
        error: The reason.
    """
    path, k, limit = error.path, error.stretch, error.limit
    if limit == SpeedBound.NOTHING:
        unbounded = InputError(
            "nothing bounds the speed along it; accepted: speed: {at_most: a speed}, or limits"
        )
        return task.locate(unbounded, path.first + 1 + k, "speed")
    return _path_error(task, path, k, limit)


def _path_error(
    task: FreeTask,
    path: ScenarioPath,
    k: int,
    limit: Limit | SpeedBound,
    share: float | None = None,
) -> InputError:
    """The error for a stretch of a path that exceeds a limit.

    Args:
        task: The task.
        path: The path.
        k: Index of the stretch.
        limit: The exceeded limit.
        share: Used share of it, if known.
    """
    scenario, i = task.scenario, path.first + 1 + k
    start, end = (scenario.waypoints[path.first + k + j].name for j in (0, 1))
    chosen, text = k in path.asked.at_most, scenario.units.text
    given = path.asked.speeds[k] or path.stretches[k].speed
    speed = "no speed keeps the limits" if chosen else f"at {text(given, 'm/s')}"
    if path.motion.carrier is not None:  # a lower speed does not slow down weave or frame
        woven = path.stretches[k].kind.startswith("woven")
        accepted = "a narrower weave, a lower frequency" if woven else "a slower frame"
    elif chosen:
        accepted = "another path or path.acceleration"
    else:
        accepted = "speed: fastest"
    if limit == SpeedBound.RAMPS:
        shown = text(path.asked.acceleration, "m/s²")
        reason = f"there is no {limit} at path.acceleration, {shown}"
        accepted += ", a higher path.acceleration"
    elif isinstance(limit, SpeedBound):
        reason = "the tolerances are not kept"
    else:
        excess = "exceeds" if share is None else f"reaches {rounded_up(share, 4):.4g} times"
        joint = repr(limit.joint) if limit.joint else "the tool"
        reason = f"{joint} {excess} its limit of {limit.quantity}"
    error = InputError(
        f"{speed} along the path from {start!r} to {end!r}: {reason}; accepted: {accepted}, or a "
        "higher limit"
    )
    return task.locate(error, i, _key(task, i))


def _key(task: FreeTask, i: int) -> str:
    """Key of the speed of the stretch to a waypoint."""
    waypoint = task.scenario.task.waypoints[task.scenario.index[i]]
    return next(key for key in ("speed", "after", "time") if getattr(waypoint, key) is not None)
