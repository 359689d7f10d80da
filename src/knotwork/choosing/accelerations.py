"""A path.acceleration that would do, for errors of tool paths along which no speed does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import MappingProxyType

from knotwork.choosing.along_path import AlongPath
from knotwork.choosing.path_search import PathSearch, acceleration_edit
from knotwork.choosing.task import FreeTask
from knotwork.documents import Edits
from knotwork.errors import DocumentError, PathError
from knotwork.scenario import ScenarioPath
from knotwork.timing.infeasible_values import rounded_down

FACTOR = 4.0
"""The accelerations tried first differ by this factor."""

STEPS = 4
"""So many of these are tried."""

HALVINGS = 3
"""So often what is between one that is not far enough and one that is gets halved."""

ENOUGH, HIGHER, LOWER = 0, 1, -1


def other_acceleration(
    task: FreeTask,
    paths: Sequence[ScenarioPath],
    *,
    higher: bool,
    others: Edits = MappingProxyType({}),
) -> float | None:
    """An acceleration not far from the task's own with which paths keep the limits [m/s²].

    Args:
        task: The task.
        paths: Those of its paths that are to keep them, at some of the speeds to be chosen.
        higher: Whether it has to be higher than the task's own.
        others: Edits that leave the speeds of other paths to be chosen.
    """
    needed = HIGHER if higher else LOWER
    before = own = task.scenario.paths[0].asked.acceleration
    for k in range(1, STEPS + 1):
        beyond = _shortened(task, own * FACTOR ** (needed * k))
        fit = _needed(task, paths, beyond, others)
        if fit != needed:
            break
        before = beyond
    else:
        return None
    best = beyond if fit == ENOUGH else None
    for _ in range(HALVINGS):
        middle = _shortened(task, math.sqrt(before * beyond))
        fit = _needed(task, paths, middle, others)
        if fit == needed:
            before = middle
            continue
        beyond = middle
        if fit == ENOUGH:
            best = middle
    return best


def _needed(
    task: FreeTask, paths: Sequence[ScenarioPath], acceleration: float, others: Edits
) -> int:
    """Whether an acceleration is enough, or a higher one is needed for room, or a lower one."""
    for path in paths:
        if path.asked.at_most:
            search = PathSearch(task, path, path.asked.at_most).accelerated(acceleration)
            if search.any() is None:
                return HIGHER if search.no_room else LOWER
            continue
        try:
            edited = task.with_edits({**others, **acceleration_edit(task, acceleration)})
            if AlongPath(task, path).hindrances(edited):
                return LOWER
        except (DocumentError, PathError):
            return HIGHER
    return ENOUGH


def _shortened(task: FreeTask, acceleration: float) -> float:
    """An acceleration with few digits in the unit of the file [m/s²]."""
    unit = task.scenario.shown_length[0]
    return rounded_down(unit * acceleration, 2) / unit
