"""All that is given beyond a limit or in too short a time, told together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from knotwork.choosing.given_speeds import (
    greatest_path_speed,
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
from knotwork.timing.problem import TimingProblem
from knotwork.timing.safe_numbers import rounded_up, with_room
from knotwork.timing.slower import WronglyGiven, wrongly_given
from knotwork.timing.solving import NoMotionError, solved
from knotwork.timing.watch import Watch

TOGETHER = "all of this with what is proposed at waypoints"


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
    of_waypoints = waypoints_beyond_tool_speed(task)
    slower = {i: factor for i, (_, factor) in of_waypoints.items()}
    most = greatest_path_speed(task.scenario)
    for k in of_tool:
        for i, stretch in ((paths[k].first, 0), (paths[k].last, -1)):
            slower[i] = min(most / paths[k].stretches[stretch].speed, 1.0)
    unknown = {i for k in of_joints for i in (paths[k].first, paths[k].last)}
    left = [run for run in runs if not unknown & {run.waypoints[0], run.waypoints[-1]}]
    errors = [one for found in (of_tool, of_joints) for errors in found.values() for one in errors]
    errors += [error for error, _ in of_waypoints.values()]
    tell([*errors, *_of_runs(task, left, slower, whole=not (of_tool or of_joints))])


def _of_runs(
    task: FreeTask, runs: Sequence[Run], slower: Mapping[int, float], *, whole: bool
) -> list[InputError]:
    """What is given wrongly in runs.

    Args:
        task: The task.
        runs: The runs.
        slower: What part of the velocity at some waypoints is taken instead, by index.
        whole: Whether these are all runs, and all else lasts as long as is given.
    """
    problems = {run: timing_problem(task, run, Objective()) for run in runs}
    wrong = {run: _wrong(problem, run, slower) for run, problem in problems.items()}
    causes = {run: list(one.errors) for run, one in wrong.items()}
    if not slower and not any(causes.values()):
        return []
    total = task.free.total if whole else None
    spans: dict[Run, float] = {}
    for run, problem in problems.items():
        mended = wrong[run].mended
        if mended is None or (total is None and (causes[run] or problem.free.all())):
            continue
        try:
            spans[run] = solved(mended, Watch()).duration
        except NoMotionError as error:
            causes[run] += error.causes
    timed = [run for run, problem in problems.items() if problem.free.any()]
    errors: list[InputError] = [
        one for run in runs for one in located_in_run(causes[run], task, run)
    ]
    if total is not None and spans.keys() >= {*timed}:
        shortest = given_time(task, timed) + sum(spans[run] for run in timed)
        if total < shortest:
            too_short = total_too_short(task, shortest)
            too_short.add(TOGETHER)
            errors.append(too_short)
    return errors


def _wrong(problem: TimingProblem, run: Run, slower: Mapping[int, float]) -> WronglyGiven:
    """What is given wrongly in a run, some of its waypoints passed slower."""
    rows = [row for row, i in enumerate(run.waypoints) if i in slower]
    if not rows:
        return wrongly_given(problem)
    velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
    for row in rows:
        velocity[row] *= slower[run.waypoints[row]]
        acceleration[row] *= slower[run.waypoints[row]] ** 2
    found = wrongly_given(replace(problem, velocity=velocity, acceleration=acceleration))
    for error in found.errors:
        error.add(TOGETHER)
    return found


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
