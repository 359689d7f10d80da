"""`plan`: from a scenario to a checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.errors import InputError, NoWayFoundError
from knotwork.planning.planned_motion import Plan
from knotwork.planning.sequence_planner import SequencePlanner
from knotwork.planning.task_to_joint import SequenceStep, TaskSolution
from knotwork.planning.timing.timed_motion import Budget, Progress
from knotwork.task import Task
from knotwork.task.scenario import Scenario, load_scenario
from knotwork.task.scenario.resolve import change_task
from knotwork.verification.collisions import COLLISIONS, failed_pairs
from knotwork.verification.finding import TRIED, Finding
from knotwork.verification.motion import AT_WAYPOINT

TIMED_SEQUENCES, FREE_SEQUENCES = 12, 4
"""Maximum number of sequences of solutions to plan: with given times, with free times."""


def plan(
    scenario: str | Path | Mapping[str, Any] | Task | Scenario,
    *,
    planner: str | None = None,
    budget: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Plan a scenario and check the result.

    Free times and speeds are chosen first; `Plan.scenario` has numbers in their place.

    >>> lift = [{"joints": {"lift": 0}}, {"joints": {"lift": 1}, "after": 2}]
    >>> plan = kw.plan({"waypoints": lift})
    >>> plan.report.ok, plan.trajectory.position(1.0)
    (True, array([0.5]))

    Args:
        scenario: A task, the name of a shipped scenario, the path of a file, a mapping with the
            same keys, or a loaded scenario.
        planner: Planner in place of the scenario's; a rule may follow after a colon, as in
            `"quintic:estimated"`. Options that it does not support are left out, and
            `Plan.unsupported_options` names them.
        budget: Computing time for free times [s], by default unlimited. Segments that are not
            solved within it rest at each waypoint.
        progress: Callback of the solver for free times.

    Returns:
        The plan. `report.ok` is true if the motion meets all requirements. An exceeded limit raises
        no error.

    Raises:
        InputError: The scenario is wrong, or a waypoint is infeasible. The error names the field,
            its location, the value and the accepted values.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if scenario.free_values is None:
        return best_of_sequences(SequencePlanner(scenario, planner))
    from knotwork.planning.choosing import ChosenTimes, fix_arrival_times

    requested, free = scenario, scenario.free_values
    fixed_arrivals = tuple(
        scenario.waypoints[i].name
        for i in free.time_dependent
        if free.waypoints[i].duration_is_free
    )
    work = Budget(progress, budget)
    if free.time_dependent:
        scenario = fix_arrival_times(scenario, work)
    best = best_of_sequences(SequencePlanner(scenario, planner, work, fixed_arrivals))
    if best.chosen is None and best.solution is not None:  # nothing was free any more
        best = replace(best, chosen=ChosenTimes(requested, scenario, best.solution))
    return best


def best_of_sequences(planner: SequencePlanner) -> Plan:
    """Plan the best sequence of solutions whose motion is collision-free.

    If the motion between two waypoints collides, or no motion is found, the solutions at both ends
    are not combined again. The next best sequence is planned, as long as one may be feasible and
    clear. If all sequences collide, motions with chosen times are planned with `way: clear`. If
    that fails, the plan with the fewest colliding pairs is returned. The report lists these
    attempts.

    Raises:
        NoWayFoundError: For the best sequence, if no motion is found for any of them.
        InputError: The task is wrong.
    """
    best: Plan | None = None
    first_error: NoWayFoundError | None = None
    solution: TaskSolution | None = None
    avoided: list[SequenceStep] = []
    planned: list[FloatArray] = []
    tried, is_timed = 0, planner.scenario.free_values is None
    max_sequences = TIMED_SEQUENCES if is_timed else FREE_SEQUENCES
    while True:
        blocked: Sequence[int] = ()
        try:
            plan = planner.plan(solution)
        except NoWayFoundError as error:
            first_error = first_error or error
            if error.waypoints is not None:
                blocked = range(error.waypoints[0], error.waypoints[-1])
                solution = solution or planner.solve()
        except InputError:  # this sequence has no motion at any duration
            if solution is None:
                raise
        else:
            solution = plan.solution
            best = plan if best is None else min(best, plan, key=_rank)
            blocked = _colliding_intervals(plan)
        tried += 1
        is_last = tried == max_sequences or planner.budget.is_over
        if is_last or not blocked or solution is None or solution.sequence is None:
            break
        q = solution.sequence
        planned.append(solution.waypoints.position)
        avoided += [(i, q[i], q[i + 1]) for i in blocked]
        solution = planner.solve(avoided)
        if any(np.array_equal(q, solution.waypoints.position) for q in planned):
            break
    if best is None:
        raise first_error or AssertionError("no sequence of solutions was tried")
    if failed_pairs(best.report.findings):
        return _with_clear_motion(planner, best, tried)
    if tried == 1:
        return best
    return _with_finding(
        best,
        f"the best sequence of solutions has no clear motion; of {tried} sequences tried this is "
        "the first that has one",
    )


def _colliding_intervals(plan: Plan) -> list[int]:
    """Intervals between waypoints in which a plan collides."""
    times = plan.scenario.times
    pairs = failed_pairs(plan.report.findings)
    after = np.searchsorted(times, [p.at for p in pairs if p.at is not None], side="right")
    return sorted({int(i) for i in np.clip(after - 1, 0, len(times) - 2)})


def _with_clear_motion(planner: SequencePlanner, best: Plan, tried: int) -> Plan:
    """A plan around the obstacles that all sequences hit, or the best plan and the attempts."""
    requested, late, notes = planner.scenario, planner.budget.is_over, list[str]()
    free = requested.free_values
    ends = _avoidable_ends(best)
    timed = [i for i in ends if free and free.waypoints[i].duration_is_free]
    if timed and not late:
        ends = [i for i in ends if i not in timed]
        ways = {requested.task_index[i]: {"way": "clear"} for i in timed}
        try:
            scenario = change_task(requested, requested.given.with_waypoints(ways))
            detour = best_of_sequences(replace(planner, scenario=scenario))
        except InputError as error:
            notes.append(f"way: clear finds no motion either: {error}")
        else:
            if _rank(detour) < _rank(best):
                names = _quoted_names(best, timed)
                return _with_finding(
                    detour, f"the fastest motion collides, so way: clear was taken at {names}"
                )
    if ends and not best.scenario.scene.has_moving_bodies:
        collisions = "the collision" if len(ends) == 1 else "the collisions"
        # motions joined at a free velocity are one motion, which takes no times
        passed = free and any(free.waypoints[i].speed_kind == "free" for i in ends)
        times = " without times" if passed and not set(ends) <= set(timed) else ""
        notes.append(
            f"way: clear at {_quoted_names(best, ends)}{times} may avoid {collisions} "
            "(not attempted)"
        )
    if tried > 1:
        notes.append(
            f"tried: {tried} sequences of solutions{' when the budget ended' if late else ''}, all "
            "of which collide; this one has the fewest colliding pairs"
        )
    elif late:
        notes.append("tried: one sequence of solutions when the budget ended, which collides")
    return _with_finding(best, "; ".join(notes), TRIED) if notes else best


def _rank(plan: Plan) -> tuple[int, int]:
    """Number of colliding pairs and of failures, by which plans are compared; smaller is better."""
    return len(failed_pairs(plan.report.findings)), len(plan.report.failures)


def _avoidable_ends(plan: Plan) -> list[int]:
    """Waypoints, by index, at which `way: clear` could avoid a collision of the motion to them.

    This motion is between two collision-free waypoints and is not a tool path. Waypoints with a
    free velocity keep it. Thus the motions to them and from them are replaced together.
    """
    scenario = plan.scenario
    requested = scenario if plan.chosen is None else plan.chosen.requested
    at_waypoints = requested.free_values.waypoints if requested.free_values else ()
    planner, _ = planner_and_rule(scenario.planner)
    if "chosen" not in PLANNER_SPECS[planner].supports or requested.given.chosen:
        return []
    fixed = {i for path in scenario.paths for i in range(path.first, path.last)}
    fixed |= set(plan.space.waits) | {i - 1 for i, at in enumerate(at_waypoints) if at.way}
    hit: set[int] = set()
    blocked: set[int] = set()
    for start, end in (s for pair in failed_pairs(plan.report.findings) for s in pair.spans):
        first, last = np.searchsorted(scenario.times, (start - AT_WAYPOINT, end + AT_WAYPOINT))
        hit.add(int(first) - 1)
        blocked.update(range(int(first) - 1, int(last)) if last > first else ())
    ends, unusable = ({i + 1 for i in starts} for starts in (hit - fixed - blocked, blocked))
    passed = [i for i, at in enumerate(at_waypoints) if at.speed_kind == "free"]
    for i in (*passed, *reversed(passed)):
        for together in (ends, unusable):
            if together & {i, i + 1}:
                together |= {i, i + 1}
    return sorted(ends - unusable)


def _quoted_names(plan: Plan, ends: Sequence[int]) -> str:
    return " and ".join(repr(plan.scenario.waypoints[i].name) for i in ends)


def _with_finding(plan: Plan, message: str, quantity: str = "sequences_tried") -> Plan:
    """The plan with a finding on the planned sequences of solutions."""
    finding = Finding.of_motion(COLLISIONS, quantity, message)
    report = replace(plan.report, findings=(*plan.report.findings, finding))
    return replace(plan, report=report)
