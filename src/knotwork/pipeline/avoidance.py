"""The next best sequences of solutions, tried where a motion collides."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, Generic, TypeVar

import numpy as np

from knotwork.errors import InputError, NoWayFoundError
from knotwork.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.task_to_joint import Step, TaskSolution
from knotwork.verification.collisions import (
    failed_pairs,
    motion_finding,
)
from knotwork.verification.finding import TRIED, Finding
from knotwork.verification.motion import AT_WAYPOINT

PlanT = TypeVar("PlanT", bound=Any)
"""A plan, of which scenario, space, trajectory, report and solution are looked at."""

MOST_SEQUENCES = 12
"""Largest number of sequences of solutions to try, the best one included."""

MOST_TIMED = 4
"""The same where the times are chosen anew for each."""


def best_of_sequences(
    first: PlanT,
    solve: Callable[[Sequence[Step]], TaskSolution],
    made: Callable[[TaskSolution], PlanT | None],
    most: int = MOST_SEQUENCES,
    around: Callable[[list[int]], PlanT] | None = None,
) -> PlanT:
    """Take the best sequence of solutions whose motion collides nowhere.

    Where the motion of a sequence collides between two waypoints, the solutions that it has at both
    are not taken together again, and the next best sequence is planned, as long as one may be
    feasible and clear. If all of them collide, motions whose time is chosen find their way; where
    that fails, the one with the fewest colliding pairs is given, and its report says how many were
    tried, and which motions could find their way.

    Args:
        first: The plan of the best sequence.
        solve: Finds the best sequence without some steps.
        made: Plans a sequence; `None` if there is no time left for it.
        most: Largest number to try, the first one included.
        around: Plans the task with `way: clear` at some waypoints, by index.
    """
    sequences = _Sequences(first, solve, made, most)
    best = current = first
    while (failed := failed_pairs(current.report.findings)) and (
        other := sequences.without(current, [found.at for found in failed])
    ):
        current = other
        best = min(best, current, key=_worth)
    if sequences.tried > 1 and not failed_pairs(best.report.findings):
        best = _with_finding(
            best,
            "the motion of the best sequence of solutions collides; of "
            f"{sequences.tried} sequences tried this is the first that does not",
        )
    else:
        ends, detour = _possible_ways(best), ""
        timed = _with_chosen_time(best, ends)
        if around is not None and timed and not sequences.late:
            try:
                found = around(timed)
            except InputError as error:
                detour = f"way: clear finds no motion either: {error}"
            else:
                if _worth(found) < _worth(best):
                    return _with_finding(found, _taken(best, timed))
            ends = [i for i in ends if i not in timed]
        told = filter(None, (detour, _proposal(best, ends), sequences.in_vain(failed)))
        if line := "; ".join(told):
            best = _with_finding(best, line, TRIED)
    return replace(best, sequences=sequences.tried)


def first_with_ways(
    made: Callable[[TaskSolution | None], PlanT],
    solve: Callable[[Sequence[Step]], TaskSolution],
    most: int,
) -> PlanT:
    """Take the best sequence of solutions between which all ways are found.

    Args:
        made: Plans a sequence, by default the best.
        solve: Finds the best sequence without some steps.
        most: Largest number to try.

    Raises:
        NoWayFoundError: As for the best sequence, if no way is found in any that is tried.
    """
    try:
        return made(None)
    except NoWayFoundError as error:
        if error.waypoints is None:
            raise
        missing, first = error, error
    current = solve(())
    others = _Others(solve, current)
    for tried in range(2, most + 1):
        if missing.waypoints is None:
            break
        between = range(missing.waypoints[0], missing.waypoints[-1])
        try:
            other = others.without(current, between)
        except InputError:
            break
        if other is None:
            break
        current = other
        try:
            plan = made(other)
        except NoWayFoundError as error:
            missing = error
        else:
            return _with_finding(
                plan,
                "no way was found in the best sequence of solutions; of "
                f"{tried} tried this is the first with one",
            )
    raise first


class _Others:
    """The best sequence of solutions, and the next best ones, each once."""

    def __init__(
        self, solve: Callable[[Sequence[Step]], TaskSolution], first: TaskSolution | None
    ) -> None:
        self.solve = solve
        self.known = [] if first is None else [first.waypoints.position]
        self.avoided: list[Step] = []

    def without(self, solution: TaskSolution, intervals: Iterable[int]) -> TaskSolution | None:
        """The best one without the steps of another in some intervals; `None` if no more."""
        q = solution.sequence
        if q is None:
            return None
        self.avoided += [(int(i), q[i], q[i + 1]) for i in intervals]
        other = self.solve(self.avoided)
        if any(np.array_equal(one, other.waypoints.position) for one in self.known):
            return None
        self.known.append(other.waypoints.position)
        return other


class _Sequences(Generic[PlanT]):
    """The next best sequences of solutions, each planned.

    Attributes:
        most: Largest number to try.
        tried: Number tried.
        late: Whether there was no time left for another one.
    """

    def __init__(
        self,
        first: PlanT,
        solve: Callable[[Sequence[Step]], TaskSolution],
        made: Callable[[TaskSolution], PlanT | None],
        most: int,
    ) -> None:
        self.made, self.most, self.tried, self.late = made, most, 1, False
        self.others = _Others(solve, first.solution)

    def without(self, plan: PlanT, times: Sequence[float | None]) -> PlanT | None:
        """The next best one, without the steps that a plan takes at some times; `None` if no more.

        Args:
            plan: The one that was planned last.
            times: At these it is not good [s].
        """
        if self.tried >= self.most or plan.solution is None:
            return None
        when = [time for time in times if time is not None]
        after = np.searchsorted(plan.scenario.times, when, side="right")
        intervals = np.unique(np.clip(after - 1, 0, len(plan.scenario.times) - 2))
        other = self.others.without(plan.solution, intervals)
        if other is None:
            return None
        try:
            made = self.made(other)
        except InputError:  # there is no such motion, however slow
            self.tried += 1
            return None
        self.late = made is None
        self.tried += not self.late
        return made

    def in_vain(self, failed: Sequence[Finding]) -> str:
        """How many were tried that all collide, in words; empty where no other one was looked for.

        Args:
            failed: What fails of the last one.
        """
        late = " when the budget ended" if self.late else ""
        if self.tried > 1:
            return (
                f"tried: {self.tried} sequences of solutions{late}, all of which collide; this one "
                "has the fewest colliding pairs"
            )
        return f"tried: one sequence of solutions{late}, which collides" if failed and late else ""


def _worth(plan: Any) -> tuple[int, int]:
    """What a plan is judged by, smaller is better: pairs that collide, and all else that fails."""
    return len(failed_pairs(plan.report.findings)), len(plan.report.failures)


def _possible_ways(plan: Any) -> list[int]:
    """Waypoints to which a motion collides that could find its way, by index.

    It lies between two waypoints that collide with nothing, and is no tool path. What is passed at
    a free velocity is passed at one by ways, too: they lead to it and on from it.
    """
    scenario = plan.scenario
    asked = scenario if plan.chosen is None else plan.chosen.asked
    planner, _ = planner_and_rule(asked.planner)
    if "chosen" not in PLANNER_SPECS[planner].supports or asked.task.chosen:
        return []
    fixed = {i for path in scenario.paths for i in range(path.first, path.last)}
    fixed |= set(plan.space.waits) | {end - 1 for end in (asked.free.ways if asked.free else ())}
    hit: set[int] = set()
    blocked: set[int] = set()
    for start, end in (span for one in failed_pairs(plan.report.findings) for span in one.spans):
        first, last = np.searchsorted(scenario.times, (start - AT_WAYPOINT, end + AT_WAYPOINT))
        hit.add(int(first) - 1)
        blocked.update(range(int(first) - 1, int(last)) if last > first else ())
    ends, vain = ({i + 1 for i in some} for some in (hit - fixed - blocked, blocked))
    passed = [i for i, kind in enumerate(asked.free.speed if asked.free else ()) if kind == "free"]
    for i in (*passed, *reversed(passed)):
        for together in (ends, vain):
            if together & {i, i + 1}:
                together |= {i, i + 1}
    return sorted(ends - vain)


def _with_chosen_time(plan: Any, ends: Sequence[int]) -> list[int]:
    """Those of some waypoints whose time is chosen."""
    return [i for i in ends if plan.chosen and plan.chosen.asked.free.duration[i - 1]]


def _named(plan: Any, ends: Sequence[int]) -> str:
    return " and ".join(repr(plan.scenario.waypoints[i].name) for i in ends)


def _proposal(plan: Any, ends: Sequence[int]) -> str:
    """Which motions could find their way, in words; empty where none could."""
    if not ends or plan.scenario.scene.moves:
        return ""
    motions = "the motion find its way" if len(ends) == 1 else "these motions find their way"
    passed = plan.chosen and any(plan.chosen.asked.free.speed[i] == "free" for i in ends)
    # ways that are passed at a free velocity are one motion, and take no times
    times = " without times" if passed and len(_with_chosen_time(plan, ends)) < len(ends) else ""
    return f"way: clear at {_named(plan, ends)}{times} lets {motions} (not tried)"


def _taken(plan: Any, ends: Sequence[int]) -> str:
    """That motions find their way though they were not asked to, in words."""
    return f"the fastest motion collides, so way: clear was taken at {_named(plan, ends)}"


def _with_finding(plan: PlanT, message: str, quantity: str = "sequences_tried") -> PlanT:
    """The plan with a finding on the sequences of solutions that were tried."""
    finding = motion_finding(quantity, message)
    report = replace(plan.report, findings=(*plan.report.findings, finding))
    return replace(plan, report=report)
