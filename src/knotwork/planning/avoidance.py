"""Further sequences of solutions, planned when a motion collides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from knotwork.curves.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.errors import InputError, NoWayFoundError
from knotwork.planning.planned_motion import Plan
from knotwork.planning.scenario_planner import ScenarioPlanner
from knotwork.planning.task_to_joint import SequenceStep, TaskSolution
from knotwork.task.scenario import Unknowns, resolve_task
from knotwork.verification.checked_motion import AT_WAYPOINT
from knotwork.verification.collisions import collision_note, failed_pairs
from knotwork.verification.finding import TRIED
from knotwork.waypoints import FloatArray


def best_of_sequences(planner: ScenarioPlanner) -> Plan:
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
    blocked: Sequence[int] | None = None
    avoided: list[SequenceStep] = []
    planned: list[FloatArray] = []
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
            blocked = None  # this sequence has no motion at any duration
        else:
            solution = plan.solution
            best = plan if best is None else min(best, plan, key=_rank)
            blocked = _colliding_intervals(plan)
        tried += 1
        if not blocked or solution is None or solution.sequence is None:
            break
        if tried == planner.max_sequences or planner.budget.is_over:
            break
        q = solution.sequence
        planned.append(solution.waypoints.position)
        avoided += [(i, q[i], q[i + 1]) for i in blocked]
        solution = planner.solve(avoided)
        if any(np.array_equal(q, solution.waypoints.position) for q in planned):
            break
    if best is None:
        raise first_error or AssertionError("a sequence without a plan has an error")
    best = replace(best, tried_sequences=tried)
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


def _with_clear_motion(planner: ScenarioPlanner, best: Plan, tried: int) -> Plan:
    """A plan around the obstacles that all sequences hit, or the best plan and the attempts."""
    ends, late, notes = _avoidable_ends(best), planner.budget.is_over, []
    timed = _with_chosen_time(best, ends)
    if timed and not late:
        scenario, ends = planner.scenario, [i for i in ends if i not in timed]
        clear = scenario.given.with_waypoints(
            {scenario.task_index[i]: {"way": "clear"} for i in timed}
        )
        try:
            scenario = resolve_task(clear, scenario.places)
            detour = best_of_sequences(replace(planner, scenario=scenario))
        except InputError as error:
            notes.append(f"way: clear finds no motion either: {error}")
        else:
            if _rank(detour) < _rank(best):
                names = _quoted_names(best, timed)
                return _with_finding(
                    detour, f"the fastest motion collides, so way: clear was taken at {names}"
                )
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


def _rank(plan: Plan) -> tuple[int, int]:
    """Number of colliding pairs and of failures, by which plans are compared; smaller is better."""
    return len(failed_pairs(plan.report.findings)), len(plan.report.failures)


def _avoidable_ends(plan: Plan) -> list[int]:
    """Waypoints, by index, at which `way: clear` could avoid a collision of the motion to them.

    This motion is between two collision-free waypoints and is not a tool path. Waypoints with a
    free velocity keep it, so that the motions to them and from them are replaced together.
    """
    scenario = plan.scenario
    requested = scenario if plan.chosen is None else plan.chosen.requested
    unknowns = requested.unknowns
    planner, _ = planner_and_rule(requested.task.planner)
    if "chosen" not in PLANNER_SPECS[planner].supports or requested.given.chosen:
        return []
    fixed = {i for path in scenario.paths for i in range(path.first, path.last)}
    fixed |= set(plan.space.waits) | {end - 1 for end in (unknowns.ways if unknowns else ())}
    hit: set[int] = set()
    blocked: set[int] = set()
    for start, end in (s for pair in failed_pairs(plan.report.findings) for s in pair.spans):
        first, last = np.searchsorted(scenario.times, (start - AT_WAYPOINT, end + AT_WAYPOINT))
        hit.add(int(first) - 1)
        blocked.update(range(int(first) - 1, int(last)) if last > first else ())
    ends, unusable = ({i + 1 for i in starts} for starts in (hit - fixed - blocked, blocked))
    passed = [i for i, kind in enumerate(unknowns.speed if unknowns else ()) if kind == "free"]
    for i in (*passed, *reversed(passed)):
        for together in (ends, unusable):
            if together & {i, i + 1}:
                together |= {i, i + 1}
    return sorted(ends - unusable)


def _chosen_unknowns(plan: Plan) -> Unknowns | None:
    """Unknowns that were chosen for a plan."""
    return None if plan.chosen is None else plan.chosen.requested.unknowns


def _with_chosen_time(plan: Plan, ends: Sequence[int]) -> list[int]:
    """The waypoints among some whose times are chosen."""
    unknowns = _chosen_unknowns(plan)
    return [i for i in ends if unknowns and unknowns.duration[i - 1]]


def _quoted_names(plan: Plan, ends: Sequence[int]) -> str:
    return " and ".join(repr(plan.scenario.waypoints[i].name) for i in ends)


def _proposal(plan: Plan, ends: Sequence[int]) -> str:
    """Proposal of `way: clear` for some waypoints, or an empty text."""
    if not ends or plan.scenario.scene.has_moving_bodies:
        return ""
    collisions = "the collision" if len(ends) == 1 else "the collisions"
    unknowns = _chosen_unknowns(plan)
    passed = unknowns and any(unknowns.speed[i] == "free" for i in ends)
    # motions joined at a free velocity are one motion, which takes no times
    times = " without times" if passed and len(_with_chosen_time(plan, ends)) < len(ends) else ""
    return (
        f"way: clear at {_quoted_names(plan, ends)}{times} may avoid {collisions} (not attempted)"
    )


def _with_finding(plan: Plan, message: str, quantity: str = "sequences_tried") -> Plan:
    """The plan with a finding on the planned sequences of solutions."""
    finding = collision_note(quantity, message)
    report = replace(plan.report, findings=(*plan.report.findings, finding))
    return replace(plan, report=report)
