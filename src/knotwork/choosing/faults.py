"""All that is given beyond a limit or in too short a time, told together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from knotwork.choosing.given_speeds import (
    located,
    paths_beyond_tool_speed,
    paths_without_room,
    tell,
    waypoints_beyond_tool_speed,
)
from knotwork.choosing.path_speeds import paths_beyond_joint_limits
from knotwork.choosing.runs import Run, timing_problem
from knotwork.choosing.task import FreeTask
from knotwork.documents import Location
from knotwork.errors import InputError, TimingError
from knotwork.scenario import FreeTimes
from knotwork.timing import Objective
from knotwork.timing.infeasible import impossible
from knotwork.timing.infeasible_values import rounded_up, with_room


def check_given(task: FreeTask, asked: FreeTimes, runs: Sequence[Run]) -> None:
    """Refuse what is given beyond a limit or in too short a time, whatever it is and wherever.

    Runs that meet a path along which a joint exceeds a limit are left aside: it is not known how
    fast they may begin or end.

    Args:
        task: The task.
        asked: What was to be chosen; along paths with a speed that was, those given do.
        runs: Its runs.

    Raises:
        InputError: There is something.
    """
    paths = task.scenario.paths
    without_room = paths_without_room(task.scenario)
    of_tool = without_room | paths_beyond_tool_speed(task, without_room)
    of_joints = paths_beyond_joint_limits(task, asked)
    unknown = {i for k in of_joints for i in (paths[k].first, paths[k].last)}
    left = [run for run in runs if not unknown & {run.waypoints[0], run.waypoints[-1]}]
    errors = [one for found in (of_tool, of_joints) for errors in found.values() for one in errors]
    errors += waypoints_beyond_tool_speed(task)
    for run in left:
        errors += located_in_run(impossible(timing_problem(task, run, Objective())), task, run)
    tell(errors)


def given_time(task: FreeTask, timed: Iterable[Run]) -> float:
    """How long all lasts but the runs whose times are chosen [s]."""
    provisional = sum(float(np.ptp(task.waypoints.time[run.rows])) for run in timed)
    return float(np.ptp(task.scenario.times)) - provisional


def total_too_short(task: FreeTask, shortest: float) -> InputError:
    """The error for a duration that is shorter than the least time found [s]."""
    error = InputError(
        f"{task.free.total:g} s is shorter than the least time found under the limits, "
        f"{rounded_up(shortest):.6g} s; accepted: {with_room(shortest):.6g} s or more"
    )
    return located(task.scenario, error, "duration")


def located_in_run(errors: list[TimingError], task: FreeTask, run: Run) -> list[TimingError]:
    """Say in errors which waypoints of the file they are about."""
    for error in errors:
        row = error.waypoint
        if row is None:
            error.locate(task.scenario.name)
            continue
        i = run.waypoints[row + error.interval]
        k = task.free.index[i]
        place: Location = ("waypoints", k) if k >= 0 else ("start",)
        error.locate(task.free.document.where(place))
    return errors
