"""The chosen speeds along the tool paths of a task, in the task, and errors of given speeds."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knotwork.errors import FollowingError, InputError, PathError
from knotwork.planning.choosing.frozen_task import solutions_near
from knotwork.planning.choosing.path_limit_utilisation import path_state_limits, planned_utilisation
from knotwork.planning.choosing.path_speed_problem import (
    PathSpeedProblem,
    PathSpeeds,
    Reason,
    SpeedError,
    round_speed,
)
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.choosing.timing_sections import TimingSection
from knotwork.planning.timing import ActiveLimit
from knotwork.planning.timing.budget import Budget
from knotwork.task.scenario.resolve import change_task
from knotwork.units import rounded_up
from knotwork.verification.limits import LIMIT_SLACK

MAX_MOTIONS = 10
"""Maximum number of motions along the paths; in most cases one or two are sufficient."""

MIN_GAIN = 0.01
"""Minimum expected gain of duration along the paths for another motion, as a fraction."""

SLOWDOWN = 0.7
"""Factor on the speeds along paths that can't be reached or left at these speeds."""


@dataclass(frozen=True, eq=False)
class AllPathSpeeds:
    """Speeds along all paths of a task with chosen ones, and what the motion along them shows.

    Attributes:
        solved: The task with these speeds, or without them where a path can't be followed.
        by_path: The speeds along each of these paths, and the problem of lower ones.
    """

    solved: SolvedScenario
    by_path: Sequence[PathSpeeds]

    @property
    def errors(self) -> list[SpeedError]:
        """Limits that the motion along the paths exceeds."""
        return [path_speeds.error for path_speeds in self.by_path if path_speeds.error is not None]

    @property
    def active_limits(self) -> tuple[ActiveLimit, ...]:
        """Bounds of the chosen speeds."""
        names = [waypoint.name for waypoint in self.solved.scenario.waypoints]
        limits = []
        for path_speeds in self.by_path:
            for stretch, (_, bound) in path_speeds.by_stretch.items():
                i = path_speeds.problem.path.first + stretch
                subject, quantity = ("", bound) if isinstance(bound, Reason) else bound
                limits.append(ActiveLimit(names[i], names[i + 1], subject, quantity, None))
        return tuple(limits)

    def slower_problems(self, sections: Iterable[TimingSection] = ()) -> list[PathSpeedProblem]:
        """The problems with lower speeds where sections without a motion begin or end.

        Paths that are slow for this reason already are slowed down further.

        Returns:
            The problems; none if no path is slowed down.
        """
        ends = {section.indices[k] for section in sections for k in (0, -1)}
        problems = [path_speeds.problem for path_speeds in self.by_path]
        slower = [
            path_speeds.slower_problem(SLOWDOWN, Reason.ADJACENT_MOTION)
            if ends & {path_speeds.problem.path.first, path_speeds.problem.path.last}
            or any(bound is Reason.ADJACENT_MOTION for _, bound in path_speeds.by_stretch.values())
            else path_speeds.problem
            for path_speeds in self.by_path
        ]
        return [] if slower == problems else slower


def maximum_path_speeds(
    solved: SolvedScenario, problems: Sequence[PathSpeedProblem], budget: Budget
) -> AllPathSpeeds:
    """Find the maximum speeds with which the motion along the paths keeps all limits.

    Each motion corrects the problems of the next one, as long as the speeds are infeasible, or
    the expected gain is large and the budget lasts.

    Args:
        solved: The scenario, in which these speeds are unknown.
        problems: The problems of its paths.
        budget: Budget of all motions.

    Raises:
        InputError: No speeds are feasible.
    """
    feasible: list[AllPathSpeeds] = []
    errors: list[SpeedError] = []
    longest = math.inf
    for _ in range(MAX_MOTIONS):
        try:
            by_path = [problem.choose() for problem in problems]
        except SpeedError as error:
            errors = errors or [error]
            break
        duration = sum(path_speeds.timing.duration for path_speeds in by_path)
        if feasible and (duration >= longest or budget.has_ended):
            break
        speeds = _planned_and_corrected(solved, by_path)
        problems = [path_speeds.problem for path_speeds in speeds.by_path]
        if speeds.errors:
            errors = speeds.errors
        else:
            feasible.append(speeds)
            longest = (1.0 - MIN_GAIN) * duration
    if not feasible:
        raise path_speed_error(solved, errors[0])
    return feasible[-1]


def _planned_and_corrected(solved: SolvedScenario, by_path: Sequence[PathSpeeds]) -> AllPathSpeeds:
    """Plan the motion along the paths with chosen speeds, and correct their problems."""
    try:
        timed = _with_speeds(solved, by_path)
    except (PathError, FollowingError) as blocked:
        starts = {path_speeds.problem.path.first for path_speeds in by_path}
        blocked_starts = starts & {blocked.path_start} or starts
        slower = [
            speeds.without_motion(blocked)
            if speeds.problem.path.first in blocked_starts
            else speeds
            for speeds in by_path
        ]
        return AllPathSpeeds(solved, slower)
    return AllPathSpeeds(timed, [path_speeds.corrected(timed) for path_speeds in by_path])


