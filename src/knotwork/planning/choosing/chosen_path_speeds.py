"""The chosen speeds along the tool paths of a task, in the task, and errors of given speeds."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from knotwork.errors import FollowingError, InputError, PathError
from knotwork.planning.choosing.frozen_task import solutions_near
from knotwork.planning.choosing.path_limit_utilisation import path_state_limits, planned_utilisation
from knotwork.planning.choosing.path_speed_problem import (
    MIN_SPEED_FACTOR,
    PathSpeedProblem,
    SpeedBound,
    path_speed_error,
    round_speed,
)
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.choosing.timing_sections import TimingSection
from knotwork.planning.timing import ActiveLimit
from knotwork.planning.timing.budget import Budget
from knotwork.task.scenario.resolve import change_task
from knotwork.verification.limits import LIMIT_SLACK

MAX_MOTIONS = 10
"""Maximum number of motions along the paths; in most cases one or two are sufficient."""

MIN_GAIN = 0.01
"""Minimum expected gain of duration along the paths for another motion, as a fraction."""

SLOWDOWN = 0.7
"""Factor on the speeds along paths that can't be reached or left at these speeds."""


@dataclass(frozen=True, eq=False)
class PathSpeeds:
    """Chosen speeds along the paths of a task, and what the motion along them shows.

    Attributes:
        solved: The task with these speeds, or without them where a path can't be followed.
        problems: The problem of each path with chosen speeds, whose solution they are.
        corrected_problems: The same, corrected by the motion, in the same order.
        error: The error if the motion exceeds a limit or leaves the path, or `None`.
    """

    solved: SolvedScenario
    problems: Sequence[PathSpeedProblem]
    corrected_problems: Sequence[PathSpeedProblem]
    error: InputError | None

    @property
    def active_limits(self) -> tuple[ActiveLimit, ...]:
        """Bounds of the chosen speeds."""
        names = [waypoint.name for waypoint in self.solved.scenario.waypoints]
        limits = []
        for problem in self.problems:
            for stretch, (_, bound) in problem.speeds.items():
                i = problem.path.first + stretch
                subject, quantity = ("", bound.value) if isinstance(bound, SpeedBound) else bound
                limits.append(ActiveLimit(names[i], names[i + 1], subject, quantity, None))
        return tuple(limits)

    def slower_problems(self, sections: Iterable[TimingSection] = ()) -> list[PathSpeedProblem]:
        """The problems with lower speeds where sections without a motion begin or end.

        Paths that are slow for this reason already are slowed down further.

        Returns:
            The problems; none if no path is slowed down.
        """
        ends = {section.indices[k] for section in sections for k in (0, -1)}
        slower = list(self.corrected_problems)
        for k, problem in enumerate(self.problems):
            bounds = {bound for _, bound in problem.speeds.values()}
            touches = {problem.path.first, problem.path.last} & ends
            if touches or SpeedBound.ADJACENT_MOTION in bounds:
                caps = problem.slower_caps(SLOWDOWN, SpeedBound.ADJACENT_MOTION)
                slower[k] = replace(slower[k], caps=caps)
        return [] if slower == self.corrected_problems else slower


def maximum_path_speeds(
    solved: SolvedScenario, problems: Sequence[PathSpeedProblem], budget: Budget
) -> PathSpeeds:
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
    feasible: list[PathSpeeds] = []
    errors: list[InputError] = []
    longest = math.inf
    for _ in range(MAX_MOTIONS):
        try:
            duration = sum(problem.timing.duration for problem in problems)
        except InputError as error:
            errors = errors or [error]
            break
        if feasible and (duration >= longest or budget.has_ended):
            break
        planned = _plan_paths(solved, problems)
        problems = planned.corrected_problems
        if planned.error is not None:
            errors = [planned.error]
        else:
            feasible.append(planned)
            longest = (1.0 - MIN_GAIN) * duration
    if not feasible:
        raise errors[0]
    return feasible[-1]


def _plan_paths(solved: SolvedScenario, problems: Sequence[PathSpeedProblem]) -> PathSpeeds:
    """Plan the motion along the paths with their maximum speeds, and correct their problems."""
    try:
        timed = _with_speeds(solved, problems)
    except (PathError, FollowingError) as blocked:
        starts = {problem.path.first for problem in problems}
        blocked_starts = starts & {blocked.path_start} or starts
        lowered, errors = [], []
        for problem in problems:
            if problem.path.first in blocked_starts:
                bound = SpeedBound.TOLERANCES
                errors.append(path_speed_error(solved, problem.path, 0, bound, cause=blocked))
                caps = problem.slower_caps(MIN_SPEED_FACTOR, bound)
                problem = replace(problem, caps=caps)
            lowered.append(problem)
        return PathSpeeds(solved, problems, lowered, errors[0])
    corrected = [problem.corrected(timed) for problem in problems]
    first_error = next((error for _, error in corrected if error is not None), None)
    return PathSpeeds(timed, problems, [problem for problem, _ in corrected], first_error)


def _with_speeds(solved: SolvedScenario, problems: Sequence[PathSpeedProblem]) -> SolvedScenario:
    """The task with the maximum speeds along its paths, solved."""
    if not problems:
        return solved
    scenario = solved.scenario
    changes: defaultdict[int, dict[str, Any]] = defaultdict(dict, solutions_near(solved))
    for problem in problems:
        for stretch, (speed, _) in problem.speeds.items():
            end = scenario.task_index[problem.path.first + 1 + stretch]
            changes[end]["speed"] = round_speed(scenario.units.per_metre * speed)
    with_speeds = change_task(scenario, scenario.task.with_waypoints(changes))
    return SolvedScenario.solve(with_speeds, solved)


def given_speeds_beyond_limits(speeds: PathSpeeds) -> list[InputError]:
    """Errors for given speeds that exceed a limit along a path.

    Args:
        speeds: The chosen speeds. Paths with a chosen speed are left out, because their given
            speeds were checked with it.
    """
    errors: list[InputError] = []
    solved = speeds.solved
    chosen_paths = {problem.number for problem in speeds.problems}
    for number, path in enumerate(solved.scenario.paths):
        if number in chosen_paths:
            continue
        limits = path_state_limits(solved, path)
        utilisations = planned_utilisation(solved, path, limits).max(axis=1)
        for stretch in np.flatnonzero((utilisations > 1.0 + LIMIT_SLACK).any(axis=1)).tolist():
            limit = limits.quantities[int(utilisations[stretch].argmax())]
            worst = float(utilisations[stretch].max())
            errors.append(path_speed_error(solved, path, stretch, limit, utilisation=worst))
    return errors
