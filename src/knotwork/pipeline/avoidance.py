"""The next best sequences of solutions, tried where a motion collides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol, TypeVar

import numpy as np

from knotwork.errors import InputError, NoWayFoundError
from knotwork.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.task_to_joint import Step, TaskSolution
from knotwork.verification.checked_motion import AT_WAYPOINT
from knotwork.verification.collisions import (
    collision_note,
    failed_pairs,
)
from knotwork.verification.finding import TRIED
from knotwork.waypoints import FloatArray

PlanT = TypeVar("PlanT", bound=Any)
"""A plan, of which scenario, space, report, solution and chosen times are read."""


class Planner(Protocol[PlanT]):
    """Plans one scenario with any sequence of solutions of its poses.

    Attributes:
        most: Maximum number of sequences to plan.
    """

    @property
    def most(self) -> int:
        """See the class."""

    def solve(self, avoided: Sequence[Step]) -> TaskSolution:
        """Find the best sequence of solutions without some steps."""

    def plan(self, solution: TaskSolution | None) -> PlanT:
        """Plan a sequence of solutions, by default the best."""

    def late(self) -> bool:
        """Whether the time budget has ended."""

    def with_ways(self, ends: Sequence[int]) -> Planner[PlanT] | None:
        """The planner of the task with `way: clear` at some waypoints, if times are chosen."""


def best_of_sequences(planner: Planner[PlanT]) -> PlanT:
    """Plan the best sequence of solutions whose motion collides nowhere.

    Where the motion between two waypoints collides, or none is found, the solutions at both are not
    combined again, and the next best sequence is planned, as long as one may be feasible and clear.
    If all of them collide, `way: clear` is tried where times are chosen; where that fails, the plan
    with the fewest colliding pairs is returned. The report lists what was tried.

    Raises:
        NoWayFoundError: For the best sequence, if no motion is found for any of them.
        InputError: The task is wrong.
    """
    best: PlanT | None = None
    first_error: NoWayFoundError | None = None
    solution: TaskSolution | None = None
    blocked: Sequence[int] | None = None
    avoided: list[Step] = []
    known: list[FloatArray] = []
    tried = 0
    while True:
        try:
            plan = planner.plan(solution)
        except NoWayFoundError as error:
            first_error, blocked = first_error or error, None
            if error.waypoints is not None:
                blocked = range(error.waypoints[0], error.waypoints[-1])
                solution = solution or planner.solve(())
        except InputError:
            if solution is None:
                raise
            blocked = None  # this sequence has no motion, however slow
        else:
            solution = plan.solution
            best = plan if best is None else min(best, plan, key=_rank)
            blocked = _colliding_intervals(plan)
        tried += 1
        if not blocked or solution is None or solution.sequence is None:
            break
        if tried == planner.most or planner.late():
            break
        q = solution.sequence
        known.append(solution.waypoints.position)
        avoided += [(i, q[i], q[i + 1]) for i in blocked]
        solution = planner.solve(avoided)
        if any(np.array_equal(one, solution.waypoints.position) for one in known):
            break
    if best is None:
        raise first_error or AssertionError("a sequence without a plan has an error")
    best = replace(best, sequences=tried)
    if failed_pairs(best.report.findings):
        return _with_detour(planner, best, tried)
    if tried == 1:
        return best
    return _with_finding(
        best,
        f"the best sequence of solutions has no clear motion; of {tried} sequences tried this is "
        "the first that has one",
    )


def _colliding_intervals(plan: Any) -> list[int]:
    """Intervals between waypoints in which a plan collides."""
    times = plan.scenario.times
    when = [one.at for one in failed_pairs(plan.report.findings) if one.at is not None]
    after = np.searchsorted(times, when, side="right")
    return sorted({int(i) for i in np.clip(after - 1, 0, len(times) - 2)})


def _with_detour(planner: Planner[PlanT], best: PlanT, tried: int) -> PlanT:
    """A plan around the obstacles that all sequences hit, or the best one and what was tried."""
    ends, late = _possible_ways(best), planner.late()
    timed, notes = _with_chosen_time(best, ends), []
    other = None if late or not timed else planner.with_ways(timed)
    if other is not None:
        ends = [i for i in ends if i not in timed]
        try:
            found = best_of_sequences(other)
        except InputError as error:
            notes.append(f"way: clear finds no motion either: {error}")
        else:
            if _rank(found) < _rank(best):
                return _with_finding(found, _taken(best, timed))
    if proposal := _proposal(best, ends):
        notes.append(proposal)
    when = " when the budget ended" if late else ""
    if tried > 1:
        notes.append(
            f"tried: {tried} sequences of solutions{when}, all of which collide; this one has the "
            "fewest colliding pairs"
        )
    elif late:
        notes.append(f"tried: one sequence of solutions{when}, which collides")
    return _with_finding(best, "; ".join(notes), TRIED) if notes else best


def _rank(plan: Any) -> tuple[int, int]:
    """Rank of a plan, smaller is better: number of colliding pairs, then of all failures."""
    return len(failed_pairs(plan.report.findings)), len(plan.report.failures)


def _possible_ways(plan: Any) -> list[int]:
    """Indices of waypoints at which `way: clear` could avoid a collision on the way there.

    The motion is between two collision-free waypoints and is not a tool path. Waypoints passed at a
    free velocity keep one, so that the motions to them and from them are replaced together.
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
    """The waypoints among some whose times are chosen."""
    return [i for i in ends if plan.chosen and plan.chosen.asked.free.duration[i - 1]]


def _named(plan: Any, ends: Sequence[int]) -> str:
    return " and ".join(repr(plan.scenario.waypoints[i].name) for i in ends)


def _proposal(plan: Any, ends: Sequence[int]) -> str:
    """Proposal of `way: clear` for some waypoints, or an empty text."""
    if not ends or plan.scenario.scene.moves:
        return ""
    motions = "the motion find its way" if len(ends) == 1 else "these motions find their way"
    passed = plan.chosen and any(plan.chosen.asked.free.speed[i] == "free" for i in ends)
    # ways that are passed at a free velocity are one motion, and take no times
    times = " without times" if passed and len(_with_chosen_time(plan, ends)) < len(ends) else ""
    return f"way: clear at {_named(plan, ends)}{times} lets {motions} (not tried)"


def _taken(plan: Any, ends: Sequence[int]) -> str:
    """Message that `way: clear` was taken without being requested."""
    return f"the fastest motion collides, so way: clear was taken at {_named(plan, ends)}"


def _with_finding(plan: PlanT, message: str, quantity: str = "sequences_tried") -> PlanT:
    """The plan with a finding on the sequences of solutions that were tried."""
    finding = collision_note(quantity, message)
    report = replace(plan.report, findings=(*plan.report.findings, finding))
    return replace(plan, report=report)
