"""Numbers for the free values of a scenario, chosen section by section."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from knotwork.errors import InputError, merge_errors
from knotwork.planning.choosing.chosen_path_speeds import (
    active_path_limits,
    given_speeds_beyond_limits,
    path_speed_error,
    with_path_speeds,
)
from knotwork.planning.choosing.chosen_values import with_chosen_values
from knotwork.planning.choosing.free_section_motions import SectionsUnsolvedError, solve_sections
from knotwork.planning.choosing.free_sections import (
    FreeSection,
    FreeTask,
    assumed_jerk,
    find_sections,
)
from knotwork.planning.choosing.path_speed_problem import (
    ADJACENT_MOTION,
    NoSpeedsError,
    PathSpeedProblem,
)
from knotwork.planning.task_to_joint import TaskSolution
from knotwork.planning.timing import ActiveLimit, Objective, TimedMotion
from knotwork.planning.timing.infeasible import infeasible_values
from knotwork.planning.timing.timed_motion import Budget, Status, worst_status
from knotwork.task.scenario import Scenario

MAX_MOTIONS = 10
"""Maximum number of planned motions; in most cases one or two are sufficient."""

SLOWDOWN = 0.7
"""Factor on the speeds along paths that can't be reached or left at these speeds."""

MIN_GAIN = 0.01
"""Minimum expected gain of duration along the paths for another motion, as a fraction."""


@dataclass(frozen=True, eq=False)
class ChosenValues:
    """Values chosen by `choose_times` in place of free ones, and their quality.

    Attributes:
        requested: The scenario with free values.
        scenario: The scenario with numbers in place of them.
        solution: IK solutions, chosen before the times, which are valid only for them.
        sections: Motion of each free section.
        path_limits: Bounds of speeds chosen along tool paths.
        assumed_jerk: Jerk limits assumed for joints without one, by joint
            [rad/s³ or m/s³].
        fixed_arrivals: Names of waypoints in moving frames, whose times were chosen first.
    """

    requested: Scenario
    scenario: Scenario
    solution: TaskSolution
    sections: tuple[TimedMotion, ...] = ()
    path_limits: tuple[ActiveLimit, ...] = ()
    assumed_jerk: Mapping[str, float] = field(default_factory=dict)
    fixed_arrivals: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Duration of the whole motion [s]."""
        return float(np.ptp(self.scenario.times))

    @property
    def lower_bound(self) -> float:
        """Lower bound of the duration of any motion within the limits [s].

        It holds for the chosen speeds along tool paths; other speeds could be faster.
        """
        return self.duration - sum(motion.duration - motion.lower_bound for motion in self.sections)

    @property
    def status(self) -> Status:
        """`"optimal"`, `"budget"` or `"resting"`, the worst of the sections; see `TimedMotion`."""
        return worst_status(motion.status for motion in self.sections)

    @property
    def binding(self) -> tuple[ActiveLimit, ...]:
        """Active limits by interval."""
        return (*self.path_limits, *(limit for motion in self.sections for limit in motion.binding))

    @property
    def objective_values(self) -> dict[str, float]:
        """Value of each term of the objective, without its weight, by name."""
        values = Counter[str]()
        for motion in self.sections:
            values.update(motion.objective_values)
        return dict(values)

    @property
    def gap(self) -> float:
        """Duration above the lower bound, as a fraction of it."""
        return self.duration / self.lower_bound - 1.0

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain data, ready for JSON."""
        names = [waypoint.name for waypoint in self.scenario.waypoints]
        return {
            "duration": self.duration,
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            "status": self.status,
            "objective": self.objective_values,
            "assumed_jerk": dict(self.assumed_jerk),
            "times": dict(zip(names, self.scenario.times.tolist(), strict=True)),
            "binding": [asdict(limit) for limit in self.binding],
        }


