"""Numbers for the unknowns of a scenario, chosen section by section."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from knotwork.errors import InputError, merge_errors
from knotwork.errors.old_names import OldAttribute
from knotwork.planning.choosing.chosen_path_speeds import (
    PathSpeeds,
    given_speeds_beyond_limits,
    maximum_path_speeds,
)
from knotwork.planning.choosing.frozen_task import with_chosen_values
from knotwork.planning.choosing.path_speed_problem import PathSpeedProblem, path_speed_problems
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.choosing.solving_sections import SectionsUnsolvedError, solve_sections
from knotwork.planning.choosing.timing_sections import TimingSection, assumed_jerk, find_sections
from knotwork.planning.task_to_joint import TaskSolution
from knotwork.planning.timing import ActiveLimit, Objective, TimedMotion
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.infeasible import infeasible_values
from knotwork.planning.timing.timed_motion import Status, worst_status
from knotwork.task.scenario import Scenario

MAX_SLOWDOWNS = 9
"""Maximum number of times that paths are slowed down until they can be reached and left."""


@dataclass(frozen=True, eq=False)
class ChosenValues:
    """Values chosen by `choose_values` in place of unknowns, and their quality.

    Attributes:
        original_scenario: The scenario with unknowns.
        scenario: The scenario with numbers in place of them.
        solution: IK solutions, chosen before the times. The times hold only for them.
        sections: Motion of each timing section.
        path_limits: Bounds of speeds chosen along tool paths.
        assumed_jerk: Jerk limits assumed for joints without one, by joint [rad/s³ or m/s³].
    """

    original_scenario: Scenario
    scenario: Scenario
    solution: TaskSolution
    sections: tuple[TimedMotion, ...] = ()
    path_limits: tuple[ActiveLimit, ...] = ()
    assumed_jerk: Mapping[str, float] = field(default_factory=dict)

    requested = OldAttribute("original_scenario")
    gap = OldAttribute("optimality_gap")

    @property
    def fixed_arrivals(self) -> tuple[str, ...]:
        """Names of the waypoints in moving frames, whose times were chosen first."""
        unknowns = self.original_scenario.required_unknowns
        return tuple(
            self.original_scenario.waypoints[i].name
            for i in unknowns.time_dependent
            if unknowns.at_waypoints[i].duration_is_unknown
        )

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
    def active_limits(self) -> tuple[ActiveLimit, ...]:
        """Active limits by interval."""
        of_sections = (limit for motion in self.sections for limit in motion.active_limits)
        return (*self.path_limits, *of_sections)

    @property
    def objective_values(self) -> dict[str, float]:
        """Value of each term of the objective, without its weight, by name."""
        values = Counter[str]()
        for motion in self.sections:
            values.update(motion.objective_values)
        return dict(values)

    @property
    def optimality_gap(self) -> float:
        """Duration above the lower bound, as a fraction of it."""
        return self.duration / self.lower_bound - 1.0

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain data, ready for JSON."""
        names = [waypoint.name for waypoint in self.scenario.waypoints]
        return {
            "duration": self.duration,
            "lower_bound": self.lower_bound,
            "gap": self.optimality_gap,
            "status": self.status,
            "objective": self.objective_values,
            "assumed_jerk": dict(self.assumed_jerk),
            "times": dict(zip(names, self.scenario.times.tolist(), strict=True)),
            "binding": [asdict(limit) for limit in self.active_limits],
        }


def choose_values(solved: SolvedScenario, budget: Budget) -> ChosenValues:
    """Choose the times, speeds and knots that a task leaves to planning.

    Constant speeds along tool paths come first: each is the maximum within the limits. Then the
    sections between tool paths and waits are solved independently, because position, velocity
    and acceleration are known at their ends. Where a path can't be reached or left at its speeds,
    they are lowered until the motions exist, and then while the total duration decreases and the
    budget lasts.

    Args:
        solved: A scenario with unknowns, and solutions of its poses.
        budget: Computing time after which the best motion so far is taken, and progress.

    Raises:
        InputError: No motion within the limits was found.
    """
    speeds, values = _values_at_maximum_speeds(solved, path_speed_problems(solved), budget)
    while (slower := speeds.slower_problems()) and not budget.has_ended:
        try:
            speeds, other = _values_at_maximum_speeds(solved, slower, budget)
        except InputError:
            break
        if other.duration >= values.duration:
            break
        values = other
    return values


def _values_at_maximum_speeds(
    solved: SolvedScenario, problems: Sequence[PathSpeedProblem], budget: Budget
) -> tuple[PathSpeeds, ChosenValues]:
    """Choose the maximum speeds along paths, or the next lower ones with motions between them.

    Raises:
        InputError: There are none.
    """
    for _ in range(MAX_SLOWDOWNS + 1):
        speeds = maximum_path_speeds(solved, problems, budget)
        try:
            return speeds, _values_at_speeds(speeds, budget)
        except SectionsUnsolvedError as error:
            unsolved = error
        problems = speeds.slower_problems(unsolved.sections)
        if not problems:
            break
    raise unsolved.error


def _values_at_speeds(speeds: PathSpeeds, budget: Budget) -> ChosenValues:
    """Choose the motions of all sections, with known speeds along paths.

    Raises:
        SectionsUnsolvedError: Some sections have no motion.
        InputError: A given value is beyond a limit.
    """
    solved = speeds.solved
    sections = find_sections(solved)
    _check_given(speeds, sections)
    motions = solve_sections(solved, sections, budget)
    return ChosenValues(
        original_scenario=solved.original_scenario,
        scenario=with_chosen_values(solved, motions),
        solution=solved.solution,
        sections=tuple(motions.values()),
        path_limits=speeds.active_limits,
        assumed_jerk=assumed_jerk(solved.joints),
    )


def _check_given(speeds: PathSpeeds, sections: Sequence[TimingSection]) -> None:
    """Refuse given values beyond a limit, and too short times.

    Speeds along paths come first, because sections begin and end with them.

    Raises:
        InputError: A given value is infeasible.
    """
    if errors := given_speeds_beyond_limits(speeds):
        raise merge_errors(errors)
    for section in sections:
        problem = section.timing_problem(Objective())
        errors += section.located(infeasible_values(problem, direct=section.way is None))
    if errors:
        raise merge_errors(errors)
