"""Numbers for the unknowns of a scenario, chosen segment by segment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from knotwork.errors import merge_errors
from knotwork.planning.choosing.chosen_path_speeds import (
    ChosenPathSpeeds,
    paths_beyond_limits,
    with_max_speeds,
)
from knotwork.planning.choosing.chosen_values import with_chosen_values
from knotwork.planning.choosing.segment_motions import (
    NoMotionsError,
    located_in_segment,
    solve_segments,
)
from knotwork.planning.choosing.segments import (
    TimingSegment,
    assumed_jerk,
    find_segments,
    timing_problem,
)
from knotwork.planning.task_to_joint import TaskSolution
from knotwork.planning.timing import Binding, Objective, TimedMotion
from knotwork.planning.timing.infeasible import infeasible_values
from knotwork.planning.timing.timed_motion import Budget, Status, status_of
from knotwork.task.scenario import Scenario

MAX_SLOWDOWNS, SLOWDOWN = 6, 0.7
"""Number of times that path speeds are lowered for the motions next to them, and the factor: the
last speeds are an eighth of the maximum.
"""


@dataclass(frozen=True, eq=False)
class ChosenTimes:
    """The numbers chosen for the unknowns of a scenario, and how good they are.

    Attributes:
        requested: The scenario with unknowns.
        scenario: The scenario with numbers in place of its unknowns.
        solution: IK solutions, chosen before the times, which are valid only for them.
        segments: Motion of each segment.
        path_limits: Limiting constraints of speeds chosen along tool paths.
        assumed_jerk: Jerk limits assumed for joints without one, by joint
            [rad/s³ or m/s³].
        fixed_arrivals: Names of waypoints in moving frames, whose times were chosen first.
    """

    requested: Scenario
    scenario: Scenario
    solution: TaskSolution
    segments: tuple[TimedMotion, ...] = ()
    path_limits: tuple[Binding, ...] = ()
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
        return self.duration - sum(motion.duration - motion.lower_bound for motion in self.segments)

    @property
    def status(self) -> Status:
        """`"optimal"`, `"stopped"` or `"resting"`, the worst of the segments; see `TimedMotion`."""
        return status_of(motion.status for motion in self.segments)

    @property
    def binding(self) -> tuple[Binding, ...]:
        """Limiting constraints by interval."""
        return (*self.path_limits, *(limit for motion in self.segments for limit in motion.binding))

    @property
    def objective(self) -> dict[str, float]:
        """Value of each term of the objective, without its weight, by name."""
        values = Counter[str]()
        for motion in self.segments:
            values.update(motion.objective)
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
            "objective": self.objective,
            "assumed_jerk": dict(self.assumed_jerk),
            "times": dict(zip(names, self.scenario.times.tolist(), strict=True)),
            "binding": [asdict(limit) for limit in self.binding],
        }


def choose_times(
    scenario: Scenario, budget: Budget, solution: TaskSolution | None = None
) -> ChosenTimes:
    """Choose the unknowns of a scenario.

    Constant speeds along tool paths come first: each is the maximum within the limits. Then the
    segments between tool paths and waits are solved independently, because position, velocity
    and acceleration are known at their ends. Where a path can't be reached or left at these speeds,
    they are lowered until the motions exist, and further while the total duration decreases and the
    budget lasts.

    Args:
        scenario: A task with unknowns.
        budget: Computing time after which the best motion so far is taken, and progress.
        solution: Solutions of the poses, if not the best.

    Raises:
        InputError: The task can't be solved, or no motion within the limits was found.
    """
    caps: dict[int, float] = {}
    best: ChosenTimes | None = None
    adjacent: set[int] = set()
    for slowdowns in range(MAX_SLOWDOWNS + 1):
        paths = with_max_speeds(scenario, solution, caps)
        try:
            chosen = _choose_motions(scenario, paths, budget)
        except NoMotionsError as error:
            adjacent |= _adjacent_stretches(error.errors, paths)
            if best is None and (not adjacent or slowdowns == MAX_SLOWDOWNS):
                raise error.combined_error() from None
        else:
            if best is not None and best.duration <= chosen.duration:
                break
            best = chosen
        if best is not None and (not adjacent or budget.is_over):
            break
        caps = {i: SLOWDOWN * paths.speeds[i] for i in adjacent}
    if best is None:
        raise AssertionError("without a motion the last error was raised")
    return best


def _choose_motions(scenario: Scenario, paths: ChosenPathSpeeds, budget: Budget) -> ChosenTimes:
    """Choose the motions of all segments, with known speeds along paths.

    Raises:
        NoMotionsError: Some segments have no motion.
        InputError: A given value is beyond a limit.
    """
    task, segments = paths.task, find_segments(paths.task)
    _check_given(paths, segments)
    motions = solve_segments(task, segments, budget)
    return ChosenTimes(
        requested=scenario,
        scenario=with_chosen_values(task, motions),
        solution=task.solution,
        segments=tuple(motions.values()),
        path_limits=paths.binding,
        assumed_jerk=assumed_jerk(task.space),
    )


def _adjacent_stretches(segments: Iterable[TimingSegment], paths: ChosenPathSpeeds) -> set[int]:
    """The waypoints at the ends of stretches with chosen speeds, on paths next to segments."""
    ends = {segment.waypoints[k] for segment in segments for k in (0, -1)}
    return {
        i
        for path in paths.task.scenario.paths
        if ends & {path.first, path.last}
        for i in range(path.first + 1, path.last + 1)
        if i in paths.speeds
    }


def _check_given(paths: ChosenPathSpeeds, segments: Sequence[TimingSegment]) -> None:
    """Refuse given values beyond a limit, and too short times.

    Speeds along paths come first, because segments begin and end with them.

    Raises:
        InputError: A given value is infeasible.
    """
    task, errors = paths.task, paths_beyond_limits(paths)
    if errors:
        raise merge_errors(errors)
    for segment in segments:
        problem = timing_problem(task, segment, Objective())
        causes = infeasible_values(problem, direct=segment.way is None)
        errors += located_in_segment(causes, task, segment)
    if errors:
        raise merge_errors(errors)
