"""Motions of all segments of a task, or the reasons of failures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from knotwork.errors import InputError, TimingError, together
from knotwork.planning.choosing.clear_motions import clear_motion
from knotwork.planning.choosing.segments import Segment, timing_problem
from knotwork.planning.choosing.task import FreeTask
from knotwork.planning.timing import Objective, TimedMotion
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.rounding import with_room
from knotwork.planning.timing.solving import NoMotionError, solved
from knotwork.units import rounded_up

SMOOTHEST = Objective(time=0.0, jerk=1.0)
"""Objective of a single interval with a given time."""

CALMEST = Objective(time=0.0, acceleration=1.0)
"""The same for several: least jerk would keep up the accelerations of a short one in a long one."""


class NoMotionsError(Exception):
    """No motion was found for some segments.

    Attributes:
        task: Their task.
        errors: Reasons, by segment.
    """

    def __init__(self, task: FreeTask, errors: dict[Segment, NoMotionError]) -> None:
        super().__init__()
        self.task, self.errors = task, errors

    def reported(self) -> InputError:
        """The combined error of all segments."""
        located = [
            located_in_segment(error.causes, self.task, one) for one, error in self.errors.items()
        ]
        return together([one for causes in located for one in causes])


def solved_segments(
    task: FreeTask, segments: list[Segment], budget: Budget
) -> list[tuple[Segment, TimedMotion]]:
    """Motions of all segments, with the given total duration, if there is one.

    Args:
        task: The task.
        segments: Its segments.
        budget: Budget and progress of all of them.

    Raises:
        NoMotionsError: Some segments have no motion.
        TimingError: The total is too short.
    """
    free = task.free
    objective = Objective(**{"time": 0.0, **free.objective})
    budget.work = sum(len(one.waypoints) - 1 for one in segments)
    if free.total is None:
        return list(_motions(task, segments, objective, budget).items())
    timed = [one for one in segments if free.duration[list(one.waypoints)[:-1]].any()]
    budget.work += sum(len(one.waypoints) - 1 for one in timed)
    fastest = _motions(task, timed, Objective(), budget)
    spans = {one: motion.duration for one, motion in fastest.items()}
    given = duration_outside(task, timed)
    shortest = given + sum(spans.values())
    if free.total < shortest:
        stopped = any(motion.status == "stopped" for motion in fastest.values())
        raise _total_too_short(task, shortest, budget if stopped else None)
    factor = (free.total - given) / sum(spans.values())
    totals = {one: factor * span for one, span in spans.items()}
    try:
        return list(_motions(task, segments, objective, budget, totals).items())
    except NoMotionsError as failed:
        error = failed.reported()
        error.add(f"the shortest motion that was found lasts {with_room(shortest):.6g} s")
        raise error from None


def duration_outside(task: FreeTask, segments: Iterable[Segment]) -> float:
    """Duration of the motion outside some segments [s]."""
    own = sum(float(np.ptp(task.waypoints.time[one.rows])) for one in segments)
    return float(np.ptp(task.scenario.provisional_times)) - own


def _motions(
    task: FreeTask,
    segments: list[Segment],
    objective: Objective,
    budget: Budget,
    totals: Mapping[Segment, float] = MappingProxyType({}),
) -> dict[Segment, TimedMotion]:
    found, failed = {}, {}
    for one in segments:
        problem = timing_problem(task, one, objective, totals.get(one))
        if objective.only_time and one not in totals and not problem.free.any():
            alone = len(one.waypoints) == 2
            problem = replace(problem, objective=SMOOTHEST if alone else CALMEST)
        try:
            if one.way is None:
                found[one] = solved(problem, budget)
            else:
                ends = (m.trajectory.position(m.duration) for s, m in found.items() if s.meets(one))
                found[one] = clear_motion(task, one, problem, budget, next(ends, None))
        except NoMotionError as error:
            failed[one] = error
    if failed:
        raise NoMotionsError(task, failed)
    return found


def _total_too_short(task: FreeTask, shortest: float, budget: Budget | None) -> InputError:
    """The error for a duration below that of the shortest motion found [s].

    Args:
        task: The task.
        shortest: Duration of that motion [s].
        budget: Budget, if it ended before a shorter one could be found.
    """
    total, enough = task.free.total, f"{with_room(shortest):.6g} s"
    if budget is None:
        error = InputError(
            f"{total:g} s is shorter than the minimum time found within the limits, "
            f"{rounded_up(shortest):.6g} s; accepted: {enough} or more"
        )
    else:
        error = TimingError(
            f"no motion of {total:g} s was found within the budget of {budget.seconds:.3g} s, the "
            f"shortest lasts {enough}; allow more time",
            limit="budget",
        )
    error.locate(task.scenario.where("duration"))
    return error


def located_in_segment(
    errors: list[TimingError], task: FreeTask, segment: Segment
) -> list[TimingError]:
    """Name the waypoints of the file in errors of a segment."""
    for error in errors:
        if error.waypoint is None:
            error.locate(task.scenario.name)
        else:
            task.located(error, segment.waypoints[error.waypoint + error.interval])
    return errors
