"""Solution of all segments of a task that share a budget and perhaps a total duration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from knotwork.errors import InputError, TimingError, merge_errors
from knotwork.planning.choosing.clear_segments import plan_clear_segment
from knotwork.planning.choosing.segments import TimingSegment, TimingTask, timing_problem
from knotwork.planning.timing import Objective, TimedMotion
from knotwork.planning.timing.bounds import sufficient_duration
from knotwork.planning.timing.solving import solve_within
from knotwork.planning.timing.timed_motion import Budget
from knotwork.units import rounded_up

SMOOTHEST = Objective(time=0.0, jerk=1.0)
"""Objective of a single interval with a given time."""

CALMEST = Objective(time=0.0, acceleration=1.0)
"""The same for several intervals.

With minimum jerk the accelerations of a short interval would continue in a long one.
"""


class NoMotionsError(Exception):
    """No motion was found for some segments.

    Attributes:
        task: Their task.
        errors: Reasons, by segment.
    """

    def __init__(self, task: TimingTask, errors: dict[TimingSegment, TimingError]) -> None:
        super().__init__()
        self.task, self.errors = task, errors

    def combined_error(self) -> InputError:
        """The combined error of all segments."""
        return merge_errors(
            [
                cause
                for segment, error in self.errors.items()
                for cause in located_in_segment((error, *error.others), self.task, segment)
            ]
        )


def solve_segments(
    task: TimingTask, segments: list[TimingSegment], budget: Budget
) -> dict[TimingSegment, TimedMotion]:
    """Solve all segments, with the given total duration if there is one.

    Args:
        task: The task.
        segments: Its segments.
        budget: Budget and progress of all of them.

    Raises:
        NoMotionsError: Some segments have no motion.
        TimingError: The total is too short.
    """
    free = task.free_values
    objective = Objective(**{"time": 0.0, **free.objective})
    budget.work, budget.solved = sum(len(segment.waypoints) - 1 for segment in segments), 0
    if free.total_duration is None:
        return _motions(task, segments, objective, budget)
    timed = [
        segment for segment in segments if free.duration_is_free[list(segment.waypoints)[:-1]].any()
    ]
    budget.work += sum(len(segment.waypoints) - 1 for segment in timed)
    fastest = _motions(task, timed, Objective(), budget)
    outside = _duration_outside(task, timed)
    shortest = outside + sum(motion.duration for motion in fastest.values())
    if free.total_duration < shortest:
        stopped = any(motion.status == "stopped" for motion in fastest.values())
        raise _total_too_short(task, shortest, stopped=stopped)
    factor = (free.total_duration - outside) / (shortest - outside)
    totals = {segment: factor * motion.duration for segment, motion in fastest.items()}
    try:
        return _motions(task, segments, objective, budget, totals)
    except NoMotionsError as failure:
        error, duration = failure.combined_error(), sufficient_duration(shortest)
        error.hint = f"the shortest motion that was found lasts {duration:.6g} s"
        raise error from None


def _duration_outside(task: TimingTask, segments: Iterable[TimingSegment]) -> float:
    """Duration of the motion outside some segments [s]."""
    durations = task.scenario.durations
    for segment in segments:
        durations[segment.waypoints[:-1]] = 0.0
    return float(durations.sum())


def _motions(
    task: TimingTask,
    segments: list[TimingSegment],
    objective: Objective,
    budget: Budget,
    totals: Mapping[TimingSegment, float] = MappingProxyType({}),
) -> dict[TimingSegment, TimedMotion]:
    motions: dict[TimingSegment, TimedMotion] = {}
    errors: dict[TimingSegment, TimingError] = {}
    for segment in segments:
        problem = timing_problem(task, segment, objective, totals.get(segment))
        ends = {earlier.waypoints[-1]: motions[earlier] for earlier in motions if earlier.way}
        if objective.only_time and segment not in totals and not problem.free.any():
            single = len(segment.waypoints) == 2
            problem = replace(problem, objective=SMOOTHEST if single else CALMEST)
        try:
            if segment.way is None:
                motions[segment] = solve_within(problem, budget)
            else:
                before = ends.get(segment.waypoints[0])
                start = None if before is None else before.trajectory.position(before.duration)
                motions[segment] = plan_clear_segment(task, segment, problem, budget, start)
        except TimingError as error:
            errors[segment] = error
    if errors:
        raise NoMotionsError(task, errors)
    return motions


def _total_too_short(task: TimingTask, shortest: float, *, stopped: bool) -> TimingError:
    """The error for a duration below that of the shortest motion found [s].

    Args:
        task: The task.
        shortest: Duration of that motion [s].
        stopped: Whether the budget ended before a shorter one could be found.
    """
    return TimingError(
        f"{task.free_values.total_duration:g} s is shorter than the minimum time found within the "
        f"limits, {rounded_up(shortest):.6g} s; "
        f"accepted: {sufficient_duration(shortest):.6g} s or more"
        f"{', or a larger budget' if stopped else ''}",
        limit="budget" if stopped else "duration",
        where=task.scenario.where("duration"),
    )


def located_in_segment(
    errors: Sequence[TimingError], task: TimingTask, segment: TimingSegment
) -> Sequence[TimingError]:
    """Add the locations in the file to errors of a segment."""
    for error in errors:
        error.where = task.scenario.name
        if error.waypoint is not None:
            error.where = task.where(segment.waypoints[error.waypoint + error.interval])
    return errors
