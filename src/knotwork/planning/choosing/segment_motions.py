"""Motions of all free segments, which share a budget and perhaps a total duration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from knotwork.arrays import FloatArray
from knotwork.errors import InputError, TimingError, merge_errors
from knotwork.planning.choosing.clear_segments import plan_clear_segment
from knotwork.planning.choosing.segments import FreeSegment, SolvedTask, timing_problem
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


class SegmentsUnsolvedError(Exception):
    """No motion was found for some segments.

    Attributes:
        solved: Their scenario and its IK solutions.
        errors: Reasons, by segment.
    """

    def __init__(self, solved: SolvedTask, errors: dict[FreeSegment, TimingError]) -> None:
        super().__init__()
        self.solved, self.errors = solved, errors

    def combined_error(self) -> InputError:
        """The combined error of all segments."""
        return merge_errors(
            [
                cause
                for segment, error in self.errors.items()
                for cause in located_in_segment((error, *error.others), self.solved, segment)
            ]
        )


def solve_segments(
    solved: SolvedTask, segments: list[FreeSegment], budget: Budget
) -> dict[FreeSegment, TimedMotion]:
    """Solve all segments, with the given total duration if there is one.

    Args:
        solved: The scenario and its IK solutions.
        segments: Its segments.
        budget: Budget and progress of all of them.

    Raises:
        SegmentsUnsolvedError: Some segments have no motion.
        TimingError: The total is too short.
    """
    free = solved.free_values
    objective = Objective(**{"time": 0.0, **free.objective})
    timed = [segment for segment in segments if free.duration_is_free[segment.waypoints[:-1]].any()]
    solved_twice = timed if free.total_duration is not None else []
    budget.begin(sum(len(segment.waypoints) - 1 for segment in segments + solved_twice))
    if free.total_duration is None:
        return _motions(solved, segments, objective, budget)
    fastest = _motions(solved, timed, Objective(), budget)
    outside = _duration_outside(solved, timed)
    shortest = outside + sum(motion.duration for motion in fastest.values())
    if free.total_duration < shortest:
        stopped = any(motion.status == "stopped" for motion in fastest.values())
        raise _total_too_short(solved, shortest, stopped=stopped)
    factor = (free.total_duration - outside) / (shortest - outside)
    totals = {segment: factor * motion.duration for segment, motion in fastest.items()}
    try:
        return _motions(solved, segments, objective, budget, totals)
    except SegmentsUnsolvedError as failure:
        error = failure.combined_error()
        error.hint = f"the shortest motion found lasts {rounded_up(shortest):.6g} s"
        raise error from None


def _duration_outside(solved: SolvedTask, segments: Iterable[FreeSegment]) -> float:
    """Duration of the motion outside some segments [s]."""
    durations = solved.scenario.durations
    for segment in segments:
        durations[segment.waypoints[:-1]] = 0.0
    return float(durations.sum())


def _motions(
    solved: SolvedTask,
    segments: list[FreeSegment],
    objective: Objective,
    budget: Budget,
    totals: Mapping[FreeSegment, float] = MappingProxyType({}),
) -> dict[FreeSegment, TimedMotion]:
    motions: dict[FreeSegment, TimedMotion] = {}
    errors: dict[FreeSegment, TimingError] = {}
    ends: dict[int, FloatArray] = {}  # of collision-free motions, which choose their solutions
    for segment in segments:
        problem = timing_problem(solved, segment, objective, totals.get(segment))
        if objective.only_time and segment not in totals and not problem.free.any():
            single = len(segment.waypoints) == 2
            problem = replace(problem, objective=SMOOTHEST if single else CALMEST)
        try:
            if segment.way_options is None:
                motions[segment] = solve_within(problem, budget)
            else:
                first, *_, last = segment.waypoints
                motion = plan_clear_segment(solved, segment, problem, budget, ends.get(first))
                motions[segment], ends[last] = motion, motion.trajectory.position(motion.duration)
        except TimingError as error:
            errors[segment] = error
    if errors:
        raise SegmentsUnsolvedError(solved, errors)
    return motions


def _total_too_short(solved: SolvedTask, shortest: float, *, stopped: bool) -> TimingError:
    """The error for a duration below that of the shortest motion found [s].

    Args:
        solved: The scenario and its IK solutions.
        shortest: Duration of that motion [s].
        stopped: Whether the budget ended before a shorter one could be found.
    """
    return TimingError(
        f"{solved.free_values.total_duration:g} s is shorter than the minimum time found within "
        f"the limits, {rounded_up(shortest):.6g} s; accepted: "
        f"{sufficient_duration(shortest):.6g} s or more"
        f"{', or a larger budget' if stopped else ''}",
        limit="budget" if stopped else "duration",
        where=solved.scenario.where("duration"),
    )


def located_in_segment(
    errors: Sequence[TimingError], solved: SolvedTask, segment: FreeSegment
) -> Sequence[TimingError]:
    """Add the locations in the file to errors of a segment."""
    for error in errors:
        error.where = solved.scenario.name
        if error.waypoint is not None:
            error.where = solved.where(segment.waypoints[error.waypoint + error.interval])
    return errors
