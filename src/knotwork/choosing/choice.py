"""The choice of what a scenario leaves free, run by run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from knotwork.choosing.faults import check_given, given_time, located_in_run, total_too_short
from knotwork.choosing.given_speeds import paths_without_room, tell
from knotwork.choosing.numbers import numbers
from knotwork.choosing.passing import Passing, at_greatest_speeds, at_lower_speeds
from knotwork.choosing.runs import Run, assumed_jerk, find_runs, timing_problem
from knotwork.choosing.task import FreeTask
from knotwork.documents import Document, Edits, edited
from knotwork.errors import InputError, TimingError, together
from knotwork.scenario import FreeTimes, Scenario, scenario_of
from knotwork.task_to_joint import TaskSolution
from knotwork.timing import Binding, Objective, Progress, TimedMotion
from knotwork.timing.budget import Watch
from knotwork.timing.infeasible_values import with_room
from knotwork.timing.motion import Status, status_of
from knotwork.timing.problem import PEAKS
from knotwork.timing.solving import NoMotionError, solved


@dataclass(frozen=True, eq=False)
class ChosenTimes:
    """What was chosen, and how good it is.

    Attributes:
        document: What the scenario with free times was read from.
        scenario: The scenario with numbers in place of all that was free.
        edits: What makes it of the one with free times.
        solution: How the solutions of the poses were chosen, before the times were.
        duration: Of the whole motion [s].
        lower_bound: No motion that does what is asked within the limits is shorter [s]; where
            speeds along tool paths were chosen, none with these speeds.
        status: `"optimal"`; `"stopped"` where the budget ended first; or `"resting"` where no
            start led to a solution and the arm comes to rest between waypoints.
        binding: Where which limit is met.
        assumed_jerk: Bounds of jerk that were assumed for joints without a limit of it, by joint
            [rad/s³ or m/s³].
        objective: Value of each term that has a weight, by name.
        runs: What was found for each run.
    """

    document: Document
    scenario: Scenario
    edits: Edits
    solution: TaskSolution
    duration: float
    lower_bound: float
    status: Status
    binding: tuple[Binding, ...]
    objective: dict[str, float]
    runs: tuple[TimedMotion, ...] = ()
    assumed_jerk: Mapping[str, float] = field(default_factory=dict)

    @property
    def gap(self) -> float:
        """How much longer it is than the lower bound, as a part of that."""
        return self.duration / self.lower_bound - 1.0

    def to_dict(self) -> dict[str, Any]:
        """Give what was chosen as plain data, ready for JSON."""
        names = [waypoint.name for waypoint in self.scenario.waypoints]
        return {
            "duration": self.duration,
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            "status": self.status,
            "objective": self.objective,
            "assumed_jerk": dict(self.assumed_jerk),
            "times": dict(zip(names, self.scenario.times.tolist(), strict=True)),
            "binding": [
                {
                    "start": one.start,
                    "end": one.end,
                    "joint": one.joint,
                    "quantity": one.quantity,
                    "share": one.share,
                }
                for one in self.binding
            ],
        }


def choose_times(
    scenario: Scenario,
    free: FreeTimes,
    *,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
    solution: TaskSolution | None = None,
    warm: ChosenTimes | None = None,
) -> ChosenTimes:
    """Choose what a scenario leaves free.

    Constant speeds of tool paths come first: each is the greatest that the limits allow. Then the
    runs between tool paths and waits are solved, each by itself, because position, velocity and
    acceleration are known where they meet.

    Args:
        scenario: The task.
        free: What it leaves to be chosen.
        budget: Time after which the best motion so far is taken [s].
        progress: Called as the solver goes on.
        solution: Solutions of the poses, if not the best.
        warm: What was chosen for a task that differs little, to start from where it fits.

    Raises:
        InputError: The task can't be solved, or no motion that keeps the limits was found.
    """
    watch = Watch(progress, budget)
    if free.path_speed:  # beside given ones that leave no room there may be none
        tell(one for errors in paths_without_room(scenario).values() for one in errors)
    try:
        passing, found = _found(scenario, free, solution, watch, warm)
    except _NoMotionsError as failed:
        raise failed.told() from None
    task, asked = passing.task, free.document
    edits = passing.edits | numbers(task, found)
    scenario = scenario_of(edited(asked, edits))
    duration = float(scenario.times[-1] - scenario.times[0])
    in_runs = sum(motion.duration for _, motion in found)
    least = sum(motion.lower_bound for _, motion in found)
    parts = [motion.status for _, motion in found]
    objective: dict[str, float] = {}
    for _, motion in found:
        for name, value in motion.objective.items():
            before = objective.get(name, 0.0)
            objective[name] = max(before, value) if name in PEAKS else before + value
    return ChosenTimes(
        document=asked,
        scenario=scenario,
        edits=edits,
        solution=passing.solution,
        duration=duration,
        lower_bound=duration - in_runs + least,
        status="stopped" if passing.stopped else status_of(parts),
        binding=(*passing.binding, *(binding for _, motion in found for binding in motion.binding)),
        objective=objective,
        runs=tuple(motion for _, motion in found),
        assumed_jerk=assumed_jerk(task.space),
    )


SMOOTHEST = Objective(time=0.0, jerk=1.0)
"""What is made least where all times are given."""


class _NoMotionsError(Exception):
    """No motion was found for some runs.

    Attributes:
        task: The task that has them.
        errors: Why, by run.
    """

    def __init__(self, task: FreeTask, errors: dict[Run, NoMotionError]) -> None:
        super().__init__()
        self.task, self.errors = task, errors

    def told(self) -> InputError:
        """What may be the cause, for all runs together."""
        located = [
            located_in_run(error.causes, self.task, run) for run, error in self.errors.items()
        ]
        return together([one for causes in located for one in causes])


def _found(
    scenario: Scenario,
    free: FreeTimes,
    solution: TaskSolution | None,
    watch: Watch,
    warm: ChosenTimes | None,
) -> tuple[Passing, list[tuple[Run, TimedMotion]]]:
    """Speeds along paths, the greatest ones if they will do, and the motions of the runs."""

    def motions(passing: Passing) -> list[tuple[Run, TimedMotion]]:
        task = passing.task
        runs = find_runs(task)
        check_given(task, free, runs)
        return _solved(task, runs, watch, _starts(task, runs, warm))

    greatest = at_greatest_speeds(scenario, free, solution, watch)
    try:
        return greatest, motions(greatest)
    except _NoMotionsError as failed:
        runs = list(failed.errors)
        slower = at_lower_speeds(scenario, free, solution, greatest, runs, watch)
        if slower is None:
            raise
    return slower, motions(slower)


def _starts(task: FreeTask, runs: list[Run], warm: ChosenTimes | None) -> dict[Run, TimedMotion]:
    """Motions to start from, by run; none where the runs are others than those of before."""
    before = () if warm is None else warm.runs
    same = [len(run.waypoints) for run in runs] == [len(one.time) for one in before]
    joints = task.space.joint_names
    if not same or any(one.trajectory.joint_names != joints for one in before):
        return {}
    return dict(zip(runs, before, strict=True))


def _solved(
    task: FreeTask, runs: list[Run], watch: Watch, starts: Mapping[Run, TimedMotion]
) -> list[tuple[Run, TimedMotion]]:
    free, scenario = task.free, task.scenario
    weights = {"time": 0.0, **free.objective}
    objective = Objective(**weights)

    def found_for(
        runs: list[Run],
        objective: Objective,
        totals: Mapping[Run, float] = MappingProxyType({}),
        fastest: Mapping[Run, TimedMotion] = MappingProxyType({}),
    ) -> dict[Run, TimedMotion]:
        found, failed = {}, {}
        for run in runs:
            total = totals.get(run)
            # what is not fastest has not the knots of what is
            start = starts.get(run) if objective.only_time and total is None else fastest.get(run)
            problem = timing_problem(task, run, objective, total)
            if objective.only_time and total is None and not problem.free.any():
                problem = replace(problem, objective=SMOOTHEST)
            try:
                found[run] = solved(problem, watch, start)
            except NoMotionError as error:
                failed[run] = error
        if failed:
            raise _NoMotionsError(task, failed)
        return found

    watch.work = sum(len(run.waypoints) - 1 for run in runs)
    if free.total is None:
        return list(found_for(runs, objective).items())
    timed = [run for run in runs if free.duration[list(run.waypoints)[:-1]].any()]
    watch.work += sum(len(run.waypoints) - 1 for run in timed)
    fastest = found_for(timed, Objective())
    spans = {run: motion.duration for run, motion in fastest.items()}
    given = given_time(task, timed)
    shortest = given + sum(spans.values())
    if free.total < shortest:
        if any(motion.status == "stopped" for motion in fastest.values()):
            with scenario.error_context("duration"):
                raise TimingError(
                    f"no motion of {free.total:g} s was found within the budget of "
                    f"{watch.budget:g} s, the shortest lasts {with_room(shortest):.6g} s; "
                    "allow more time",
                    limit="budget",
                )
        raise total_too_short(task, shortest)
    stretch = (free.total - given) / sum(spans.values())
    totals = {run: stretch * span for run, span in spans.items()}
    try:
        return list(found_for(runs, objective, totals, fastest).items())
    except _NoMotionsError as failed:
        error = failed.told()
        error.add(f"the shortest motion that was found lasts {with_room(shortest):.6g} s")
        raise error from None