def choose_times(
    scenario: Scenario, budget: Budget, solution: TaskSolution | None = None
) -> ChosenValues:
    """Choose the times, speeds and knots that a task leaves free.

    Constant speeds along tool paths come first: each is the maximum within the limits. Then the
    sections between tool paths and waits are solved independently, because position, velocity
    and acceleration are known at their ends. Where a path can't be followed within the limits,
    reached or left at these speeds, they are lowered until the motions exist. Other speeds are then
    tried while the total duration decreases and the budget lasts.

    Args:
        scenario: A scenario with free values.
        budget: Computing time after which the best motion so far is taken, and progress.
        solution: Solutions of the poses, if not the best.

    Raises:
        InputError: The task can't be free_task, or no motion within the limits was found.
    """
    free_task = FreeTask.solve(scenario, scenario.required_free_values, solution)
    free_paths = [k for k, path in enumerate(scenario.paths) if path.requested.at_most]
    paths = [PathSpeedProblem(free_task, k) for k in free_paths]
    adjacent = set[PathSpeedProblem]()
    best: ChosenValues | None = None
    error: InputError | None = None
    longest = np.inf
    for _ in range(MAX_MOTIONS):
        try:
            duration = sum(path.choose() for path in paths)
        except NoSpeedsError as no_speeds:
            error = error or path_speed_error(free_task, no_speeds)
            break
        if duration >= longest:
            break
        try:
            chosen = _choose_motions(scenario, with_path_speeds(free_task, paths), paths, budget)
        except NoSpeedsError as no_speeds:
            error = path_speed_error(free_task, no_speeds)
            continue
        except SectionsUnsolvedError as no_motions:
            error = no_motions.combined_error()
            adjacent |= _adjacent_paths(no_motions.errors, paths)
            if not adjacent:
                break
        except InputError as infeasible:
            error, longest = infeasible, (1.0 - MIN_GAIN) * duration
            continue
        else:
            if best is not None and best.duration <= chosen.duration:
                break
            best = chosen
            longest = np.inf if adjacent else (1.0 - MIN_GAIN) * duration
            if budget.is_over:
                break
        for path in adjacent:
            path.lower_caps(SLOWDOWN, ADJACENT_MOTION)
    if best is None:
        raise error or AssertionError("without a motion there is an error")
    return best


def _choose_motions(
    scenario: Scenario, free_task: FreeTask, paths: Sequence[PathSpeedProblem], budget: Budget
) -> ChosenValues:
    """Choose the motions of all sections, with known speeds along paths.

    Raises:
        SectionsUnsolvedError: Some sections have no motion.
        InputError: A given value is beyond a limit.
    """
    sections = find_sections(free_task)
    _check_given(free_task, sections, paths)
    motions = solve_sections(free_task, sections, budget)
    return ChosenValues(
        requested=scenario,
        scenario=with_chosen_values(free_task, motions),
        solution=free_task.solution,
        sections=tuple(motions.values()),
        path_limits=active_path_limits(free_task, paths),
        assumed_jerk=assumed_jerk(free_task.joints),
    )


def _adjacent_paths(
    sections: Iterable[FreeSection], paths: Iterable[PathSpeedProblem]
) -> set[PathSpeedProblem]:
    """The paths with chosen speeds that begin or end where one of some sections does."""
    ends = {section.waypoints[k] for section in sections for k in (0, -1)}
    return {problem for problem in paths if ends & {problem.path.first, problem.path.last}}


def _check_given(
    free_task: FreeTask, sections: Sequence[FreeSection], paths: Sequence[PathSpeedProblem]
) -> None:
    """Refuse given values beyond a limit, and too short times.

    Speeds along paths come first, because sections begin and end with them.

    Raises:
        InputError: A given value is infeasible.
    """
    if errors := given_speeds_beyond_limits(free_task, paths):
        raise merge_errors(errors)
    for section in sections:
        problem = section.timing_problem(Objective())
        errors += section.located(infeasible_values(problem, direct=section.way is None))
    if errors:
        raise merge_errors(errors)