def _with_speeds(solved: SolvedScenario, by_path: Sequence[PathSpeeds]) -> SolvedScenario:
    """The task with chosen speeds along its paths, solved."""
    if not by_path:
        return solved
    scenario = solved.scenario
    changes: defaultdict[int, dict[str, Any]] = defaultdict(dict, solutions_near(solved))
    for path_speeds in by_path:
        for stretch, (speed, _) in path_speeds.by_stretch.items():
            end = scenario.task_index[path_speeds.problem.path.first + 1 + stretch]
            changes[end]["speed"] = round_speed(scenario.units.per_metre * speed)
    with_speeds = change_task(scenario, scenario.task.with_waypoints(changes))
    return SolvedScenario.solve(with_speeds, solved)


def given_speeds_beyond_limits(speeds: AllPathSpeeds) -> list[InputError]:
    """Errors for given speeds that exceed a limit along a path.

    Args:
        speeds: The chosen speeds. Paths with a chosen speed are left out, because their given
            speeds were checked with it.
    """
    errors: list[InputError] = []
    solved = speeds.solved
    chosen_paths = {path_speeds.problem.number for path_speeds in speeds.by_path}
    for number, path in enumerate(solved.scenario.paths):
        if number in chosen_paths:
            continue
        limits = path_state_limits(solved, path)
        utilisations = planned_utilisation(solved, path, limits).max(axis=1)
        for stretch in np.flatnonzero((utilisations > 1.0 + LIMIT_SLACK).any(axis=1)).tolist():
            limit = limits.quantities[int(utilisations[stretch].argmax())]
            worst = float(utilisations[stretch].max())
            errors.append(path_speed_error(solved, SpeedError(path, stretch, limit), worst))
    return errors


def path_speed_error(
    solved: SolvedScenario, error: SpeedError, utilisation: float | None = None
) -> InputError:
    """The error for a stretch of a path without feasible speeds, with accepted changes.

    Args:
        solved: The scenario and its IK solutions.
        error: The stretch and the exceeded limit.
        utilisation: Utilisation of the limit, if known.
    """
    path, stretch, bound = error.path, error.stretch, error.bound
    i = path.first + 1 + stretch
    if bound is Reason.NOTHING:
        return InputError(
            "nothing bounds the speed of the path; accepted: speed: {at_most: a speed}, or limits",
            where=solved.where(i, "speed"),
        )
    text = solved.scenario.units.text
    start, end = (waypoint.name for waypoint in solved.scenario.waypoints[i - 1 : i + 1])
    requested = path.requested
    is_chosen = stretch in requested.max_speeds
    duration = requested.durations[stretch]
    given = requested.speeds[stretch] or path.stretches[stretch].speed
    if requested.max_speeds and duration:  # the stretches still have the nominal speed
        given = requested.lengths[stretch] / duration
    speed = "no speed keeps the limits" if is_chosen else f"at {text(given, 'm/s')}"
    if path.timed_path.has_own_clock:
        weave = path.stretches[stretch].weave
        accepted = "a slower frame" if weave is None else "a narrower weave, a lower frequency"
    elif is_chosen:
        accepted = "another path or path.acceleration"
    else:
        accepted = "speed: fastest"
    last = "a higher limit"
    if bound is Reason.PATH_ACCELERATION:
        shown = text(requested.acceleration, "m/s²")
        reason = f"the stretch is too short to change speed at path.acceleration, {shown}"
        accepted += ", a higher path.acceleration"
    elif isinstance(bound, Reason):
        cause = f" ({error.__cause__})" if error.__cause__ else ""
        reason = f"the tolerances are not kept{cause}"
        accepted, last = "larger tolerances of the path", "another path"
    else:
        excess = f"reaches {rounded_up(utilisation, 4):.4g} times" if utilisation else "exceeds"
        subject = repr(bound.subject) if bound.subject else "the tool"
        reason = f"{subject} {excess} its limit of {bound.quantity.replace('_', ' ')}"
    return InputError(
        f"{speed} along the path from {start!r} to {end!r}: {reason}; accepted: {accepted}, or "
        f"{last}",
        where=solved.where(i, _key(solved, i)),
    )


def _key(solved: SolvedScenario, i: int) -> str:
    """The key that gives the speed to waypoint i, on a path."""
    given = solved.scenario.task.waypoints[solved.scenario.task_index[i]]
    return next(key for key in ("speed", "after", "time") if getattr(given, key) is not None)
